"""The closing statement holds for every schedule of faults: no message is lost without a word.

Other schedules in each run, 10,000 a test:
`pytest -m "" --hypothesis-profile search --unit-limit 0 -o timeout=0 tests/tools/record/launcher/test_statement.py`.
"""

import logging
import os
import shutil
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from msgspec import structs

from tests.common.bus.test_inbox import bap, sighting
from tests.support.built_messages import built
from zenocap.common.bus import inbox
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Alive, Counters, Envelope
from zenocap.common.messages import ENDED, Health, Message, Phase
from zenocap.common.observe import account, several_logs
from zenocap.common.observe.account import Account, Line
from zenocap.common.observe.view import RigView, observed
from zenocap.common.recording.log import Log
from zenocap.common.recording.parts import PartLimits, Parts, free_name
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import SETUP_FILE, recorded_rig, write_setup
from zenocap.common.recording.take_account import Place, sender_of
from zenocap.common.recording.writer import LOG, OPENED, Attachment, Recording
from zenocap.common.rig.rig import demo_rig
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.clock_offset import Offset
from zenocap.common.runtime.health import Meter
from zenocap.common.topics import HEALTH, SIGHTING, SILHOUETTE, TOPICS, service_at, topic_of
from zenocap.tools.record.launcher.frame_statement import FrameStatement, frames_of
from zenocap.tools.record.launcher.run_takes import Unresumed, new_takes
from zenocap.tools.record.launcher.statement import Statement, statement

SECOND = 1_000_000_000
START_NS = 1_700_000_000 * SECOND
INTEGRATOR, VIEWER = ("integrator", "main"), ("viewer", "1")
SERVICES = (VIEWER, INTEGRATOR)
QUEUED = 24  # messages in the queue of a log
SETUP = Attachment(SETUP_FILE, "application/json", write_setup(recorded_rig(demo_rig("two-view"))))
PART_BYTES = 6000
FATES = ("dropped_frames", "skipped_frames", "failed_frames", "learning_frames")
MOST = 20  # services besides those of the rig, and processes
HOUR = 3600 * SECOND
STEPS = (-HOUR, HOUR, -5 * SECOND, 5 * SECOND, -2 * SECOND, 2 * SECOND)  # of a clock


@dataclass
class Process:
    """One process of a service on the network of the test.

    clock_ns, known_ns: its machine's clock ahead of the integrator's, and what it knows of that: from its last health on.
    """

    key: ServiceKey
    bus: LocalBus
    meter: Meter
    clock_ns: int = 0
    known_ns: int = 0


