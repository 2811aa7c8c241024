"""Viewers agree on when to begin, whoever starts first."""

from collections.abc import Iterator

import pytest

from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Received
from common.messages import CameraInfo
from common.runtime.clock import ManualClock
from common.topics import CAMERA
from services.viewer.beginning import LEAD_NS, agreed_epoch

START_NS = 10**18
SECOND = 10**9


def info(viewer: str, captured_ns: int) -> CameraInfo:
    return CameraInfo(
        frame=0,
        captured_ns=captured_ns,
        viewer=viewer,
        name="cam01",
        size=(160, 120),
        matrix=[0.0] * 9,
        distortions=[],
        rotation=[0.0] * 9,
        translation=[0.0] * 3,
    )


class Scene:
    """A viewer's bus on which time passes with every `receive`, and the other viewer says things at certain times."""

    def __init__(self, *said: tuple[float, CameraInfo]) -> None:
        self.clock = ManualClock(START_NS)
        self.network = LocalNetwork("studio", self.clock)
        self.bus: LocalBus = self.network.bus()
        self.other = self.network.bus()
        self.heard: LocalBus = self.network.bus()
        self.heard.subscribe(CAMERA, every=True)
        self.said = iter(said)
        self.next = next(self.said, None)
        receive = self.bus.receive

        def passing(timeout_s: float = 0.0) -> Received | None:
            self.clock.advance(int(0.05 * SECOND))
            while self.next and self.clock.now_ns() >= START_NS + self.next[0] * SECOND:
                self.other.publish(CAMERA, self.next[1])
                self.next = next(self.said, None)
            return receive(timeout_s)

        self.bus.receive = passing  # type: ignore[method-assign]  # a bus on which waiting takes time

    def epoch(self) -> int:
        return agreed_epoch(["2"], lambda epoch_ns: info("1", epoch_ns), self.bus, self.clock, self._late)

    def _late(self) -> bool:
        return self.clock.now_ns() > START_NS + 60 * SECOND

    def proposals(self) -> Iterator[int]:
        while (event := self.heard.receive()) is not None:
            message = getattr(event, "message", None)
            if isinstance(message, CameraInfo) and message.viewer == "1":
                yield message.captured_ns


def test_the_first_waits_and_the_later_proposal_holds() -> None:
    theirs = START_NS + 5 * SECOND + LEAD_NS
    scene = Scene((5.0, info("2", theirs)))
    assert scene.epoch() == theirs
    assert len(list(scene.proposals())) > 3  # while it waits, none of them gets old


def test_the_second_takes_its_own_later_proposal() -> None:
    scene = Scene((0.0, info("2", START_NS + SECOND)))
    epoch_ns = scene.epoch()
    assert epoch_ns == max(scene.proposals())
    assert epoch_ns > START_NS + SECOND


def test_who_comes_back_joins_what_has_begun() -> None:
    scene = Scene((0.2, info("2", START_NS - 40 * SECOND)))
    assert scene.epoch() == START_NS - 40 * SECOND


@pytest.mark.parametrize("delay_s", [0.0, 0.3, 0.9, 1.7, 4.2])
def test_both_agree(delay_s: float) -> None:
    """What the other would take, having heard this one's last proposal, is what this one takes."""
    theirs = START_NS + int(delay_s * SECOND) + LEAD_NS
    scene = Scene((delay_s, info("2", theirs)))
    epoch_ns = scene.epoch()
    assert epoch_ns == max(theirs, *scene.proposals())
