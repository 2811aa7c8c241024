"""Messages that were sent, that arrived at a log, and that did not."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from msgspec import structs

from tests.common.bus.test_inbox import bap
from tests.common.bus.test_local import bdp
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Alive, Counters, Envelope
from zenocap.common.messages import ENDED, PROCESS, Phase
from zenocap.common.observe.account import MAX_LIVES, MAX_SERVICES, METADATA, Account, Line, read_account
from zenocap.common.observe.several_logs import OneLog, completed, ended, joined
from zenocap.common.recording.log import Log
from zenocap.common.recording.parts import PartLimits, Parts
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.take_account import take_account
from zenocap.common.recording.writer import Recording
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.health import Meter
from zenocap.common.topics import HEALTH, PARTIAL_BDP, TOPICS, UNIVERSAL_BAP, Topic
from zenocap.services.integrator.log_control import LogControl

SECOND = 1_000_000_000
INTEGRATOR = ("integrator", "main")
BEGINS, ENDS = Alive(*INTEGRATOR, True, 0), Alive(*INTEGRATOR, False, 0)


def pose(second: float = 0) -> Envelope:
    return Envelope("zenocap/studio/integrator/bap", UNIVERSAL_BAP, bap(0), int(second * SECOND))


def health(
    second: float, poses: int | None, process: int = 1, late_ns: int = 0, *, ended: bool = False, **others: int
) -> Envelope:
    """Health of a process that has sent these numbers of poses and others; None: of one of an earlier version."""
    meter = Meter(*INTEGRATOR, process=process)
    meter.counts.update({ENDED: 1} if ended else {})
    sent, at_ns = others if poses is None else others | {"universal_bap": poses}, int(second * SECOND)
    now = meter.report(at_ns, at_ns, Phase.RUNNING, "", Counters(0, {}, {}, sent=sent), None)
    if poses is None:
        now = structs.replace(now, counts={name: count for name, count in now.counts.items() if name != PROCESS})
    return Envelope("zenocap/studio/integrator/main/health", HEALTH, now, at_ns + late_ns)


def account(*events: Envelope | Alive) -> Account:
    found = Account()
    for event in events:
        found.add(event)
    return found


def poses(found: Account) -> Line | None:
    """The line of the poses, which must agree with the sum of all."""
    lines = found.lines()
    assert found.missing == sum(line.missing for line in lines.values())
    for line in lines.values():
        assert line.sent == line.seen + line.missing + line.unlogged
        assert min(line.seen, line.missing, line.unlogged) >= 0
    return lines.get((INTEGRATOR, "universal_bap"))


STARTED = (BEGINS, health(1, 100), health(2, 103))
AGAIN = (health(8, 50, process=2), health(9, 51, process=2))
CUT = [health(60 + k, 10 + k, process) for k in (0, 1) for process in (1, 2)]  # both sides of a network, until one ends
REPLAYED = [health(second, sent, late_ns=60 * SECOND) for second, sent in ((1, 100), (2, 103))]


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        pytest.param((BEGINS, pose(), health(1, 100), pose(), pose(), health(2, 102), health(3, 102)), 0, id="all arrive"),
        pytest.param((BEGINS, health(1, 100), pose(), health(2, 102)), 1, id="one does not arrive"),
        pytest.param((BEGINS, health(1, 100), pose(), health(2, 102), health(3, 104)), 3, id="three do not arrive"),
        pytest.param((BEGINS, REPLAYED[0], pose(), REPLAYED[1]), 0, id="healths of a replay do not say what was sent"),
        pytest.param(STARTED, 3, id="one process"),
        pytest.param((*STARTED, ENDS, BEGINS, *AGAIN), 4, id="a process that starts again has lost nothing"),
        pytest.param((*STARTED, *AGAIN), 4, id="killed, and its token still there"),
        pytest.param((BEGINS, *CUT[:2], pose(), *CUT[2:]), 0, id="two processes of one name lose nothing"),
    ],
)
def test_a_message_that_was_sent_and_does_not_arrive_is_missing(events: Sequence[Envelope | Alive], expected: int) -> None:
    found = account(*events)
    line = poses(found)
    assert (0 if line is None else line.missing) == found.missing == expected


def test_a_health_without_the_count_is_of_an_earlier_version() -> None:
    found = account(BEGINS, health(1, None), pose(), health(2, None))
    assert (found.missing, found.lines()) == (0, {})


def test_each_topic_is_counted_by_itself() -> None:
    """A health that does not arrive hides no pose, and is hidden by none."""
    lines = account(health(1, 0, health=1), pose(), health(3, 1, health=3)).lines()
    assert lines[INTEGRATOR, "health"].missing == 1
    assert lines[INTEGRATOR, "universal_bap"].missing == 0


def test_invented_services_and_processes_take_no_place_of_the_rigs_own() -> None:
    """256 of them before the rig's own: nothing was said of these, and nothing was missing."""
    found = Account(own=[INTEGRATOR])
    for number in range(2 * MAX_LIVES):
        id = str(number % 1000)
        now = Meter("invented", id, process=number).report(SECOND, 0, Phase.RUNNING, "", Counters(0, {}, {}), None)
        found.add(Envelope(HEALTH.at("studio", service="invented", id=id), HEALTH, now, SECOND))
    for event in STARTED:
        found.add(event)
    assert poses(found) == Line(103, 0, 3, 100, ((2 * SECOND, 2 * SECOND),))
    assert len(found.senders) == MAX_SERVICES + 2
    assert sum(len(sender.lives) for sender in found.senders.values()) <= MAX_LIVES + 1
    assert INTEGRATOR in ended(joined(found, Account(own=[INTEGRATOR]), continued=True)).senders


