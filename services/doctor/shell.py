"""All checks of one rig, for one service or for whatever this machine may run."""

from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from socket import gethostname

from common.about import About
from common.bus.zenoh_session import ZenohOptions
from common.runtime.rig import Rig
from common.runtime.versions import versions
from services.doctor.finding import Finding, warning
from services.doctor.machine_checks import (
    Port,
    check_certificate,
    check_compiled,
    check_disk,
    check_endpoint,
    check_file,
    check_port,
    check_source,
)
from services.doctor.machine_look import (
    certified,
    compiled,
    look_at_certificates,
    look_at_disk,
    look_at_files,
    look_at_port,
    look_at_source,
)
from services.doctor.network_checks import (
    Network,
    check_clocks,
    check_messages,
    check_open,
    check_presence,
    check_rigs,
    check_versions,
    expected_services,
)
from services.doctor.network_look import call, look_at_network

PARTS = {
    "viewer": ("common", "services/viewer"),
    "integrator": ("common", "services/integrator"),
    "tracker": ("common", "services/tracker"),
    "recognizer": ("common", "services/recognizer"),
}
EVERYTHING = ("common", *(f"services/{name}" for name in PARTS))  # what `zenocap warmup` compiles


def examine(rig: Rig, path: Path, options: ZenohOptions, takes: Path, service: str | None) -> list[Finding]:
    """Everything that can be found out.  takes: where they go.  service: such as viewer-1; None for all of the rig."""
    name, _, id = (service or "").partition("-")
    chosen = [viewer for viewer in rig.viewers if service is None or (name == "viewer" and viewer.id == id)]
    wanted = ("viewer", "integrator", "tracker", "recognizer", "animator") if service is None else (name,)
    endpoints = [call(address, options.security) for address in options.connect]
    network = look_at_network(options, rig.name)
    frame_ns = min(round(1e9 / viewer.fps) for viewer in rig.viewers)
    expected = expected_services([viewer.id for viewer in rig.viewers], rig.tracker is not None, rig.recognizer is not None)
    found = [*map(check_endpoint, endpoints), check_open(network, options.security is not None)]
    if network.problem is None:
        found += check_presence(expected, network, str(path))
        found += [*check_rigs(rig.digest, network), *check_versions(versions(), network)]
        found += [*check_clocks(network, frame_ns), *check_messages(network)]
    for viewer in chosen:
        runs = ("viewer", viewer.id) in network.alive
        found.append(check_source(look_at_source(viewer, runs=runs, local=service is not None)))
    found += map(check_file, look_at_files(rig, wanted))
    if "integrator" in wanted:
        found.append(check_disk(look_at_disk(takes)))
    if "animator" in wanted:
        found += map(check_port, _ports(rig, ours=_here("animator", network)))
    if rig.security is not None and find_spec("cryptography") is None:
        words = "cannot be looked into: the package cryptography is not installed here"
        found.append(warning("certificates", words, "pip install 'zenocap[certs]'"))
    elif rig.security is not None:
        names = [service] if service is not None else certified(rig.security)
        found += [check_certificate(one, datetime.now(UTC)) for one in look_at_certificates(rig.security, names)]
    if wanted != ("animator",):
        found.append(check_compiled(*compiled(PARTS.get(name, EVERYTHING))))
    return found


def _ports(rig: Rig, *, ours: bool) -> list[Port]:
    """What the animator listens on."""
    page, foxglove = rig.animator.page, rig.animator.foxglove
    found = []
    if page.enabled and page.port:
        found.append(look_at_port("page", "animator.page.port", page.host, page.port, ours=ours))
    if foxglove is not None and foxglove.enabled:
        found.append(look_at_port("Foxglove output", "animator.foxglove.port", foxglove.host, foxglove.port, ours=ours))
    return found


def _here(service: str, network: Network) -> bool:
    """Whether that service of the rig runs on this machine."""
    about = network.about.get((service, "main"))
    return isinstance(about, About) and about.host == gethostname()
