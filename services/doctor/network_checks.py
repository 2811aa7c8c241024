"""What the network says, judged: who is there, with which rig and versions, how their clocks and messages are."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from common.about import About
from common.messages import Health
from common.runtime.clock import Offset, clock_warning, offset_in
from services.doctor.finding import Finding, ok, warning, wrong

Name = tuple[str, str]  # of a service, and its id

# Different ones cannot read each other's messages, or compute other poses; of the rest the take says which they were.
MUST_AGREE = ("zenocap",)
SHOULD_AGREE = ("eclipse-zenoh", "msgspec", "python")


@dataclass(frozen=True)
class Network:
    """What was heard in a few seconds.  problem: why it could not be opened; None when it could.

    about: what each service says that it is, or why that cannot be read.  offset: of this machine's clock.
    """

    problem: str | None = None
    alive: frozenset[Name] = frozenset()
    about: Mapping[Name, About | str] = field(default_factory=dict)
    health: Mapping[Name, Health] = field(default_factory=dict)
    offset: Offset | None = None


def title(name: Name) -> str:
    service, id = name
    return service if id == "main" else f"{service} {id}"


def check_open(network: Network, secured: bool) -> Finding:
    if network.problem is None:
        return ok("network", "open")
    hint = "; is this machine's certificate of the rig's authority?" if secured else ""
    return wrong("network", network.problem, f"start the router or the others, and compare the endpoints{hint}")


def check_presence(expected: Sequence[Name], network: Network, rig: str) -> list[Finding]:
    """Who is expected and not there.  A rig that is not running at all is no fault."""
    if not network.alive & set(expected):
        return [ok("services", "none is running, or none can be reached from here")]
    found = [ok(title(name), "is running") for name in expected if name in network.alive]
    for service, id in (name for name in expected if name not in network.alive):
        command = f"zenocap {service} {rig}" + (f" --id {id}" if service == "viewer" else "")
        found.append(warning(title((service, id)), "is not on the network", f"start it on its machine: {command}"))
    return found


def check_rigs(digest: str, network: Network) -> list[Finding]:
    """Whose rig file or calibration is another one than here."""
    told = {name: about for name, about in network.about.items() if isinstance(about, About)}
    others = {name: about for name, about in told.items() if about.digest != digest}
    silent = sorted(network.alive - network.about.keys() - {(s, i) for s, i in network.alive if s in ("recorder",)})
    found = [
        wrong(
            "rig file",
            f"{title(name)} on {about.host} runs with another rig file or calibration ({about.digest}) than this "
            f"machine has ({digest})",
            "copy rig file and calibration from one machine to all others, and start it again",
        )
        for name, about in sorted(others.items())
    ]
    if told and not others:
        found.append(ok("rig file", f"the same on all {len(told)} that run, and here"))
    for name, text in sorted(network.about.items()):
        if isinstance(text, str):
            found.append(
                warning("versions", f"{title(name)}: its answer cannot be read: {text}", "update it to this version")
            )
    if silent:
        names = ", ".join(map(title, silent))
        found.append(
            warning(
                "versions", f"{names}: does not say what it is", "an older zenocap, or a busy machine: update, ask again"
            )
        )
    return found


def check_versions(here: Mapping[str, str], network: Network) -> list[Finding]:
    """here: this machine's, by package."""
    found: list[Finding] = []
    told = {name: about for name, about in network.about.items() if isinstance(about, About)}
    for package in (*MUST_AGREE, *SHOULD_AGREE):
        mine = _release(package, here.get(package, "unknown"))
        others: dict[str, list[str]] = {}
        for name, about in sorted(told.items()):
            theirs = _release(package, about.versions.get(package, "unknown"))
            if theirs != mine:
                others.setdefault(theirs, []).append(f"{title(name)} on {about.host}")
        judge = wrong if package in MUST_AGREE else warning
        for theirs, whose in others.items():
            words = f"{package} {theirs} at {', '.join(whose)}, {mine} here"
            found.append(judge("versions", words, f"install the same {package} on every machine"))
    if told and not found:
        found.append(ok("versions", f"zenocap {here.get('zenocap', 'unknown')} and what matters with it agree"))
    return found


def check_clocks(network: Network, frame_ns: int) -> list[Finding]:
    """frame_ns: from frame to frame; a clock may be off by a quarter of it."""
    found: list[Finding] = []
    remedy = "let NTP (chrony, systemd-timesyncd) set the clocks of all machines from one source"
    known = 0
    for name, health in sorted(network.health.items()):
        offset = offset_in(health)
        if offset is None:
            continue
        known += 1
        text = clock_warning(name[1], offset, frame_ns)
        if text is not None:
            found.append(warning("clocks", text.replace(f"viewer {name[1]}", title(name), 1), remedy))
    if network.offset is not None:
        known += 1
        text = clock_warning("", network.offset, frame_ns)
        if text is not None:
            found.append(warning("clocks", text.replace("viewer ", "this machine", 1), remedy))
    if known and not found:
        found.append(ok("clocks", f"{known} within a quarter frame ({frame_ns / 4e6:.0f} ms) of the integrator's"))
    return found


def check_messages(network: Network) -> list[Finding]:
    """Who gets what is no valid message, or loses some."""
    found = []
    for name, health in sorted(network.health.items()):
        refused = sum(count for key, count in health.counts.items() if key.startswith("rejected_"))
        if refused:
            words = f"{title(name)} has refused {refused} messages that were not valid"
            found.append(warning("messages", words, "its log names their keys: another version, or somebody who does harm"))
        if health.counts.get("step_errors", 0):
            words = f"{title(name)}: {health.counts['step_errors']} steps have failed"
            found.append(warning("messages", words, "its log says why: please report it"))
    if network.health and not found:
        found.append(ok("messages", f"all valid, at {len(network.health)} services"))
    return found


def expected_services(viewers: Collection[str], tracker: bool, recognizer: bool) -> list[Name]:
    """Whom a rig needs: its viewers' ids, and what its tables ask for."""
    optional = (("tracker", tracker), ("recognizer", recognizer))
    beside = [(name, "main") for name, wanted in optional if wanted]
    return [*(("viewer", id) for id in viewers), ("integrator", "main"), *beside]


def _release(package: str, version: str) -> str:
    """Of Python only 3.11, say: patches do not matter."""
    return ".".join(version.split(".")[:2]) if package == "python" else version
