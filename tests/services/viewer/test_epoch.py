"""Agreement of viewers on a common epoch, in any order of their starts."""

from collections.abc import Iterator
from functools import partial

import pytest

from tests.support.built_messages import built
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Received
from zenocap.common.messages import CameraInfo
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import CAMERA
from zenocap.services.viewer.epoch import agreed_epoch
from zenocap.services.viewer.parameters import EPOCH_AHEAD_NS, EPOCH_LEAD_NS

START_NS = 10**18
SECOND = 10**9


def info(viewer: str, captured_ns: int) -> CameraInfo:
    return built(CameraInfo, captured_ns=captured_ns, viewer=viewer)


class ClockSetBack(ManualClock):
    """Set back by an hour one second after the start."""

    def now_ns(self) -> int:
        elapsed_ns = self.elapsed_ns()
        return elapsed_ns - (3600 * SECOND if elapsed_ns > START_NS + SECOND else 0)


class Scene:
    """A viewer's bus: time passes with every `receive`, and the other viewer publishes at given times."""

    def __init__(self, *scheduled: tuple[float, CameraInfo], clock: type[ManualClock] = ManualClock) -> None:
        self.clock = clock(START_NS)
        self.network = LocalNetwork("studio", self.clock)
        self.bus: LocalBus = self.network.bus()
        self.other = self.network.bus()
        self.observer: LocalBus = self.network.bus()
        self.observer.subscribe(CAMERA, every=True)
        self.scheduled = iter(scheduled)
        self.next = next(self.scheduled, None)
        receive = self.bus.receive

        def receive_with_delay(timeout_s: float = 0.0) -> Received | None:
            self.clock.advance(int(0.05 * SECOND))
            while self.next and self.clock.elapsed_ns() >= START_NS + self.next[0] * SECOND:
                self.other.publish(CAMERA, self.next[1])
                self.next = next(self.scheduled, None)
            return receive(timeout_s)

        self.bus.receive = receive_with_delay  # type: ignore[method-assign]  # a bus on which waiting takes time

    def epoch(self) -> int:
        return agreed_epoch({"2": lambda: 60 * SECOND}, partial(info, "1"), self.bus, self.clock, self._late)

    def _late(self) -> bool:
        return self.clock.elapsed_ns() > START_NS + 60 * SECOND

    def proposals(self) -> Iterator[int]:
        while (event := self.observer.receive()) is not None:
            if event.message.viewer == "1":
                yield event.message.captured_ns


def test_the_first_viewer_waits_and_the_later_proposal_is_used() -> None:
    theirs = START_NS + 5 * SECOND + EPOCH_LEAD_NS
    scene = Scene((5.0, info("2", theirs)))
    assert scene.epoch() == theirs
    assert len(list(scene.proposals())) > 3  # none of them expires during the wait


def test_the_second_viewer_uses_its_own_later_proposal() -> None:
    scene = Scene((0.0, info("2", START_NS + SECOND)))
    epoch_ns = scene.epoch()
    assert epoch_ns == max(scene.proposals())
    assert epoch_ns > START_NS + SECOND


def test_a_restarted_viewer_uses_the_running_epoch() -> None:
    scene = Scene((0.2, info("2", START_NS - 40 * SECOND)))
    assert scene.epoch() == START_NS - 40 * SECOND


@pytest.mark.parametrize("delay_s", [0.0, 0.3, 0.9, 1.7, 4.2])
def test_both_viewers_agree_on_the_epoch(delay_s: float) -> None:
    """The epoch that the other viewer would take from this one's last proposal is the epoch of this one."""
    theirs = START_NS + int(delay_s * SECOND) + EPOCH_LEAD_NS
    scene = Scene((delay_s, info("2", theirs)))
    epoch_ns = scene.epoch()
    assert epoch_ns == max(theirs, *scene.proposals())


@pytest.mark.parametrize("false_ns", [2**63 - 1, START_NS + EPOCH_AHEAD_NS + SECOND, START_NS - 61 * SECOND, 1])
def test_a_start_far_ahead_or_longer_ago_than_the_film_lasts_is_ignored_and_named_once(
    false_ns: int, caplog: pytest.LogCaptureFixture
) -> None:
    theirs = START_NS + SECOND + EPOCH_LEAD_NS
    scene = Scene((0.1, info("2", false_ns)), (0.2, info("2", false_ns)), (1.0, info("2", theirs)))
    assert scene.epoch() == theirs
    assert caplog.text.count("viewer 2: a start ") == 1


def test_a_clock_that_is_set_back_during_the_wait_delays_no_start() -> None:
    theirs = START_NS - 3595 * SECOND + EPOCH_LEAD_NS
    scene = Scene((5.0, info("2", theirs)), clock=ClockSetBack)
    assert scene.epoch() == theirs
