"""`zenocap record`: what is said on a rig, or under a key expression, written from any machine on the network."""

import logging
import re
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Never

from common.body.anatomy import TEN_PARTS
from common.bus.protocol import Bus
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.formats.foxglove.converter import Foxglove
from common.runtime.clock import Clock, RealClock
from common.runtime.rig import Rig, RigError, load_rig
from common.runtime.service import Event, Service, run
from common.runtime.versions import versions
from common.take.log import Log
from common.take.naming import take_path
from common.take.opening import attachments
from common.take.parts import PartLimits, Parts
from common.take.recording import Attachment, Recording, nothing_beside
from common.topics import EVERYTHING, NAME, TOPICS, Topic, rig_of

logger = logging.getLogger(__name__)

NAME_OF_SEVERAL = "rigs"  # of a take whose expression leaves the rig open
SHOW_NS = 1_000_000_000
FAILED, LOSS = 1, 3


@dataclass(frozen=True)
class Wanted:
    """What to record.  expression: of the keys.  rig: the one they belong to, if it is one.  file: its file, if known."""

    expression: str
    rig: str | None
    file: Rig | None = None

    @property
    def name(self) -> str:
        """What the take is named by."""
        return self.rig or NAME_OF_SEVERAL


@dataclass(frozen=True)
class Progress:
    """Of a recording that runs.  bytes: of messages, before packing.  free_bytes: of the disk; None when not known."""

    messages: int
    bytes: int
    lost: int
    parts: int
    free_bytes: int | None


def wanted(text: str) -> Wanted:
    """A rig file or folder, a rig's name, or a Zenoh key expression.  Raises RigError."""
    path = Path(text)
    if path.exists() or path.suffix == ".toml":
        rig = load_rig(path, files=False)
        return Wanted(EVERYTHING.format(rig=rig.name), rig.name, rig)
    if re.fullmatch(NAME, text):
        return Wanted(EVERYTHING.format(rig=text), text)
    if "/" in text or "*" in text:
        return Wanted(text, rig_of(text))
    raise RigError(f"{text!r}: neither a rig file, nor a rig's name, nor a key expression such as zenocap/studio/**")


def topics_named(names: Sequence[str]) -> tuple[Topic, ...]:
    """The topics of these names, all for none.  Raises RigError."""
    known = {topic.name: topic for topic in TOPICS}
    for name in names:
        if name not in known:
            raise RigError(f"--topics {name}: allowed: {', '.join(known)}")
    return tuple(known[name] for name in dict.fromkeys(names)) if names else TOPICS


def own_id() -> str:
    """This machine's name, as a name on the network may be."""
    return re.sub(r"[^A-Za-z0-9_.\-]", "-", socket.gethostname())[:64] or "recorder"


def run_recorder(
    what: Wanted,
    options: ZenohOptions,
    take: Path,
    id: str,
    topics: tuple[Topic, ...],
    limits: PartLimits,
    stopped: Callable[[], bool],
    show: Callable[[Progress], None],
) -> int:
    """Record until `stopped` or the disk ends it; show: called once a second.  Returns the exit status.

    As a service named "recorder" it says its health to the rig, where it is one.  Raises BusError and RecordingError.
    """
    clock = RealClock()
    with ZenohBus.open(options, what.name, clock, stopped) as bus:
        listener = bus.listener(what.expression)
        parts = _parts(what, take, clock.now_ns(), id, limits)
        log = Log(listener, parts, topics)
        log.start()
        try:
            status = _wait(what, bus, clock, id, log, _Watch(log, parts, clock, stopped, show).ended)
        finally:
            end = log.close()
    if status:
        return status
    if not end.messages:
        logger.error("nothing was heard under %s: is the rig running, and is this its network?", what.expression)
        return FAILED
    return LOSS if end.lost or end.failure else 0


class _Watch:
    """Whether to go on; says how it goes."""

    def __init__(
        self, log: Log, parts: Parts, clock: Clock, stopped: Callable[[], bool], show: Callable[[Progress], None]
    ) -> None:
        self._log, self._parts, self._clock = log, parts, clock
        self._stopped, self._show = stopped, show
        self._show_ns = clock.elapsed_ns()

    def ended(self) -> bool:
        now = self._log.statistics
        if self._clock.elapsed_ns() >= self._show_ns:
            self._show_ns += SHOW_NS
            self._show(Progress(now.messages, now.bytes, now.lost, self._parts.number, self._log.free_bytes))
        return self._stopped() or now.failure is not None


def _wait(what: Wanted, bus: Bus, clock: Clock, id: str, log: Log, ended: Callable[[], bool]) -> int:
    if what.rig is not None:
        service: Service[None, None, Never] = Service(
            "recorder", id, None, None, _no_step, describe=lambda _: f"recording {what.expression}"
        )
        return run(service, bus, clock, stopped=ended, extra_counts=log.counts)
    while not ended():
        bus.receive(0.1)
    return 0


def _no_step(_: None, state: None, event: Event[Never]) -> tuple[None, list[Never]]:
    return state, []


def _parts(what: Wanted, path: Path, start_ns: int, id: str, limits: PartLimits) -> Parts:
    files: tuple[Attachment, ...] = attachments(what.file) if what.file else ()
    rig = {"method": what.file.method, "digest": what.file.digest} if what.file else {}
    metadata = {
        "versions": versions(),
        "rig": {"name": what.name} | rig,
        "recorder": {"id": id, "expression": what.expression},
    }

    def open_part(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
        with_part = metadata | ({"part": part} if part else {})
        beside = Foxglove(TEN_PARTS, what.rig).beside if what.rig else nothing_beside
        return Recording(path, rig=what.name, start_ns=start_ns, metadata=with_part, attachments=files, beside=beside)

    def by_time(now_ns: int) -> Path:
        return take_path(what.name, path.parent, now_ns)

    return Parts(open_part, path, start_ns, limits, by_time if path.name.startswith(f"{what.name}-") else None)