KILLED = (health(1, 0), pose(1), health(2, 2), Alive(*INTEGRATOR, False, 3 * SECOND))
SET_BACK = (health(100, 0), pose(100.5), pose(20), health(23, 0, process=2, ended=True))
SET_TWICE = (health(4000, 0), pose(4000), health(400, 2), pose(400), health(8000, 3, ended=True))


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        pytest.param(
            (BEGINS, pose(5), health(5, 5000), health(6, 5001)), Line(5001, 1, 1, 4999, ((6 * SECOND, 6 * SECOND),)),
            id="what was sent before the first health was sent without a log",
        ),
        pytest.param(
            (health(1, 0), pose(1), health(2, 2, ended=True), health(8, 5, process=2), health(9, 5, process=2, ended=True)),
            Line(7, 1, 6, 0, ()), id="a process that ended by itself leaves nothing unknown",
        ),
        pytest.param(
            KILLED, Line(2, 1, 1, 0, ((2 * SECOND, 3 * SECOND),)), id="what a killed process sent last is unknown"
        ),
        pytest.param(
            (*KILLED, health(8, 5, process=2), pose(8), health(9, 6, process=2, ended=True)),
            Line(3, 2, 1, 0, ((2 * SECOND, 8 * SECOND),)), id="and until the next process",
        ),
        pytest.param(
            SET_BACK, Line(2, 2, 0, 0, ((100 * SECOND, 1016 * SECOND // 10), (189 * SECOND // 10, 23 * SECOND))),
            id="an unknown time is divided where the clock was set back, within a second",
        ),
        pytest.param(SET_TWICE, Line(3, 2, 1, 0, ()), id="a clock that is set ends no process"),
    ],
)  # fmt: skip
def test_what_is_known_of_a_process(events: Sequence[Envelope | Alive], expected: Line) -> None:
    assert poses(account(*events)) == expected


def test_the_account_is_kept_in_the_metadata_of_a_take() -> None:
    found = account(health(100, 7), pose(100), pose(20), health(23, 5, process=2), pose(24), health(25, 9, process=2))
    found.dropped = 3
    again = read_account(found.metadata())
    assert again is not None
    assert again.lines() == found.lines()
    assert (again.missing, again.end_ns, again.dropped) == (found.missing, found.end_ns, 3)
    assert read_account({}) is None
    assert read_account(found.metadata() | {"viewer 1": "7"}) is None
    beyond = "9" * 20  # a time that no clock shows ended `up` with a traceback
    damaged = found.metadata()[" ".join(INTEGRATOR)].replace('"at_ns":', f'"at_ns":{beyond}')
    for name, text in {" ".join(INTEGRATOR): damaged, "end_ns": beyond, "steps": f"[[0,{beyond}]]"}.items():
        assert text != found.metadata()[name]
        assert read_account(found.metadata() | {name: text}) is None


@pytest.mark.parametrize("cut", range(1, 8))
def test_two_logs_have_what_one_has(cut: int) -> None:
    """The second log goes on where the first ends."""
    healths = health(1, 1), health(2, 4), health(3, 5), health(4, 8, ended=True)
    events = [event for one in healths for event in (pose(one.received_ns / SECOND - 0.5), one)]
    parts = joined(account(*events[:cut]), account(*events[cut:]), continued=True)
    assert poses(parts) == poses(account(*events))


def test_what_is_sent_between_two_logs_is_unlogged_or_missing() -> None:
    logs = account(health(1, 5), pose(1), health(2, 6), pose(2)), account(pose(9), health(9, 20), health(10, 21))
    stopped, continued = (poses(joined(*logs, continued=value)) for value in (False, True))
    assert stopped == Line(21, 3, 1, 17, ((10 * SECOND, 10 * SECOND),))
    assert continued == Line(21, 3, 13, 5, ((10 * SECOND, 10 * SECOND),))


def test_healths_beside_the_logs_say_what_was_sent_after_them() -> None:
    log = account(health(1, 0), pose(1), health(2, 1), pose(2.5))
    logs, reports = [OneLog(SECOND, log, log)], account(health(1, 0), health(2, 1), health(3, 4, ended=True))
    assert poses(completed(logs, reports, continued=False)) == Line(4, 2, 0, 2, ())
    assert poses(completed(logs, reports, continued=True)) == Line(4, 2, 2, 0, ())
    alone = completed((), reports, continued=True)
    assert poses(alone) == Line(4, 0, 4, 0, ())


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("studio", RealClock())


class Lossy:
    """A log's bus that loses the poses of some frames before its queue."""

    def __init__(self, bus: LocalBus, lost: range) -> None:
        self._bus, self._deliver, self._frames, self.lost = bus, bus.deliver, 0, lost
        bus.deliver = self.deliver  # type: ignore[method-assign]

    def deliver(self, key: str, data: bytes) -> None:
        if key.endswith("/bap"):
            self._frames += 1
            if self._frames - 1 in self.lost:
                return
        self._deliver(key, data)


def publish(bus: LocalBus, poses: int, seconds: int = 3) -> None:
    """Publish poses, and a health each second."""
    meter, frame, begun_ns = Meter("integrator", "main"), 0, RealClock().now_ns() - SECOND
    for second in range(seconds):
        report = meter.report(begun_ns + second * SECOND, second * SECOND, Phase.RUNNING, "", bus.counters, None)
        bus.publish(HEALTH, report)
        bus.publish(PARTIAL_BDP, bdp("1", second))  # latched: not counted
        for _ in range(poses):
            bus.publish(UNIVERSAL_BAP, bap(frame))
            frame += 1


@pytest.mark.parametrize(("lost", "expected"), [(range(0), 0), (range(3, 5), 2), (range(8, 12), 4)])
def test_a_log_reports_what_the_network_lost(network: LocalNetwork, tmp_path: Path, lost: range, expected: int) -> None:
    bus, reader = network.bus(), network.bus()
    bus.declare_alive("integrator", "main")
    Lossy(reader, lost)
    log = Log(reader, Recording(tmp_path / "take.mcap", rig="studio", start_ns=0), whole_rig=True)
    control = LogControl(network.bus(), lambda: log, log)
    control.start()
    publish(bus, 5, seconds=4)
    (end,) = control.close()
    assert (end.lost, end.missing, end.incomplete) == (expected, expected, expected > 0)
    assert control.counts().get("log_missing", 0) == control.counts()["log_lost"] == expected
    found = take_account(tmp_path / "take.mcap")
    assert (found.complete, found.account.missing, found.refused) == (True, expected, {})
    line = found.account.lines()[INTEGRATOR, "universal_bap"]
    assert (line.sent, line.seen, line.missing) == (20 - sum(k >= 15 for k in lost), 20 - len(lost), expected)


def test_a_log_in_parts_reports_what_was_lost_within_and_between_them(network: LocalNetwork, tmp_path: Path) -> None:
    bus, reader, meter = network.bus(), network.bus(), Meter(*INTEGRATOR)
    lossy = Lossy(reader, range(3, 5))

    def open_part(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
        return Recording(path, rig="studio", start_ns=start_ns, metadata={"part": part} if part else {})

    parts = Parts(open_part, tmp_path / "take.mcap", 0, PartLimits(bytes=1))
    log = Log(reader, parts, whole_rig=True)
    log.subscribe()
    for frame in range(40):
        if frame % 5 == 0:
            now_ns = RealClock().now_ns()
            bus.publish(HEALTH, meter.report(now_ns, now_ns, Phase.RUNNING, "", bus.counters, None))
        if frame in (12, 23, 24, 39):  # a new part begins; some have no health
            parts.flush()
        lossy.lost = range(3, 5) if frame < 20 else range(22, 26)
        bus.publish(UNIVERSAL_BAP, bap(frame))
        while (event := reader.receive()) is not None:
            log.handle(event)
    end = log.close()
    assert parts.number >= 4  # and one for each second that it takes
    assert (end.missing, end.lost) == (6, 6)
    whole = Account()
    for number, path in enumerate(sorted(tmp_path.glob("*.mcap"), key=lambda path: take_account(path).start_ns)):
        whole = joined(whole, take_account(path).account, continued=number > 0)
    assert whole.missing == 6


def test_a_log_of_some_topics_has_lost_nothing(network: LocalNetwork, tmp_path: Path) -> None:
    bus = network.bus()
    bus.declare_alive("integrator", "main")
    log = Log(network.bus(), Recording(tmp_path / "take.mcap", rig="studio", start_ns=0), (HEALTH,))
    log.start()
    publish(bus, 5)
    assert log.close().lost == 0
    take = TakeReader(tmp_path / "take.mcap")
    list(take.messages())
    assert METADATA not in take.metadata


def test_a_log_subscribes_to_the_health_last(
    network: LocalNetwork, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a health could arrive before messages that it counts are received, and they would be missing."""
    reader, topics = network.bus(), list[Topic]()
    monkeypatch.setattr(reader, "subscribe", lambda topic, **_: topics.append(topic))
    log = Log(reader, Recording(tmp_path / "take.mcap", rig="studio", start_ns=0), whole_rig=True)
    log.start()
    log.close()
    assert topics[-1] is HEALTH
    assert set(topics) == set(TOPICS)