@dataclass
class World:
    """A rig of two services, of which the integrator has the log, and all that can go wrong.

    on_request: whether only the user begins a log, as in a run without one.
    sent: time of each message on a key that counts, by place, key and bytes.
    """

    folder: Path
    on_request: bool = False
    clock: ManualClock = field(default_factory=lambda: ManualClock(START_NS))
    processes: dict[ServiceKey, Process] = field(default_factory=dict)
    log: Log | None = None
    log_bus: LocalBus | None = None
    reports: Account = field(default_factory=lambda: Account(own=SERVICES))
    unresumed: Unresumed = field(default_factory=Unresumed)
    sent: dict[tuple[Place, str, bytes], int] = field(default_factory=dict)
    number: int = 0  # of the last message
    frames: list[tuple[str, int]] = field(default_factory=list)  # of the viewer: what became of each, and when
    view: RigView = field(default_factory=lambda: RigView("studio"))
    lose: int = 0
    loses: ServiceKey | None = None  # of which service the network loses messages; None: of all
    was_set: bool = False  # whether the clock was set since the last second
    full: bool = False
    slow: bool = False  # whether logs end before they have written all that they received
    ends: list[Mapping[str, int]] = field(default_factory=list)  # final counts of logs that were closed
    created: list[Path] = field(default_factory=list)  # takes, in order
    begun: list[Path] = field(default_factory=list)  # of them the first of each log
    cut: list[Path] = field(default_factory=list)  # of them those whose integrator was killed

    def __post_init__(self) -> None:
        self.network = LocalNetwork("studio", self.clock)
        self.launcher = self.network.bus()
        self.launcher.subscribe(HEALTH, every=True)
        self.launcher.watch_alive()
        self.oracle = self.network.bus()
        for topic in TOPICS:
            self.oracle.subscribe(topic, every=True)

    def start(self, key: ServiceKey) -> None:
        if key in self.processes:
            return
        bus = self.network.bus()
        bus.declare_alive(*key)
        self.processes[key] = Process(key, bus, Meter(*key))
        self.processes[key].meter.counts.update({"captured_frames": 0} if key == VIEWER else {})
        if key == INTEGRATOR and not self.on_request:
            self.record()
        self.health(self.processes[key])

    def record(self) -> None:
        """Begin a log, where the integrator runs without one."""
        if INTEGRATOR not in self.processes or self.log is not None:
            return
        path = free_name(self.folder / "take.mcap")

        def open_part(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
            self.created.append(path)
            metadata = {LOG: {OPENED: str(len(self.created))}} | ({"part": part} if part else {})
            return Recording(path, rig="studio", start_ns=start_ns, metadata=metadata, attachments=(SETUP,))

        self.log_bus = self.network.bus()
        deliver = self.log_bus.deliver

        def lossy(key: str, data: bytes) -> None:
            if self.lose and (self.loses is None or self.loses == service_at(key)):
                self.lose -= 1
            else:
                deliver(key, data)

        self.log_bus.deliver = lossy  # type: ignore[method-assign]
        number = len(self.created)
        self.parts = Parts(open_part, path, self.clock.now_ns(), PartLimits(bytes=PART_BYTES), must_open=False)
        self.log = Log(self.log_bus, self.parts, whole_rig=True, own=SERVICES)
        self.log.subscribe()
        self.begun += self.created[number : number + 1]

    def publish(self, process: Process, message: Message) -> None:
        self.clock.advance(1_000_000)
        process.bus.publish(topic_of(type(message)), message)
        self.observe()

    def health(self, process: Process, counts: Mapping[str, int] = {}, *, ended: bool = False) -> None:
        process.meter.counts.update({ENDED: 1} if ended and ENDED not in process.meter.counts else {})
        if process.key == INTEGRATOR:
            counts = {"log_on": int(self.log is not None), **counts}
        now_ns, known = self.clock.now_ns() + process.clock_ns, Offset(process.known_ns, 1)
        report = process.meter.report(now_ns, 0, Phase.RUNNING, "", process.bus.counters, known)
        process.known_ns = process.clock_ns
        self.publish(process, structs.replace(report, counts={**report.counts, **counts}))

    def send(self, key: ServiceKey, count: int) -> None:
        process = self.processes.get(key)
        for _ in range(count if process else 0):
            self.number += 1
            self.publish(process, sighting("1", self.number) if key == VIEWER else bap(self.number))
            if key == VIEWER:
                self._frame(process, "sent")

    def leave_out(self, fate: str, count: int) -> None:
        """Frames of the viewer become no message."""
        for _ in range(count if VIEWER in self.processes else 0):
            self.clock.advance(1_000_000)
            self._frame(self.processes[VIEWER], fate)

    def _frame(self, process: Process, fate: str) -> None:
        self.frames.append((fate, self.clock.now_ns()))
        names = ("frames", *FATES[3:]) if fate == FATES[3] else ("frames",) if fate == "sent" else (fate,)
        process.meter.counts.update(["captured_frames", *names])

    def strangers(self, count: int) -> None:
        """Another program sends healths of invented services."""
        for number in range(count):
            key = "invented", str(number)
            self.health(Process(key, self.launcher, Meter(*key)))

    def drain(self, most: int | None = None) -> None:
        """Let the log write what it has received.  most: of it; None for all."""
        if self.log is not None and self.log_bus is not None:
            with self.disk():
                for _ in range(self.log_bus.counters.queued if most is None else most):
                    if self.parts.failure is None:
                        self.log.handle(self.log_bus.receive())

    def observe(self) -> None:
        """Let the launcher and the oracle receive."""
        while (event := self.launcher.receive()) is not None:
            if isinstance(event, Envelope | Alive):
                self.view = observed(self.view, event, 0)
                self.reports.add(event)
                if self.on_request:
                    self.unresumed.note(event, self.reports)
        while (event := self.oracle.receive()) is not None:
            if isinstance(event, Envelope) and (service := sender_of(event.topic, event.key)) in SERVICES:
                self.sent[(service, event.topic.name), event.key, event.data] = event.received_ns

    def second(self) -> None:
        """A second passes, with a health of each process and a flush of the log."""
        self.clock.advance(SECOND)
        self.was_set = False
        for process in list(self.processes.values()):
            self.health(process)
        self.drain()
        if self.log is not None:
            with self.disk():
                self.parts.flush()

    def stop(self, key: ServiceKey) -> None:
        if (process := self.processes.get(key)) is None:
            return
        self.health(process, ended=True)
        if key == INTEGRATOR:
            self.close_log()
            counts = {
                name: max((end.get(name, 0) for end in self.ends), default=0) for name in ("log_stopped", "log_removed")
            }
            self.health(process, {"log_closed": 1, **counts}, ended=True)
        self.processes.pop(key).bus.close()
        self.observe()

    def close_log(self) -> None:
        if self.log is None:
            return
        self.drain(4 if self.slow else None)
        with self.disk():
            end = self.log.close()
        self.ends.append({"log_stopped": int(end.failure is not None), "log_removed": end.removed})
        self.log = self.log_bus = None

    def kill(self, key: ServiceKey) -> None:
        """A process dies: its log keeps what is on the disk."""
        if (process := self.processes.pop(key, None)) is None:
            return
        if key == INTEGRATOR and self.log is not None:
            self.cut.append(self.created[-1])
            files = {path: path.read_bytes() for path in self.folder.glob("*.mcap")}
            self.log.close()
            for path in self.folder.glob("*.mcap"):
                path.unlink()
            for path, content in files.items():
                path.write_bytes(content)
            self.log, self.ends = None, []
        process.bus.close()
        self.observe()

    @contextmanager
    def disk(self) -> Iterator[None]:
        """Writes to the disk fail while it is full."""
        with pytest.MonkeyPatch.context() as patch:
            if self.full:
                patch.setattr(os, "fsync", no_space)
            yield

    def found(self) -> Statement:
        """The statement after the end of all processes."""
        runs = INTEGRATOR in self.processes  # else it has ended before the others were stopped
        for key in SERVICES:
            self.stop(key)
        takes, unreadable, of_commands = new_takes(self.folder, (), "studio", self.reports)
        assert unreadable == of_commands == []
        whole = not any(end["log_stopped"] or end["log_removed"] for end in self.ends)
        whole = whole and runs and bool(takes) and takes[-1].complete
        return statement(takes, self.reports, SERVICES, whole=whole, unresumed=self.unresumed.accounts)

    def absent(self) -> dict[Place, list[int]]:
        """Times at which the messages were sent that are in no take, by place."""
        recorded = set()
        for path in self.folder.glob("*.mcap") if self.folder.exists() else ():
            recorded |= {(one.topic, one.data) for one in TakeReader(path).messages()}
        found = defaultdict(list)
        for (place, key, data), sent_ns in self.sent.items():
            if (key, data) not in recorded:
                found[place].append(sent_ns)
        return found


def no_space(_: int) -> None:
    raise OSError(28, "No space left on device")


SERVICE = st.sampled_from(SERVICES)
FAULTS = st.one_of(
    st.tuples(st.just("send"), SERVICE, st.integers(1, 12)),
    st.tuples(st.just("second")),
    st.tuples(st.just("drain")),
    st.tuples(st.sampled_from(["kill", "stop", "start"]), SERVICE),
    st.tuples(st.just("lose"), st.integers(1, 6)),
    st.tuples(st.just("strangers"), st.just(MOST + 1)),
    st.tuples(st.just("leave_out"), st.sampled_from(FATES), st.integers(1, 3)),
    st.tuples(st.sampled_from(["step", "set_viewer"]), st.sampled_from(STEPS)),
    st.tuples(st.sampled_from(["full", "space", "slow", "delete", "record", "close_log"])),
)


def happens(world: World, fault: tuple) -> None:
    name, *values = fault
    match name:
        case "lose":
            world.lose += values[0]
            world.loses = values[1] if values[1:] else None
        case "step":
            if world.was_set:
                world.second()  # as docs/wire.md says: no one knows of the time between two settings
            world.clock.advance(values[0])
            world.was_set = True
        case "set_viewer":  # the only service of another machine than the integrator's and the launcher's
            if VIEWER in world.processes:
                world.processes[VIEWER].clock_ns += values[0]
        case "full" | "space":
            world.full = name == "full"
        case "slow":
            world.slow = True
        case "delete":
            shutil.rmtree(world.folder, ignore_errors=True)
        case "send" | "second" | "drain" | "kill" | "stop" | "start" | "record" | "close_log" | "strangers" | "leave_out":
            getattr(world, name)(*values)
        case _:
            raise NotImplementedError(fault)


def check(faults: list[tuple], *, on_request: bool = False) -> tuple[World, Statement]:
    logging.disable(logging.CRITICAL)
    try:
        with tempfile.TemporaryDirectory() as name, pytest.MonkeyPatch.context() as patch:
            patch.setattr(inbox, "MAX_QUEUED", QUEUED)
            for module, most in ((account, "MAX_SERVICES"), (several_logs, "MAX_SERVICES"), (account, "MAX_LIVES")):
                patch.setattr(module, most, MOST)
            world = World(Path(name) / "takes", on_request)
            for fault in [("start", INTEGRATOR), ("start", VIEWER), *faults]:
                happens(world, fault)
            found, absent = world.found(), world.absent()
            exist = {path for path in world.created if path.exists()}
    finally:
        logging.disable(logging.NOTSET)
    assert found.sent == sum(found.terms.values())
    assert min(found.terms.values()) >= 0
    named = [one.take.path for one in found.takes]
    assert sum(one.lost + one.lost_before for one in found.takes) + found.lost_outside == found.lost
    assert {*named} == exist
    if ("delete",) not in faults:
        assert named == world.created
    for place, count in Counter(place for place, _, _ in world.sent).items():
        line = found.lines.get(place, Line(0, 0, 0, 0, found.unknown.get(place[0], ())))
        times = absent.get(place, [])
        counted = line.missing + line.unlogged + found.refused.get(place, 0)
        uncounted = sum(any(begin <= time <= end for begin, end in line.unknown) for time in times)
        assert len(times) - uncounted <= counted <= len(times), (place, line, len(times), uncounted)
        if not line.unknown:
            assert line.sent == count
    frames = frames_of(world.view, world.reports, SERVICES, SIGHTING)
    assert frames.captured == sum(frames.fates.values())
    assert frames.fates["processed"] == sum(frames.uses.values())
    lost = [frames.fates[name] for name in ("dropped", "skipped under overload", "failed")]
    spans = [span for its in frames.unknown.values() for span in its]
    for fate, count in zip((*FATES, "sent"), (*lost, frames.uses["for the background"], frames.uses["sent"]), strict=True):
        times = [at_ns for one, at_ns in world.frames if one == fate]
        uncounted = sum(any(begin <= time <= end for begin, end in spans) for time in times)
        assert len(times) - uncounted <= count <= len(times), (fate, frames)
    return world, found


AGAIN = [("kill", VIEWER), ("start", VIEWER), ("send", VIEWER, 1)]


@settings(suppress_health_check=[HealthCheck.too_slow])
@example([("kill", INTEGRATOR), ("start", INTEGRATOR), ("second",), ("send", VIEWER, 4), ("kill", INTEGRATOR)], False)
@example([("record",), ("close_log",), ("record",)], True)
@example([("step", -HOUR), ("full",), ("close_log",), ("record",), ("send", VIEWER, 1), ("second",)], False)
@example([("record",), ("send", VIEWER, 4), ("close_log",), ("record",), ("second",)], True)
@example([("send", VIEWER, 9), ("second",), ("record",), ("send", VIEWER, 4), ("close_log",), ("kill", VIEWER)], True)
@example([("second",), ("lose", 6), ("send", VIEWER, 4), ("second",), ("send", VIEWER, 4), ("kill", VIEWER)], False)
@example([("kill", INTEGRATOR), ("lose", 1), ("start", INTEGRATOR), ("lose", 1), *AGAIN], False)
@example([("send", VIEWER, 1), ("stop", INTEGRATOR), *AGAIN, ("start", INTEGRATOR), ("step", -HOUR)], False)
@example([("step", -HOUR), ("lose", 3), ("send", VIEWER, 1), ("second",), *AGAIN[2:], ("kill", VIEWER)], False)
@example([("second",), ("leave_out", "dropped_frames", 2), ("kill", VIEWER)], False)
@example([("slow",), ("send", VIEWER, 9), ("close_log",), ("send", VIEWER, 3), ("record",), ("second",)], False)
@example([("second",), ("close_log",), ("record",), ("slow",), ("send", VIEWER, 9), ("stop", INTEGRATOR)], False)
@given(st.lists(FAULTS, max_size=25), st.booleans())
def test_every_message_is_in_a_take_or_in_a_term_or_in_a_span(faults: list[tuple], on_request: bool) -> None:
    check(faults, on_request=on_request)


RESTARTS = st.one_of(
    st.tuples(st.just("send"), SERVICE, st.integers(1, 3)),
    st.tuples(st.just("lose"), st.integers(1, 3), st.just(VIEWER)),
    st.tuples(st.sampled_from(["second", "drain"])),
    st.tuples(st.sampled_from(["kill", "stop", "start"]), SERVICE),
)


@settings(suppress_health_check=[HealthCheck.too_slow])
@example([("stop", INTEGRATOR), ("second",), ("kill", VIEWER), ("start", INTEGRATOR)])
@example([("lose", 2, VIEWER)])
@example([("second",), ("lose", 9, VIEWER), *AGAIN, ("stop", VIEWER), *AGAIN, ("second",)])
@given(st.lists(RESTARTS, max_size=25))
def test_where_no_user_stops_the_recording_what_is_in_no_take_is_lost(faults: list[tuple]) -> None:
    """A service manager that stopped the integrator was no loss: its messages were "sent while no take was written".

    Each time between two integrators is named, and each take that was cut by a kill.
    """
    world, found = check(faults)
    assert {place: line.unlogged for place, line in found.lines.items() if place[0] == VIEWER and line.unlogged} == {}
    assert [one.take.path for one in found.takes if one.gap is not None] == world.begun[1:]
    assert all(START_NS <= one.gap[0] <= one.gap[1] <= world.clock.now_ns() for one in found.takes if one.gap is not None)
    named = list(found.take_text())
    cut = [line for line in named if line.endswith("; cut: its integrator did not close it")]
    assert [line.split(": ")[1] for line in cut] == [str(path) for path in world.cut]
    assert sum(line.startswith("take: none from ") for line in named) == len(world.begun[1:])


def test_an_integrator_that_something_else_stops_leaves_a_gap() -> None:
    stopped = [("second",), ("send", VIEWER, 4), ("second",), ("stop", INTEGRATOR), ("send", VIEWER, 5), ("second",)]
    found = check([*stopped, ("start", INTEGRATOR), ("send", VIEWER, 3), ("second",), ("send", VIEWER, 2)])[1]
    first, second = found.takes
    assert found.lines[VIEWER, "sighting"] == Line(14, 9, 5, 0, ())
    assert (first.lost, second.lost, second.lost_before, found.lost_outside) == (0, 0, 6, 0)
    assert not found.complete
    assert list(found.take_text()) == [
        f"take: {first.take.path}: 11 messages, 0 lost",
        "take: none from 22:13:22.0 UTC to 22:13:23.0 UTC, between take.mcap and take-2.mcap: the integrator was started "
        "again, 6 lost",
        f"take: {second.take.path}: 10 messages, 0 lost",
        "takes: 6 lost",
    ]


def test_an_integrator_that_is_not_started_again_loses_the_rest() -> None:
    found = check([("second",), ("stop", INTEGRATOR), ("send", VIEWER, 5), ("second",)])[1]
    assert found.lines[VIEWER, "sighting"] == Line(5, 0, 5, 0, ())


def test_each_take_has_its_own_loss() -> None:
    """The first of four was named alone, with the loss of another."""
    again = [("second",), ("close_log",), ("send", VIEWER, 5), ("record",), ("second",)]
    lose = [("second",), ("send", VIEWER, 3), ("lose", 2), ("send", VIEWER, 4), ("second",)]
    found = check([*again, *again, *lose, *again])[1]
    assert [one.lost for one in found.takes] == [0, 0, 2, 0]
    assert [one.gap for one in found.takes] == [None] * 4
    assert (found.lost, found.lost_outside) == (2, 0)


def test_an_ordinary_run_loses_nothing() -> None:
    found = check([("send", VIEWER, 7), ("second",), ("send", INTEGRATOR, 5), ("send", VIEWER, 3), ("second",)])[1]
    assert (found.complete, found.lost, found.unknown) == (True, 0, {})
    assert list(found.text()) == [
        "messages: 24 sent = 23 in the takes + 0 dropped by the queue of the log + 0 never arrived at a log + "
        "0 refused by the writer + 1 sent while no take was written"
    ]  # the last health, of the end of the log


def test_a_take_of_another_run_of_the_same_rig_is_none_of_this_one(tmp_path: Path) -> None:
    """It was named as the take before a gap, and the integrator as started again."""
    worlds = World(tmp_path), World(tmp_path)
    for world in worlds:
        world.start(INTEGRATOR)
        world.second()
    for world in worlds:
        world.stop(INTEGRATOR)
    assert [[one.take.path for one in world.found().takes] for world in worlds] == [world.created for world in worlds]


def test_what_a_short_log_has_hides_nothing_that_was_sent_before_it() -> None:
    """Of a viewer that was killed after it, four of these nine were in no term."""
    short = [("send", VIEWER, 9), ("second",), ("record",), ("send", VIEWER, 4), ("close_log",), ("kill", VIEWER)]
    line = check(short, on_request=True)[1].lines[VIEWER, "sighting"]
    assert (line.seen, line.missing, line.unlogged) == (4, 0, 9)
    assert line.unknown == ((START_NS + SECOND + 13_000_000, START_NS + SECOND + 17_000_000),)


def test_what_a_slow_disk_leaves_at_the_end_of_the_log_is_lost() -> None:
    """It was "sent while no take was written", with exit status 0."""
    found = check([("send", VIEWER, 5), ("second",), ("slow",), ("send", VIEWER, 8)])[1]
    assert found.lines[VIEWER, "sighting"] == Line(13, 13, 0, 0, ())
    assert found.refused[VIEWER, "sighting"] == 5
    assert not found.complete


def test_what_is_sent_while_the_recording_is_stopped_is_not_lost() -> None:
    stopped = [("second",), ("close_log",), ("send", VIEWER, 5), ("second",), ("record",), ("second",)]
    found = check(stopped)[1]
    assert found.complete
    assert found.lines[VIEWER, "sighting"] == Line(5, 0, 0, 5, ())


def test_a_killed_log_loses_what_the_next_one_does_not_have() -> None:
    """It was 240 poses published, 213 in the takes, and "0 lost"."""
    killed = [("send", VIEWER, 5), ("second",), ("send", VIEWER, 4), ("drain",), ("kill", INTEGRATOR), ("send", VIEWER, 3)]
    found = check([*killed, ("start", INTEGRATOR), ("second",), ("send", VIEWER, 2)])[1]
    assert found.lines[VIEWER, "sighting"] == Line(14, 7, 7, 0, ())
    assert list(found.unknown) == [INTEGRATOR]
    first, second = found.takes
    assert (first.lost, second.lost, second.lost_before, found.lost_outside) == (0, 0, 7, 0)
    assert list(found.take_text()) == [
        f"take: {first.take.path}: 9 messages, 0 lost; cut: its integrator did not close it",
        "take: none from 22:13:21.0 UTC to 22:13:21.0 UTC, between take.mcap and take-2.mcap: the integrator was started "
        "again, 7 lost",
        f"take: {second.take.path}: 7 messages, 0 lost",
        "takes: 7 lost, and an unknown number in 0.0 s",
    ]
    assert any(line.startswith("not counted: what integrator sent from ") for line in found.text())
    assert not found.complete


def test_a_killed_log_that_no_other_follows_is_named_as_cut() -> None:
    found = check([("send", VIEWER, 5), ("second",), ("send", VIEWER, 4), ("kill", INTEGRATOR), ("send", VIEWER, 3)])[1]
    (only,) = found.takes
    assert (only.gap, found.complete) == (None, False)
    assert list(found.take_text()) == [
        f"take: {only.take.path}: 9 messages, 8 lost, and an unknown number in 0.0 s; cut: its integrator did not close it"
    ]


RECORDED = [("record",), ("second",), ("send", VIEWER, 4), ("second",), ("send", VIEWER, 3)]
KILLED = [*RECORDED, ("kill", INTEGRATOR), ("send", VIEWER, 2), ("start", INTEGRATOR), ("second",)]
IDLE = [("send", VIEWER, 50), ("second",), ("send", VIEWER, 60), ("second",)]


def test_what_is_sent_after_a_restart_that_was_to_record_nothing_is_not_lost() -> None:
    """Of a run without a log, whose user had begun one: all until the end of the run was lost."""
    found = check([*KILLED, *IDLE], on_request=True)[1]
    assert found.lines[VIEWER, "sighting"] == Line(119, 4, 5, 110, ())
    assert (found.lost, found.complete) == (6, False)  # and the health that counts them
    (line,) = found.take_text()
    assert ": 6 lost, and an unknown number in 0.0 s; cut: " in line.replace("messages, ", ": ")


def test_nor_is_what_is_sent_until_the_user_records_again() -> None:
    again = [("record",), ("second",), ("send", VIEWER, 2), ("second",), ("close_log",), ("send", VIEWER, 30), ("second",)]
    found = check([*KILLED, *IDLE, *again], on_request=True)[1]
    assert found.lines[VIEWER, "sighting"] == Line(151, 6, 5, 140, ())
    first, second = found.takes
    assert (first.lost, second.lost, second.lost_before, found.lost_outside) == (0, 0, 6, 0)  # and the health
    assert second.gap is not None
    assert second.gap[1] - second.gap[0] < 2 * SECOND


@pytest.mark.parametrize("fault", ["full", "delete"])
def test_a_disk_that_is_full_and_a_deleted_folder_lose_what_is_said(fault: str) -> None:
    found = check([("send", VIEWER, 5), ("second",), ("send", VIEWER, 4), (fault,), ("second",), ("send", VIEWER, 3)])[1]
    assert found.lost >= 4
    assert not found.unknown


def test_what_the_queue_drops_and_what_never_arrives_are_terms() -> None:
    found = check([("second",), ("lose", 3), *[("send", VIEWER, 12)] * 3, ("second",)])[1]
    assert found.terms["never arrived at a log"] == 3
    assert found.terms["dropped by the queue of the log"] == 33 + 2 - QUEUED


def frames_after(
    processes: Mapping[int, list[int]], *, lost: int = 0, unsent: int = 0, unsendable: int = 0, killed: bool = False
) -> FrameStatement:
    """The frames of one viewer.  processes: by number, processed frames at each health.

    lost: frames of each process that are in no count.  unsent: processed ones of which no message was sent.
    unsendable: messages that could not be sent.
    killed: whether no health is the last of its process.
    """
    view, reports = RigView("studio"), Account()
    for process, reports_of in processes.items():
        for frames in reports_of:
            meter = Meter(*VIEWER, process=process)
            meter.counts.update(frames=frames, failed_frames=1, dropped_frames=2, skipped_frames=3, learning_frames=4)
            meter.counts.update(captured_frames=frames + 6 + lost, unsendable=unsendable)
            meter.counts.update({} if killed or frames != reports_of[-1] else {ENDED: 1})
            bus = Counters(0, {}, {}, sent={"silhouette": frames - 4 - unsent})
            health = meter.report(0, 0, Phase.RUNNING, "", bus, None)
            event = Envelope(HEALTH.at("studio", service="viewer", id="1"), HEALTH, health, 0)
            view = observed(view, event, 0)
            reports.add(event)
    return frames_of(view, reports, [VIEWER], SILHOUETTE)


def test_frames_are_processed_dropped_or_left_out() -> None:
    found = frames_after({1: [10, 20], 2: [5]})
    assert found.complete
    assert list(found.text()) == [
        "frames: 37 captured = 25 processed + 2 failed + 4 dropped + 6 skipped under overload; "
        "25 processed = 17 sent + 8 for the background + 0 not sendable"
    ]  # the viewer was started again
    assert list(frames_of(RigView("studio"), Account(), [VIEWER], SILHOUETTE).text()) == []


def test_what_a_killed_viewer_captured_last_is_unknown() -> None:
    """They were in no term, without a word."""
    found = frames_after({1: [10, 20], 2: [5]}, killed=True)
    assert not found.complete
    counted, *unknown = found.text()
    assert counted.startswith("frames: 37 captured = ")
    line = "not counted: what viewer 1 captured from 00:00:00.0 UTC to 00:00:00.0 UTC, after its last report"
    assert unknown == [line, line]  # until the next process, and until the end


def test_the_frames_of_a_viewer_of_an_earlier_release_are_unknown() -> None:
    """They made -4 or so not accounted for."""
    view = RigView("studio")
    for id, counts in (("1", {"frames": 40, "skipped_frames": 3}), ("2", {"frames": 8, "captured_frames": 8})):
        health = built(Health, id=id, counts=counts | {"sent.silhouette": counts["frames"]})
        view = observed(view, Envelope(HEALTH.at("studio", service="viewer", id=id), HEALTH, health, 0), 0)
    found = frames_of(view, Account(), [VIEWER, ("viewer", "2")], SILHOUETTE)
    assert not found.complete
    counted, unknown = found.text()
    assert counted.startswith("frames: 8 captured = 8 processed + 0 failed + 0 dropped + 0 skipped under overload; ")
    assert unknown == "frames of viewer 1: 40 processed of an unknown number: its release does not count them"


def test_frames_that_are_in_no_count_are_a_term() -> None:
    """The number of captured frames was the sum of the others."""
    found = frames_after({1: [10]}, lost=2)
    assert not found.complete
    assert list(found.text()) == [
        "frames: 18 captured = 10 processed + 1 failed + 2 dropped + 3 skipped under overload + 2 not accounted for; "
        "10 processed = 6 sent + 4 for the background + 0 not sendable"
    ]


@pytest.mark.parametrize(
    ("unsent", "unsendable", "uses"),
    [
        (0, 0, "6 sent + 4 for the background + 0 not sendable"),
        (1, 0, "5 sent + 4 for the background + 0 not sendable + 1 not accounted for"),
        (2, 1, "4 sent + 4 for the background + 1 not sendable + 1 not accounted for"),
        (1, 1, "5 sent + 4 for the background + 1 not sendable"),
        (1, 3, "5 sent + 4 for the background + 1 not sendable"),
        (-1, 0, "7 sent + 4 for the background + 0 not sendable + -1 not accounted for"),
    ],
)
def test_processed_frames_without_a_use_are_a_term(unsent: int, unsendable: int, uses: str) -> None:
    """They were no reason for status 3; unsendable: messages of any topic."""
    found = frames_after({1: [10]}, unsent=unsent, unsendable=unsendable)
    assert found.complete == ("accounted" not in uses)
    (text,) = found.text()
    assert text.endswith(f"; 10 processed = {uses}")
