"""Checks of the network: services, their rig files and versions, clocks and messages."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from zenocap.common.camera_advice import change_text, found_text
from zenocap.common.lags.delays import SKEW_US
from zenocap.common.messages import CameraAdvice, Health, ServiceInfo
from zenocap.common.rig.services import MAIN, TIMEKEEPER, ServiceKey, title
from zenocap.common.runtime.clock_offset import Offset, clock_warning, offset_in
from zenocap.tools.setup.doctor.finding import CheckResult, ok, warning, wrong

# With different versions of these, messages cannot be decoded or poses differ; other versions are only in the take.
MUST_AGREE = ("zenocap", "wire")
SHOULD_AGREE = ("eclipse-zenoh", "msgspec", "python")


@dataclass(frozen=True)
class NetworkState:
    """Observations of a few seconds.  problem: why the network could not be opened; None when it could.

    about: service information, or an error text.  advice: by viewer.  offset: of this machine's clock to the integrator's.
    """

    problem: str | None = None
    alive: frozenset[ServiceKey] = frozenset()
    about: Mapping[ServiceKey, ServiceInfo | str] = field(default_factory=dict)
    health: Mapping[ServiceKey, Health] = field(default_factory=dict)
    offset: Offset | None = None
    advice: Mapping[str, CameraAdvice] = field(default_factory=dict)


def check_open(network: NetworkState, secured: bool) -> CheckResult:
    if network.problem is None:
        return ok("network", "open")
    remedy = "start the router or the other services, and check that the endpoints agree"
    hint = "; is this machine's certificate of the rig's authority?" if secured else ""
    return wrong("network", network.problem, f"{remedy}{hint}")


def check_presence(expected: Sequence[ServiceKey], network: NetworkState, rig: str) -> list[CheckResult]:
    """Check for expected services that do not run.  A rig of which no service runs is not a fault."""
    if not network.alive & set(expected):
        return [ok("services", "no service is running, or none can be reached from this machine")]
    found = [ok(title(name), "is running") for name in expected if name in network.alive]
    for service, id in (name for name in expected if name not in network.alive):
        command = f"zenocap {service} {rig}" + (f" --id {id}" if service == "viewer" else "")
        found.append(warning(title((service, id)), "is not on the network", f"start it on its machine: {command}"))
    return found


def check_rigs(digest: str, network: NetworkState) -> list[CheckResult]:
    """Check for services with another rig file or calibration than this machine."""
    infos = {name: about for name, about in network.about.items() if isinstance(about, ServiceInfo)}
    others = {name: about for name, about in infos.items() if about.digest != digest}
    unanswered = sorted(network.alive - network.about.keys() - {(s, i) for s, i in network.alive if s == "recorder"})
    found = [
        wrong(
            "rig file",
            f"{title(name)} on {about.host} runs with another rig file or calibration ({about.digest}) than this "
            f"machine has ({digest})",
            "copy rig file and calibration from one machine to all others, and start it again",
        )
        for name, about in sorted(others.items())
    ]
    if infos and not others:
        found.append(ok("rig file", f"the same for all {len(infos)} running services and on this machine"))
    for name, text in sorted(network.about.items()):
        if isinstance(text, str):
            unread = f"{title(name)}: its reply cannot be decoded: {text}"
            found.append(warning("versions", unread, "update it to this version"))
    if unanswered:
        silent = f"{', '.join(map(title, unanswered))}: no reply to the query for versions"
        remedy = "update zenocap there; if it is the same version, the machine is overloaded: run doctor again"
        found.append(warning("versions", silent, remedy))
    return found


def check_versions(here: Mapping[str, str], network: NetworkState) -> list[CheckResult]:
    """Check for services with other versions.  here: this machine's versions by package."""
    found: list[CheckResult] = []
    infos = {name: about for name, about in network.about.items() if isinstance(about, ServiceInfo)}
    for package in (*MUST_AGREE, *SHOULD_AGREE):
        here_version = _release(package, here.get(package, "unknown"))
        others: dict[str, list[str]] = {}
        for name, about in sorted(infos.items()):
            version = _release(package, about.versions.get(package, "unknown"))
            if version != here_version:
                others.setdefault(version, []).append(f"{title(name)} on {about.host}")
        finding = wrong if package in MUST_AGREE else warning
        for version, machines in others.items():
            text = f"{package} {version} at {', '.join(machines)}, {here_version} here"
            found.append(finding("versions", text, f"install the same {package} on every machine"))
    if infos and not found:
        packages = ", ".join(SHOULD_AGREE)
        found.append(ok("versions", f"zenocap {here.get('zenocap', 'unknown')}, {packages}: the same on all machines"))
    return found


