"""Messages that were sent and never arrived at a log."""

from pathlib import Path

import pytest

from tests.common.bus.test_inbox import bap
from tests.common.bus.test_local import bdp
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Alive, Counters, Envelope
from zenocap.common.messages import Phase
from zenocap.common.recording.arrivals import Arrivals
from zenocap.common.recording.log import Log
from zenocap.common.recording.writer import Recording
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.health import Meter
from zenocap.common.topics import HEALTH, PARTIAL_BDP, TOPICS, UNIVERSAL_BAP, Topic
from zenocap.services.integrator.log_control import LogControl

SECOND = 1_000_000_000
BEGINS, ENDS = Alive("integrator", "main", True, 0), Alive("integrator", "main", False, 0)


def pose(frame: int = 0) -> Envelope:
    return Envelope("zenocap/studio/integrator/bap", UNIVERSAL_BAP, bap(frame), 0)


def health(second: int, sent: int | None, frame: int | None = None, late_ns: int = 0) -> Envelope:
    meter = Meter("integrator", "main")
    for _ in range(second if frame is None else frame):
        meter.report(0, 0, Phase.RUNNING, "", Counters(0, {}, {}), None)
    now = meter.report(second * SECOND, second * SECOND, Phase.RUNNING, "", Counters(0, {}, {}, sent=sent), None)
    return Envelope("zenocap/studio/integrator/main/health", HEALTH, now, second * SECOND + late_ns)


def missing(*events: Envelope | Alive) -> int:
    arrivals = Arrivals()
    for event in events:
        arrivals.add(event)
    return arrivals.missing


def test_everything_that_arrives_is_not_missing() -> None:
    assert missing(BEGINS, pose(), health(1, 100), pose(), pose(), health(2, 103), health(3, 104)) == 0


def test_a_message_that_was_sent_and_does_not_arrive_is_missing() -> None:
    assert missing(BEGINS, health(1, 100), pose(), health(2, 103)) == 1
    assert missing(BEGINS, health(1, 100), pose(), health(2, 103), health(3, 106)) == 3


def test_healths_of_a_replay_do_not_say_what_was_sent() -> None:
    early, late = (health(second, sent, late_ns=60 * SECOND) for second, sent in ((1, 100), (2, 103)))
    assert missing(BEGINS, early, pose(), late) == 0


def test_a_health_that_does_not_arrive_is_missing_too() -> None:
    assert missing(BEGINS, health(1, 100), pose(), pose(), health(3, 104)) == 1


def test_what_was_sent_before_the_first_health_is_not_missing() -> None:
    assert missing(BEGINS, health(5, 5000), health(6, 5001)) == 0


def test_a_service_that_starts_again_has_lost_nothing() -> None:
    before = (BEGINS, health(1, 100), health(2, 103))
    assert missing(*before) == 2
    assert missing(*before, ENDS, BEGINS, health(8, 50, frame=0), health(9, 51, frame=1)) == 2
    assert missing(*before, health(8, 50, frame=0), health(9, 51, frame=1)) == 2  # killed, and its token still there


def test_two_processes_of_one_name_lose_nothing() -> None:
    """As both sides of a network that was cut, until the younger one ends."""
    old, new = (health(second, 100 * second, frame=second) for second in (60, 61)), (health(60, 1, 0), health(61, 2, 1))
    first, second = old
    assert missing(BEGINS, first, new[0], second, new[1]) == 0


def test_only_services_that_are_alive_are_compared() -> None:
    """A replay publishes the healths of a take, and not every message of it."""
    assert missing(health(1, 100), health(2, 103)) == 0
    assert missing(BEGINS, health(1, 100), ENDS, health(2, 103)) == 0


def test_a_health_without_the_count_is_of_an_earlier_version() -> None:
    assert missing(BEGINS, health(1, None), health(2, None)) == 0


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("studio", RealClock())


class Lossy:
    """A log's bus that loses the poses of some frames before its queue."""

    def __init__(self, bus: LocalBus, lost: range) -> None:
        self._bus, self._deliver, self._frames, self._lost = bus, bus.deliver, 0, lost
        bus.deliver = self.deliver  # type: ignore[method-assign]

    def deliver(self, key: str, data: bytes) -> None:
        if key.endswith("/bap"):
            self._frames += 1
            if self._frames - 1 in self._lost:
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
    bus = network.bus()
    bus.declare_alive("integrator", "main")
    reader = network.bus()
    Lossy(reader, lost)
    log = Log(reader, Recording(tmp_path / "take.mcap", rig="studio", start_ns=0), whole_rig=True)
    control = LogControl(network.bus(), lambda: log, log)
    control.start()
    publish(bus, 5, seconds=4)
    (end,) = control.close()
    assert (end.lost, end.missing, end.incomplete) == (expected, expected, expected > 0)
    assert control.counts().get("log_missing", 0) == control.counts()["log_lost"] == expected


def test_a_log_of_some_topics_has_lost_nothing(network: LocalNetwork, tmp_path: Path) -> None:
    bus = network.bus()
    bus.declare_alive("integrator", "main")
    log = Log(network.bus(), Recording(tmp_path / "take.mcap", rig="studio", start_ns=0), (HEALTH,))
    log.start()
    publish(bus, 5)
    assert log.close().lost == 0


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
