"""`zenocap record`: record the messages of a rig or key expression from any machine on its network."""

import logging
import re
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Never

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Bus
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.recording.log import Log
from zenocap.common.recording.opening import attachments
from zenocap.common.recording.parts import PartLimits, Parts, take_path
from zenocap.common.recording.writer import Attachment, Recording, no_conversion
from zenocap.common.rig.rig import Rig, load_rig
from zenocap.common.rig.services import services_of
from zenocap.common.runtime.clock import Clock, RealClock
from zenocap.common.runtime.service import Event, Service, run
from zenocap.common.runtime.service_info import versions
from zenocap.common.topics import EVERYTHING, NAME, TOPICS, Topic, rig_of
from zenocap.tools.parameters import service_parameters

logger = logging.getLogger(__name__)

NAME_OF_SEVERAL = "rigs"  # name of a take whose expression does not fix the rig
SHOW_NS = 1_000_000_000
FAILED, LOSS = 1, 3


@dataclass(frozen=True)
class RecordingSelection:
    """Selection of messages to record.

    expression: of the keys.  rig: their rig, if it is a single one.  file: loaded rig file, if any.
    """

    expression: str
    rig: str | None
    file: Rig | None = None

    @property
    def name(self) -> str:
        """Name of the take."""
        return self.rig or NAME_OF_SEVERAL


@dataclass(frozen=True)
class RecordingProgress:
    """State of a recording.  bytes: of messages, before compression.  free_bytes: of the disk; None when unknown."""

    messages: int
    bytes: int
    lost: int
    parts: int
    free_bytes: int | None


def parse_selection(text: str) -> RecordingSelection:
    """A rig file or folder, a rig's name, or a Zenoh key expression.  Raises UserError."""
    path = Path(text)
    if path.exists() or path.suffix == ".toml":
        rig = load_rig(path, files=False)
        return RecordingSelection(EVERYTHING.format(rig=rig.name), rig.name, rig)
    if re.fullmatch(NAME, text):
        return RecordingSelection(EVERYTHING.format(rig=text), text)
    if "/" in text or "*" in text:
        return RecordingSelection(text, rig_of(text))
    raise UserError(f"{text!r}: neither a rig file, nor a rig's name, nor a key expression such as zenocap/studio/**")


def topics_named(names: Sequence[str]) -> tuple[Topic, ...]:
    """Topics by name; all without names.  Raises UserError."""
    known = {topic.name: topic for topic in TOPICS}
    for name in names:
        if name not in known:
            raise UserError(f"--topics {name}: allowed: {', '.join(known)}")
    return tuple(known[name] for name in dict.fromkeys(names)) if names else TOPICS


def own_id() -> str:
    """This machine's name, with the characters that keys allow."""
    return re.sub(r"[^A-Za-z0-9_.\-]", "-", socket.gethostname())[:64] or "recorder"


def run_recorder(
    selection: RecordingSelection,
    options: ZenohOptions,
    take: Path,
    id: str,
    topics: tuple[Topic, ...],
    limits: PartLimits,
    stopped: Callable[[], bool],
    show: Callable[[RecordingProgress], None],
) -> int:
    """Record until `stopped` or the disk is full; return the exit status.  show: is called once a second.

    For a single rig it runs as a service "recorder" that publishes its health.  Raises BusError and RecordingError.
    """
    clock, own = RealClock(), services_of(selection.file) if selection.file else ()
    with ZenohBus.open(options, selection.name, clock, stopped, own) as bus:
        listener = bus.listener(selection.expression)
        parts = _parts(selection, take, clock.now_ns(), id, limits)
        whole_rig = selection.rig is not None and selection.expression == EVERYTHING.format(rig=selection.name)
        log = Log(listener, parts, topics, whole_rig=whole_rig and topics == TOPICS, own=own)
        show_ns = clock.elapsed_ns()

        def ended() -> bool:
            nonlocal show_ns
            now = log.statistics
            if clock.elapsed_ns() >= show_ns:
                show_ns += SHOW_NS
                show(RecordingProgress(now.messages, now.bytes, now.lost, parts.number, log.free_bytes))
            return stopped() or now.failure is not None

        log.start()
        try:
            status = _wait(selection, bus, clock, id, log, ended)
        finally:
            end = log.close()
    if status:
        return status
    if not (end.messages or end.incomplete):
        logger.error("no message received under %s: is the rig running, and is this its network?", selection.expression)
        return FAILED
    return LOSS if end.incomplete else 0


def _wait(selection: RecordingSelection, bus: Bus, clock: Clock, id: str, log: Log, ended: Callable[[], bool]) -> int:
    if selection.rig is not None:
        service: Service[None, None, Never] = Service(
            "recorder", id, None, lambda: None, _no_step, describe=lambda _: f"recording {selection.expression}"
        )
        return run(service, bus, clock, stopped=ended, extra_counts=log.counts)
    while not ended():
        bus.receive(0.1)
    return 0


def _no_step(_: None, state: None, event: Event[Never]) -> tuple[None, list[Never]]:
    return state, []


def _parts(selection: RecordingSelection, path: Path, start_ns: int, id: str, limits: PartLimits) -> Parts:
    file = selection.file
    files: tuple[Attachment, ...] = attachments(file, service_parameters(file)) if file else ()
    rig = {"method": file.method, "digest": file.digest} if file else {}
    metadata = {
        "versions": versions(),
        "rig": {"name": selection.name} | rig,
        "recorder": {"id": id, "expression": selection.expression},
    }
    own = services_of(file) if file else ()

    def open_part(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
        with_part = metadata | ({"part": part} if part else {})
        convert = FoxgloveConverter(TEN_PARTS, selection.rig).convert if selection.rig else no_conversion
        return Recording(
            path, rig=selection.name, start_ns=start_ns, metadata=with_part, attachments=files, own=own, convert=convert
        )

    def by_time(now_ns: int) -> Path:
        return take_path(selection.name, path.parent, now_ns)

    return Parts(open_part, path, start_ns, limits, by_time if path.name.startswith(f"{selection.name}-") else None)
