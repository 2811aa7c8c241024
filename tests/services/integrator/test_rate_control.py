"""Frame rate of an overloaded rig, with simulated viewers of limited speed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from tests.common.runtime.test_frame_rate import kept
from tests.support.two_view_run import envelope
from zenocap.common.bus.protocol import Tick
from zenocap.common.messages import FrameRate, Health, Message, Phase, TrackerDetail
from zenocap.common.runtime.frame_rate import SLOWEST_HZ, FrameChoice, Share, share_of
from zenocap.services.integrator.parameters import DETAIL_LEVELS, RATE_LEVELS, RECOVERY_TICKS, REPEATS
from zenocap.services.integrator.rate_control import describe, step
from zenocap.services.integrator.rate_reports import RateSetup, RateState

S = 1_000_000_000
FPS = 30.0


def health(service: str, id: str, now_s: int, counts: Mapping[str, float], busy: float = 0.5) -> Health:
    return Health(
        frame=0, captured_ns=now_s * S, service=service, id=id, state="", rate=0.0, stages_ms={}, busy=min(1.0, busy),
        counts={name: int(count) for name, count in counts.items()}, phase=Phase.TRACKING, clock_error_ns=1,
    )  # fmt: skip


@dataclass
class Plant:
    """Viewers and a tracker that process up to so many frames per second, and lose the others.

    capacity: of each viewer; tracker: of it in full detail, None for no tracker.  busy: as reported, None: as it is.
    """

    capacity: dict[str, float]
    tracker: float | None = None
    busy: float | None = None
    setup: RateSetup = field(init=False)
    state: RateState = field(default_factory=RateState)
    now_s: int = 0
    processed: dict[str, float] = field(default_factory=dict)
    dropped: dict[str, float] = field(default_factory=dict)
    overrun: dict[str, float] = field(default_factory=dict)
    instants: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    detail: float = 1.0
    published: list[tuple[int, Message]] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.setup = RateSetup(tuple(self.capacity), FPS, self.tracker is not None)

    @property
    def rate(self) -> float:
        return FPS * self.state.share.value

    def second(self) -> None:
        """One second of frames, the reports about them, and a decision."""
        self.now_s += 1
        offered, complete = self.rate, 1.0
        for viewer, capacity in self.capacity.items():
            done = min(offered, capacity)
            lost = offered - done
            self.processed[viewer] = self.processed.get(viewer, 0) + done
            self.dropped[viewer] = self.dropped.get(viewer, 0) + lost
            self.overrun[viewer] = self.overrun.get(viewer, 0) + min(done, lost)
            complete = min(complete, done / offered)
            counts = {"frames": self.processed[viewer], "dropped_frames": self.dropped[viewer]}
            busy = self.busy or offered / capacity
            self.give(health("viewer", viewer, self.now_s, counts | {"overrun_frames": self.overrun[viewer]}, busy))
        instants = offered * complete
        self.instants[0] += instants
        self.instants[1] += offered - instants
        if self.tracker is not None:
            tracked = min(instants, self.tracker / self.detail)
            self.instants[2] += instants - tracked
            instants = tracked
            names = ("whole_instants", "incomplete_instants", "dropped_instants")
            counts = dict(zip(names, self.instants, strict=True))
            self.give(health("tracker", "main", self.now_s, counts, offered / self.tracker * self.detail))
        self.whole.append(instants)
        self.give(Tick(self.now_s * S + 1000))

    def give(self, event: Health | Tick) -> None:
        self.state, messages = step(self.setup, self.state, event if isinstance(event, Tick) else envelope(event))
        self.published += [(self.now_s, message) for message in messages]
        for message in messages:
            if isinstance(message, TrackerDetail):
                self.detail = message.share

    def run(self, seconds: int) -> "Plant":
        for _ in range(seconds):
            self.second()
        return self

    def rates(self) -> list[tuple[int, float]]:
        return [
            (second, round(FPS * share_of(message).value, 1))
            for second, message in self.published
            if isinstance(message, FrameRate)
        ]


def test_a_rig_that_keeps_up_is_told_so_once() -> None:
    plant = Plant({"1": 31.0, "2": 40.0}).run(120)
    assert (plant.rates(), describe(plant.state)) == ([(RECOVERY_TICKS, 30.0)], "")


def test_twice_what_the_viewers_can_do_is_halved_within_seconds_and_named() -> None:
    plant = Plant({"1": 15.0, "2": 40.0}).run(10)
    assert plant.rates() == [(2, 30.0), (pytest.approx(4, abs=1), 15.0)]
    assert describe(plant.state) == "reduced to 15 of 30 frames/s: processor of viewer 1"


@pytest.mark.nightly
@settings(max_examples=40, deadline=None)
@given(st.floats(6.5, 29.0), st.integers(2, 32))
def test_most_of_what_the_slowest_viewer_can_do_comes_out_as_whole_instants(capacity: float, viewers: int) -> None:
    plant = Plant({str(k): capacity * (1 + k / 10) for k in range(viewers)}).run(100)
    assert sum(plant.whole[20:]) / 80 >= 0.73 * capacity


def test_the_rate_does_not_fall_below_the_slowest() -> None:
    plant = Plant({"1": 1.0, "2": 1.0})
    for _ in range(30):
        plant.second()
        for viewer in plant.processed:  # blocked viewers would report nothing to compare
            plant.processed[viewer] += 5
    assert plant.rate == pytest.approx(SLOWEST_HZ)


def test_the_rate_returns_to_full_by_itself_after_the_overload() -> None:
    plant = Plant({"1": 8.0, "2": 8.0}).run(20)
    assert plant.rate <= 8
    plant.capacity = {"1": 100.0, "2": 100.0}
    plant.run(90)
    assert plant.rate == FPS
    assert describe(plant.state) == ""


def test_a_level_that_fails_again_is_tried_less_and_less_often() -> None:
    """The loops seem to have time, as where processes wait for a core."""
    plant = Plant({"1": 15.5, "2": 15.5}, busy=0.3).run(400)
    failing = [second for second, rate in plant.rates() if rate > 15.5][1:]
    waits = [after - before for before, after in pairwise(failing)]
    assert max(waits[-2:]) >= 60
    assert len(failing) <= 12


def test_a_level_at_which_a_loop_would_work_all_the_time_is_not_tried() -> None:
    assert [rate for _, rate in Plant({"1": 15.5, "2": 15.5}).run(400).rates()] == [30.0, 15.0]


def test_one_stall_is_no_overload() -> None:
    plant = Plant({"1": 31.0, "2": 31.0}).run(10)
    plant.dropped["1"] += 25  # of one second; the frame after it counts as overrun
    plant.overrun["1"] += 1
    plant.instants[1] += 25
    plant.run(10)
    assert plant.rates() == [(2, 30.0)]


def test_losses_of_many_viewers_at_different_instants_add_up() -> None:
    """Each of 20 viewers loses 2 % of its frames: a third of the instants are incomplete."""
    plant = Plant({str(k): 100.0 for k in range(20)}, tracker=100.0).run(3)
    for _ in range(5):
        for viewer in plant.capacity:
            plant.dropped[viewer] += 1
            plant.overrun[viewer] += 1
        plant.instants[0] -= 10
        plant.instants[1] += 10
        plant.second()
    assert plant.rate < FPS


def test_instants_that_the_network_loses_are_no_reason_for_a_lower_rate() -> None:
    plant = Plant({"1": 100.0, "2": 100.0}, tracker=100.0).run(3)
    for _ in range(20):
        plant.instants[0] -= 15
        plant.instants[1] += 15
        plant.second()
    assert plant.rate == FPS


def test_the_tracker_is_thinned_before_instants_are_left_out() -> None:
    plant = Plant({"1": 100.0, "2": 100.0}, tracker=20.0).run(20)
    details = [message.share for _, message in plant.published if isinstance(message, TrackerDetail)]
    assert details[:2] == [1.0, DETAIL_LEVELS[1]]
    assert plant.rates() == [(2, 30.0)]
    assert describe(plant.state) == "tracker with 50% of its points"


def test_a_tracker_that_is_too_slow_in_the_least_detail_reduces_the_rate() -> None:
    plant = Plant({"1": 100.0, "2": 100.0}, tracker=8.0).run(40)
    assert 10 < plant.rate <= 16
    assert "processor of the tracker; tracker with 50%" in describe(plant.state)
    plant.tracker = 100.0
    plant.run(120)
    assert (plant.rate, plant.detail) == (FPS, 1.0)


def test_a_tracker_that_searches_is_no_reason_for_a_lower_rate() -> None:
    plant = Plant({"1": 100.0, "2": 100.0}).run(3)
    plant.setup = RateSetup(("1", "2"), FPS, has_tracker=True)
    for second in range(4, 20):
        plant.second()
        counts = {"whole_instants": 30 * second, "incomplete_instants": 0, "dropped_instants": 25 * second}
        plant.give(structs.replace(health("tracker", "main", second, counts), phase=Phase.LOST))
    assert plant.rate == FPS


def test_a_restarted_integrator_continues_with_the_rate_that_was_decided() -> None:
    before = Plant({"1": 15.0, "2": 15.0}).run(10)
    last = next(message for _, message in reversed(before.published) if isinstance(message, FrameRate))
    after = Plant({"1": 15.0, "2": 15.0}, now_s=before.now_s)
    after.state, published = step(after.setup, after.state, envelope(last))
    assert published == [last]
    after.run(3)
    assert after.rate == 15.0
    again, published = step(after.setup, after.state, envelope(last))
    assert (again, published) == (after.state, [])


def test_a_decision_of_another_rig_is_not_continued() -> None:
    other = FrameRate(frame=0, captured_ns=S, keep=7, of=9, from_ns=S, phase_ns=0, fps=30.0)
    assert step(RateSetup(("1",), FPS), RateState(), envelope(other)) == (RateState(), [])


@pytest.mark.parametrize(
    ("other", "times"),
    [
        (FrameRate(frame=9, captured_ns=2**62, keep=1, of=30, from_ns=2**62, phase_ns=0, fps=30.0), REPEATS),
        (TrackerDetail(frame=9, captured_ns=0, share=0.1), 1),
    ],
)
def test_a_decision_of_another_integrator_is_answered(other: FrameRate | TrackerDetail, times: int) -> None:
    """As of the one that ran in the other part of a cut network, and as viewers and tracker would follow it for ever."""
    plant = Plant({"1": 30.0, "2": 30.0}, tracker=30.0).run(10)
    before = len(plant.published)
    answers = []
    for _ in range(20):
        plant.state, answer = step(plant.setup, plant.state, envelope(other))
        answers += answer  # a flood of them is not answered by a flood
    rate, detail = answers
    assert isinstance(rate, FrameRate)
    assert isinstance(detail, TrackerDetail)
    assert share_of(rate) == Share()
    assert 10 * S <= rate.captured_ns < 12 * S
    assert detail.share == 1.0
    for message in answers:  # its own, which it receives too
        plant.state, again = step(plant.setup, plant.state, envelope(message))
        assert again == []
    repeated = [message for _, message in plant.run(REPEATS + 2).published[before:]]
    assert [type(message) for message in repeated] == times * [FrameRate, TrackerDetail]
    for message in repeated:
        plant.state, again = step(plant.setup, plant.state, envelope(message))
        assert again == []
    assert len(plant.run(3).published) == before + 2 * times


@pytest.mark.parametrize("changed", [{"of": 6}, {"phase_ns": 20_000_000}, {"limit": "viewers", "viewers": ["9"]}])
def test_false_decisions_keep_the_rate_from_no_adaptation(changed: dict[str, object]) -> None:
    """One each 3 s kept every tick busy with its contradiction, and what the viewers reported was forgotten."""
    plant = Plant({"1": 15.0, "2": 40.0}).run(RECOVERY_TICKS)
    for second in range(60):
        if second == 30:
            plant.capacity["1"] = 100.0
        if second % 3 == 0:
            assert plant.state.decided is not None
            false = structs.replace(plant.state.decided, captured_ns=plant.now_s * S + S // 2, **changed)
            plant.state, answer = step(plant.setup, plant.state, envelope(false))
            assert [type(message) for message in answer] == [FrameRate]
        plant.second()
        if second == 20:
            assert plant.rate == 15.0
    assert plant.rate == FPS


def test_a_false_decision_before_the_first_own_one_does_not_hold_for_ever() -> None:
    """Of a time in a hundred years, since which nothing would have been calm."""
    plant = Plant({"1": 100.0, "2": 100.0}).run(RECOVERY_TICKS - 1)
    false = FrameRate(frame=9, captured_ns=2**62, keep=1, of=6, from_ns=2**62, phase_ns=0, fps=FPS)
    plant.state, _ = step(plant.setup, plant.state, envelope(false))
    assert plant.rate == 5.0
    assert plant.run(60).rate == FPS


def test_a_viewer_that_followed_another_rate_is_no_evidence_about_this_one() -> None:
    plant = Plant({"1": 100.0, "2": 100.0}).run(10)
    for _ in range(10):
        plant.now_s += 1
        for viewer in plant.capacity:
            plant.processed[viewer] += 10
            plant.overrun[viewer] += 10
            counts = {"frames": plant.processed[viewer], "overrun_frames": plant.overrun[viewer], "kept_percent": 20}
            plant.give(health("viewer", viewer, plant.now_s, counts))
        plant.give(Tick(plant.now_s * S + 1000))
    assert plant.rate == FPS


FALSE = {"phase": {"phase_ns": 20_000_000}, "fewer": {"of": 3}, "all": {"of": 1}, "time": {}}


@pytest.mark.parametrize("in_order", [True, False])
@pytest.mark.parametrize("ahead_s", [0.0, 0.5, 1.0, 1.5, 1.95, 3.0])
@pytest.mark.parametrize("changed", FALSE.values(), ids=FALSE)
def test_a_false_decision_of_any_time_is_contradicted_at_once(
    ahead_s: float, changed: dict[str, int], in_order: bool
) -> None:
    """And holds for two seconds at most where a viewer receives the answer before it.

    The one answer was older than a decision with a time ahead: where only the phase was false, that held for ever.
    """
    plant, viewer, clean = Plant({"1": 15.0, "2": 40.0}).run(10), FrameChoice(FPS), FrameChoice(FPS)
    own = plant.state.decided
    assert own is not None
    false = structs.replace(own, captured_ns=plant.now_s * S + round(ahead_s * S), **changed)
    before = len(plant.published)
    plant.state, answer = step(plant.setup, plant.state, envelope(false))
    later = [message for _, message in plant.run(2).published[before:]]
    for message in (own, false, *answer) if in_order else (own, *answer, false, *later):
        viewer.set_rate(message)
    clean.set_rate(own)
    times_ns = [20 * S + k * S // 30 for k in range(60)]
    assert kept(viewer, times_ns) == kept(clean, times_ns)
    for message in later:
        viewer.set_rate(message)
    assert kept(viewer, times_ns) == kept(clean, times_ns)
    assert len(plant.run(20).published) == before + REPEATS


def test_a_viewer_that_follows_another_decision_gets_this_one_again() -> None:
    """Whether it missed this one, or got a foreign one that this integrator missed."""
    plant = Plant({"1": 30.0, "2": 30.0}).run(10)
    before = len(plant.published)
    plant.now_s += 1
    plant.give(health("viewer", "2", plant.now_s, {"frames": 330, "kept_percent": 1}))
    plant.run(2)
    (message,) = (message for _, message in plant.published[before:])
    assert isinstance(message, FrameRate)
    assert share_of(message) == Share()
    plant.give(health("viewer", "2", plant.now_s + 2, {"frames": 390, "kept_percent": 100}))
    assert len(plant.run(3).published) == before + 1


def test_the_same_events_give_the_same_decisions() -> None:
    runs = [Plant({"1": 11.0, "2": 17.0}, tracker=9.0).run(60).published for _ in range(2)]
    assert runs[0] == runs[1]


def test_levels_differ_by_at_most_a_quarter() -> None:
    values = [Share(*pair).value for pair in RATE_LEVELS]
    assert values[0] == 1
    assert all(0.74 < after / before < 0.95 for before, after in pairwise(values))