def check_clocks(network: NetworkState, frame_ns: int) -> list[CheckResult]:
    """Check of the clock offsets.  frame_ns: frame period; an offset of up to a quarter of it is allowed."""
    clocks = [(title(name), offset_in(health)) for name, health in sorted(network.health.items())]
    known = [(name, offset) for name, offset in (*clocks, ("this machine", network.offset)) if offset is not None]
    remedy = "let NTP (chrony, systemd-timesyncd) set the clocks of all machines from one source"
    texts = [text for name, offset in known if (text := clock_warning(name, offset, frame_ns)) is not None]
    if known and not texts:
        within = f"{len(known)} clocks within a quarter frame ({frame_ns / 4e6:.0f} ms) of the integrator's"
        return [ok("clocks", within)]
    return [warning("clocks", text, remedy) for text in texts]


def check_messages(network: NetworkState) -> list[CheckResult]:
    """Check for services that reject messages or fail on them."""
    found = []
    for name, health in sorted(network.health.items()):
        rejected = sum(count for key, count in health.counts.items() if key.startswith("rejected_"))
        others = health.counts.get("rejected_version", 0)
        if others:
            text = f"{title(name)} has rejected {others} messages of another wire version"
            remedy = "install the same zenocap on every machine; its log names the senders' keys"
            found.append(wrong("messages", text, remedy))
        if rejected > others:
            text = f"{title(name)} has rejected {rejected - others} invalid messages"
            remedy = "see its log for their keys; the sender has another version, or is faulty or hostile"
            found.append(warning("messages", text, remedy))
        if health.counts.get("step_errors", 0):
            text = f"{title(name)}: {health.counts['step_errors']} steps failed"
            found.append(warning("messages", text, "see its log for the error, and report it"))
    if network.health and not found:
        found.append(ok("messages", f"all valid, in {len(network.health)} services"))
    return found


def check_delays(network: NetworkState, frame_ns: int) -> list[CheckResult]:
    """Check of the delays of the cameras, as a running rig with a tracker finds them; corrected ones do not count.

    frame_ns: frame period; a difference of up to a quarter of it is allowed.
    """
    health = network.health.get((TIMEKEEPER, MAIN))
    skew_us = None if health is None else health.counts.get(SKEW_US)
    if health is None or skew_us is None:
        return []
    limit_ms = frame_ns / 4e6
    text = f"images of the cameras are {skew_us / 1e3:.0f} ms apart at equal capture times"
    if skew_us / 1e3 <= limit_ms:
        return [ok("delays", f"{text}: within a quarter frame ({limit_ms:.0f} ms)")]
    remedy = 'set delay_ms of the viewers, which zenocap sync TAKE prints, or delays = "follow" in the rig file'
    return [warning("delays", f"{text}, more than a quarter frame ({limit_ms:.0f} ms): {health.state}", remedy)]


def check_pictures(network: NetworkState) -> list[CheckResult]:
    """Check of the images of the cameras, as the running viewers measure them."""
    found = []
    for viewer, advice in sorted(network.advice.items()):
        check = f"images of viewer {viewer}"
        found += [warning(check, found_text(fault), change_text(fault)) for fault in advice.faults]
        if not advice.faults:
            found.append(ok(check, "no fault is found; contrast, size and place are measured while a person is in view"))
    return found


def _release(package: str, version: str) -> str:
    """Version to compare; of Python without the patch number, such as 3.11."""
    return ".".join(version.split(".")[:2]) if package == "python" else version
