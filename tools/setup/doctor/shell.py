"""All checks of one rig, for one service or for all that this machine may run."""

import time
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from socket import gethostname

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import pip_install
from zenocap.common.messages import ServiceInfo
from zenocap.common.observe.view import RigView, observed
from zenocap.common.rig.animator import FoxgloveTable
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import MAIN, SERVICES, kinds_of, services_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.clock_offset import offset_at
from zenocap.common.runtime.compiled import is_compiled
from zenocap.common.runtime.service_info import versions
from zenocap.common.topics import CAMERA_ADVICE, HEALTH
from zenocap.tools.setup.doctor import machine_checks as machine
from zenocap.tools.setup.doctor import machine_probe as probe
from zenocap.tools.setup.doctor import network_checks as net
from zenocap.tools.setup.doctor.finding import CheckResult, warning
from zenocap.tools.setup.doctor.machine_checks import Port
from zenocap.tools.setup.doctor.network_checks import NetworkState

OPEN_S = 4.0
LISTEN_S = 2.5  # health is published once a second
TRIPS = 5


def examine(rig: Rig, path: Path, options: ZenohOptions, takes: Path, service: str | None) -> list[CheckResult]:
    """Results of all checks.  takes: folder of the takes.  service: such as viewer-1; None for all of the rig."""
    name, _, id = (service or "").partition("-")
    chosen = [viewer for viewer in rig.viewers if service is None or (name == "viewer" and viewer.id == id)]
    kinds = [kind for kind in SERVICES if (kind in kinds_of(rig) if service is None else kind.name == name)]
    wanted = [kind.name for kind in kinds]
    endpoints = [probe.probe_endpoint(address, options.security) for address in options.connect]
    network = look_at_network(options, rig.name)
    frame_ns = min(round(1e9 / viewer.fps) for viewer in rig.viewers)
    expected = services_of(rig, required=True)
    found = [*map(machine.check_endpoint, endpoints), net.check_open(network, options.security is not None)]
    if network.problem is None:
        found += net.check_presence(expected, network, str(path))
        found += [*net.check_rigs(rig.digest, network), *net.check_versions(versions(), network)]
        found += [*net.check_clocks(network, frame_ns), *net.check_delays(network, frame_ns)]
        found += [*net.check_messages(network), *net.check_pictures(network)]
    for viewer in chosen:
        runs = ("viewer", viewer.id) in network.alive
        found.append(machine.check_source(probe.look_at_source(viewer, runs=runs, local=service is not None)))
    found += [machine.check_file(title, probe.look_at_file(file)) for kind in kinds for title, file in kind.files(rig)]
    if "integrator" in wanted:
        found.append(machine.check_disk(probe.look_at_disk(takes)))
    if "animator" in wanted:
        found += map(machine.check_port, _ports(rig, ours=_runs_here("animator", network)))
    if rig.security is not None and find_spec("cryptography") is None:
        text = "cannot be checked: the package cryptography is not installed on this machine"
        found.append(warning("certificates", text, pip_install("certs")))
    elif rig.security is not None:
        names = [service] if service is not None else probe.certified(rig.security)
        found += [
            machine.check_certificate(one, datetime.now(UTC)) for one in probe.look_at_certificates(rig.security, names)
        ]
    parts = list(dict.fromkeys(part for kind in kinds for part in kind.warmup(rig)))
    if parts:
        found.append(machine.check_compiled([part for part in parts if not is_compiled(part)]))
    return found


def look_at_network(options: ZenohOptions, rig: str) -> NetworkState:
    """Liveliness, health and information of all services, and this machine's clock offset to the integrator."""
    clock = RealClock()
    deadline_s = time.monotonic() + OPEN_S
    try:
        with ZenohBus.open(options, rig, clock, lambda: time.monotonic() > deadline_s) as bus:
            bus.watch_alive()
            bus.subscribe(HEALTH)
            bus.subscribe(CAMERA_ADVICE)
            view, sent_queries = RigView(rig), 0
            started_s = time.monotonic()
            while (elapsed_s := time.monotonic() - started_s) < LISTEN_S:
                if elapsed_s > (1 + sent_queries) * LISTEN_S / (TRIPS + 1):
                    bus.query_clock()
                    sent_queries += 1
                if (event := bus.receive(0.1)) is not None:
                    view = observed(view, event, clock.elapsed_ns())
            about = bus.query_service_info(1.0)
            advice = {id: one.advice for (_, id), one in view.services.items() if one.advice is not None}
            return NetworkState(None, view.alive, about, view.health, offset_at(view.trips, clock.now_ns()), advice)
    except BusError as error:
        return NetworkState(str(error))


def _ports(rig: Rig, *, ours: bool) -> list[Port]:
    """Ports on which the animator listens."""
    page, foxglove = rig.animator.page, rig.animator.outputs.get("foxglove")
    found = []
    if page.enabled and page.port:
        found.append(probe.look_at_port("page", "animator.page.port", page.host, page.port, ours=ours))
    if isinstance(foxglove, FoxgloveTable) and foxglove.enabled:
        found.append(
            probe.look_at_port("Foxglove output", "animator.foxglove.port", foxglove.host, foxglove.port, ours=ours)
        )
    return found


def _runs_here(service: str, network: NetworkState) -> bool:
    """Whether a service of the rig runs on this machine."""
    about = network.about.get((service, MAIN))
    return isinstance(about, ServiceInfo) and about.host == gethostname()
