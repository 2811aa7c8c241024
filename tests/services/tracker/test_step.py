"""The tracker's step around a stand-in core: frame sets passed to it, and messages published."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import cycle, pairwise

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support import built_messages
from tests.support.built_messages import built, camera_message
from tests.support.tracker_stand_in import BDP, FRAME_NS, POINTS, POSE, SIZE, SPREAD, stand_in, tracker_setup
from tests.support.tracker_steps import pass_to, track_each, track_queued
from tests.support.two_view_run import envelope
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Alive, Tick
from zenocap.common.codec import decode, encode
from zenocap.common.conversion import angles_of, bdp_of, points_of
from zenocap.common.synchronizer import GONE_AFTER
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.parameters import BEHIND_FRAME_SETS, MAX_QUEUED_FRAME_SETS, POINTS_PERIOD_NS
from zenocap.services.tracker.states import TrackerState, with_detail

SETUP = tracker_setup()
VIEWERS = tuple(SETUP.cameras)
PERSON = np.zeros((SIZE[1], SIZE[0]), np.uint8)
PERSON[30:90, 70:90] = 1
EMPTY = np.zeros_like(PERSON)
LARGE = np.zeros((240, 320), np.uint8)


@pytest.fixture(autouse=True)
def core() -> Iterator[None]:
    with stand_in():
        yield


def test_the_detail_under_overload_is_an_input_that_reduces_points_and_particles() -> None:
    state, _ = pass_to(SETUP, None, [m.TrackerDetail(frame=0, captured_ns=1, share=0.5)])
    reduced = with_detail(SETUP, state.detail).options
    assert (reduced.points, reduced.particles) == (SETUP.options.points // 2, SETUP.options.particles // 2)
    assert with_detail(SETUP, 1.0) is SETUP


def test_silhouettes_are_paired_within_half_of_the_reduced_period() -> None:
    """Two cameras 0.9 frame periods apart, of which every second frame is processed."""
    for keep, complete in ((1, 10), (2, 0)):
        rate = m.FrameRate(frame=0, captured_ns=1, keep=keep, of=2, from_ns=1, phase_ns=0, fps=15.0)
        late = [
            silhouette(viewer, frame, offset_ns=FRAME_NS * 9 // 10 if viewer == VIEWERS[-1] else 0)
            for frame in range(0, 22, 2) for viewer in VIEWERS
        ]  # fmt: skip
        state, _ = pass_to(SETUP, None, [rate, *late])
        assert state.pairs.complete >= complete
        assert (state.pairs.complete > 0) == (complete > 0)


def test_a_false_rate_that_no_viewer_follows_is_none_of_the_tracker() -> None:
    """It paired silhouettes that are 11 frame periods apart."""
    state, _ = pass_to(SETUP, None, [m.FrameRate(frame=0, captured_ns=1, keep=1, of=22, from_ns=1, phase_ns=0, fps=15.0)])
    assert state.pairs.spacing == 1


def test_delays_of_the_cameras_are_subtracted_from_the_capture_times() -> None:
    late = VIEWERS[-1]
    following, delayed = replace(SETUP, follow_delays=True), [delays(2 * FRAME_NS / 1e6)]
    # The times of one viewer are two frame periods too late.
    seen = [silhouette(viewer, frame + 2 * (viewer == late)) for frame in range(6) for viewer in VIEWERS]
    for setup, before, whole in ((following, [], False), (following, delayed, True), (SETUP, delayed, False)):
        state, _ = pass_to(setup, None, [*before, *seen])
        frames = {viewer: seen.frame for viewer, seen in state.ready[-1].items.items()}
        assert (late in frames) == whole
        if whole:
            assert frames[late] == frames[VIEWERS[0]] + 2


def test_the_tracker_is_told_when_the_times_of_a_view_are_corrected_anew() -> None:
    state, counts = None, []
    for late_ms in (20.0, 20.0, 40.0):
        state, _ = pass_to(replace(SETUP, follow_delays=True), state, [delays(late_ms)])
        counts.append(state.track.corrected)
    assert counts == [1, 1, 2]


def delays(late_ms: float) -> m.CameraDelays:
    applied_ms = {VIEWERS[-1]: late_ms}
    return m.CameraDelays(frame=0, captured_ns=1, found_ms={}, errors_ms={}, uncertain=[], applied_ms=applied_ms)


def losses(state: TrackerState) -> dict[str, int]:
    """The counts without those of frame sets that arrived."""
    return {name: count for name, count in tracker.counts(state).items() if not name.endswith("e_instants")}


def silhouette(viewer: str, frame: int, mask: np.ndarray = PERSON, offset_ns: int = 0) -> m.Silhouette:
    return built_messages.silhouette(viewer, frame, (100 + frame) * FRAME_NS + offset_ns, mask)


def instant(frame: int, viewers: tuple[str, ...] = VIEWERS, mask: np.ndarray = PERSON) -> list[m.Message]:
    return [silhouette(viewer, frame, mask) for viewer in viewers]


def instants(numbers: range, viewers: tuple[str, ...] = VIEWERS) -> list[m.Message]:
    return [message for frame in numbers for message in instant(frame, viewers)]


def play(messages: list[m.Message], state: TrackerState | None = None) -> tuple[TrackerState, list[m.Message]]:
    return track_each(SETUP, state, messages)


def poses(published: list[m.Message]) -> list[m.TrackerPose]:
    return [message for message in published if isinstance(message, m.TrackerPose)]


def frames(published: list[m.Message]) -> list[int]:
    return [pose.frame for pose in poses(published)]


def shown(state: TrackerState) -> list[tuple[str, ...]]:
    return [views for _, views in state.track.seen]


def test_body_is_published_once_and_a_pose_per_frame_set() -> None:
    state, published = play(instants(range(4)))
    kinds = [type(message) for message in published if not isinstance(message, m.ScenePoints)]
    assert kinds == [m.TrackerBdp, *[m.TrackerPose] * 4]
    body = decode(encode(published[0]), m.TrackerBdp).body
    np.testing.assert_array_equal(bdp_of(TEN_PARTS, body).sizes, BDP.sizes)
    assert frames(published) == [0, 1, 2, 3]
    assert tracker.describe(state) == "tracking"
    assert losses(state) == {}


def test_pose_message_has_all_results() -> None:
    pose = poses(play(instant(7))[1])[0]
    assert decode(encode(pose), m.TrackerPose) == pose
    assert (pose.frame, pose.captured_ns) == (7, 107 * FRAME_NS)
    assert pose.position == tuple(POSE.position)
    np.testing.assert_array_equal(angles_of(TEN_PARTS, pose.angles, TEN_PARTS.neutral), POSE.angles)
    np.testing.assert_array_equal([*pose.spread.values(), *pose.position_spread], SPREAD)
    assert list(pose.spread) == list(TEN_PARTS.angles)
    assert (pose.likelihood, pose.effective, pose.lost, pose.views) == (-0.5, 20.0, False, list(VIEWERS))


def test_the_last_pose_is_repeated_while_the_person_is_lost() -> None:
    _, published = play([*instant(0, mask=EMPTY), *instant(1), *instant(2, mask=EMPTY), *instant(3)])
    found = poses(published)
    assert [(pose.frame, pose.lost) for pose in found] == [(1, False), (2, True), (3, False)]
    assert found[1].position == found[0].position
    assert found[1].angles == found[0].angles
    assert (found[1].views, found[1].effective) == ([], 0.0)
    assert found[1].captured_ns == 102 * FRAME_NS


def test_views_are_in_the_rigs_order() -> None:
    forward, _ = play(instant(0))
    backward, _ = play(instant(0)[::-1])
    assert shown(forward) == shown(backward) == [VIEWERS]


def test_view_may_leave_and_return() -> None:
    two = VIEWERS[:2]
    gone = 3 + GONE_AFTER + 4
    before = instants(range(3))
    without = instants(range(3, gone), two)
    state, published = play([*before, *without])
    assert frames(published) == list(range(gone))
    assert tracker.describe(state) == "tracking, without viewer 3"
    state, more = play(instants(range(gone, gone + 3)), state)
    assert frames(more) == list(range(gone, gone + 3))
    assert shown(state)[-1] == VIEWERS
    assert tracker.describe(state) == "tracking"
    # An absent viewer is not waited for: its first frame after the return may be late.
    assert losses(state) == {"silhouette_unpaired": len(without) // 2 + 1, "silhouette_late": 1}


def test_late_view_delays_one_frame() -> None:
    _, published = play([*instant(0), *instant(1, VIEWERS[:2])])
    assert frames(published) == [0], "waiting for viewer 3"
    state, published = play([*instant(0), *instant(1, VIEWERS[:2]), *instant(2, VIEWERS[:1]), *instant(1, VIEWERS[2:])])
    assert frames(published) == [0, 1]
    assert shown(state) == [VIEWERS, VIEWERS[:2]]
    assert tracker.counts(state)["silhouette_late"] == 1


def test_single_view_is_counted_without_a_pose() -> None:
    state, published = play(instants(range(8), ("2",)))
    assert poses(published) == []
    assert tracker.counts(state)["alone"] >= 7
    assert tracker.describe(state) == "waiting for a second view; viewer 1 and 3 missing"


def test_overload_drops_the_oldest_frame_sets() -> None:
    state, _ = pass_to(SETUP, None, instants(range(MAX_QUEUED_FRAME_SETS)))
    assert losses(state) == {}
    state, _ = pass_to(SETUP, state, instants(range(MAX_QUEUED_FRAME_SETS, 10)))
    state, published = track_queued(SETUP, state)
    assert frames(published) == [9]
    assert losses(state) == {"dropped_instants": 9}


def ages(state: TrackerState, durations: Sequence[float], offered: range) -> tuple[TrackerState, list[float]]:
    """Age of each pose when it is published, in periods of the frame sets, of which one arrives in every period.

    durations: of the tracker for one frame set, in turn; it takes what has arrived when it is done with the one before.
    """
    now, arriving, each, found = float(offered.start), list(offered), cycle(durations), list[float]()
    while arriving:
        while arriving and arriving[0] <= now:
            state, _ = pass_to(SETUP, state, instant(arriving.pop(0)))
        if tracker.pending(state):
            state, published = tracker.step(SETUP, state, Tick(1))
            now += next(each)
            found += [now - frame for frame in frames(published)]
        elif arriving:
            now = float(arriving[0])
    return state, found


OVERLOADS = {
    "twice": (1.95,), "three times": (2.95,), "a fiftieth more": (1.02,), "all, with jitter": (0.4, 1.9, 0.6, 1.2)
}  # fmt: skip


@pytest.mark.parametrize("durations", OVERLOADS.values(), ids=OVERLOADS)
def test_under_overload_a_pose_is_late_by_its_own_time_and_one_period_at_most(durations: tuple[float, ...]) -> None:
    """It was one period later: the older of two that waited was tracked."""
    state, found = ages(tracker.initial_state(SETUP), durations, range(300))
    assert tracker.counts(state)["dropped_instants"] > 0
    settled = found[len(found) // 2 : -1]  # after the first drop, and while frame sets arrive
    assert max(settled) <= 1.0 + max(durations) + 1e-9
    assert len(found) >= 0.8 * 300 / max(1.0, np.mean(durations))


def test_only_the_newest_frame_set_waits_while_the_rig_leaves_out_frames_or_points() -> None:
    """At a rate that a tracker can just keep up with, two would wait again and again without a drop."""
    rate = m.FrameRate(frame=0, captured_ns=1, keep=5, of=6, from_ns=1, phase_ns=0, fps=15.0)
    reduced, _ = pass_to(SETUP, None, [rate])
    thinned, _ = pass_to(SETUP, None, [m.TrackerDetail(frame=0, captured_ns=1, share=0.5)])
    full, _ = pass_to(SETUP, reduced, [msgspec.structs.replace(rate, keep=1, of=1)])
    waiting = [len(pass_to(SETUP, state, instants(range(2)))[0].ready) for state in (reduced, thinned, full)]
    assert waiting == [1, 1, MAX_QUEUED_FRAME_SETS]


def test_jitter_drops_no_frame_set_and_none_either_once_an_overload_is_over() -> None:
    jitter = (2.4, *[0.3] * 5)
    state, _ = ages(tracker.initial_state(SETUP), jitter, range(60))
    assert losses(state) == {}
    state, _ = ages(state, (1.95,), range(60, 80))
    behind, dropped = state.behind, losses(state)
    state, _ = ages(state, (0.3,), range(80, 85 + BEHIND_FRAME_SETS))
    assert (behind > 0, state.behind) == (True, 0)
    state, _ = ages(state, jitter, range(85 + BEHIND_FRAME_SETS, 150 + BEHIND_FRAME_SETS))
    assert losses(state) == dropped


def test_damaged_silhouettes_exclude_their_view() -> None:
    bad = msgspec.structs.replace(silhouette("1", 0), data=b"no zlib")
    state, published = play([bad, *instant(0, ("2", "3")), silhouette("2", 1, LARGE), *instant(1, ("1", "3"))])
    assert frames(published) == [0, 1]
    assert shown(state) == [("2", "3"), ("1", "3")]
    assert losses(state) == {"damaged": 2}
    state, published = play([bad, silhouette("2", 0, LARGE), silhouette("3", 0)])
    assert published == []
    assert losses(state) == {"damaged": 2, "alone": 1}


def test_failing_frame_set_is_counted_and_reported() -> None:
    state, published = play([*instant(0), *instant(1, mask=np.ones_like(PERSON)), *instant(2)][:6])
    assert frames(published) == [0]
    assert losses(state) == {"failed": 1}
    assert tracker.describe(state) == "tracking; a frame set failed: a view that is all person"
    state, published = play(instant(2), state)
    assert frames(published) == [2]
    assert tracker.describe(state) == "tracking"


def test_inconsistent_views_are_in_the_health_text() -> None:
    state, published = play([silhouette("1", 0), silhouette("2", 0), silhouette("3", 0, EMPTY)])
    assert poses(published)[0].views == ["1", "2"]
    assert tracker.describe(state) == "tracking; view 3 is empty"


def health(viewer: str, offset_ns: int) -> m.Health:
    return built(m.Health, captured_ns=1, id=viewer, rate=15.0, clock_offset_ns=offset_ns, clock_error_ns=1000)


def test_clock_offsets_are_corrected_and_reported() -> None:
    ahead = 3 * FRAME_NS
    messages = [silhouette("1", 0), silhouette("2", 0), silhouette("3", 0, offset_ns=ahead)]
    state, published = play([health("3", ahead), *messages])
    assert frames(published) == [0]
    assert poses(published)[0].captured_ns == 100 * FRAME_NS
    assert "viewer 3: its clock is 200.0 ms ahead of the integrator's" in tracker.describe(state)
    state, _ = play([health("3", 0), health("9", ahead), *instant(1)], state)
    assert "clock" not in tracker.describe(state)


def camera_of(viewer: str, focal: float = 1.0) -> m.CameraInfo:
    camera = SETUP.cameras[viewer]
    return camera_message(camera, viewer=viewer, matrix=(focal * camera.matrix).ravel().tolist())


def test_viewer_with_another_calibration_is_reported() -> None:
    state, _ = play([*instant(0), *(camera_of(viewer) for viewer in VIEWERS)])
    assert tracker.describe(state) == "tracking"
    state, _ = play([camera_of("2", 1.01)], state)
    assert tracker.describe(state).startswith("tracking; viewer 2 has another calibration than this rig file")
    state, _ = play([camera_of("2")], state)
    assert tracker.describe(state) == "tracking"


def test_initial_health_text_and_ignored_events() -> None:
    state = tracker.initial_state(SETUP)
    assert tracker.describe(state) == "waiting for silhouettes"
    for event in (Tick(1), Alive("viewer", "1", True, 1), envelope(silhouette("9", 0))):
        after, published = tracker.step(SETUP, state, event)
        assert published == []
        assert not tracker.pending(after)


EVENTS = st.lists(st.tuples(st.sampled_from(["1", "2", "3", "tick"]), st.integers(0, 6)), max_size=40)


@pytest.mark.slow
@given(EVENTS)
@settings(max_examples=100)
def test_poses_are_in_time_order_and_of_two_views_or_more(events: list[tuple[str, int]]) -> None:
    state, published = tracker.initial_state(SETUP), []
    for viewer, frame in events:
        event = Tick(1) if viewer == "tick" else envelope(silhouette(viewer, frame))
        state, more = tracker.step(SETUP, state, event)
        published += more
        assert len(state.ready) <= MAX_QUEUED_FRAME_SETS
    times = [pose.captured_ns for pose in poses(published)]
    assert times == sorted(set(times))
    assert all(len(pose.views) >= 2 for pose in poses(published))


def test_same_events_give_the_same_bytes() -> None:
    messages = [message for k in range(5) for message in instant(k, VIEWERS[: 2 + k % 2])]
    first, second = ([encode(message) for message in play(messages)[1]] for _ in range(2))
    assert first == second


@pytest.mark.slow
@given(EVENTS)
@settings(max_examples=100)
def test_tracker_without_overload_drops_nothing(events: list[tuple[str, int]]) -> None:
    """As offline: every frame set is tracked before the next message."""
    state, _ = play([silhouette(viewer, frame) for viewer, frame in events if viewer != "tick"])
    assert "dropped_instants" not in tracker.counts(state)


def test_scene_points_are_published_at_most_ten_times_a_second() -> None:
    _, published = play(instants(range(7)))
    clouds = [message for message in published if isinstance(message, m.ScenePoints)]
    assert [cloud.frame for cloud in clouds] == [0, 2, 4, 6]  # of 15 frames a second
    assert all(later.captured_ns - one.captured_ns >= POINTS_PERIOD_NS for one, later in pairwise(clouds))
    np.testing.assert_allclose(points_of(clouds[0]), POINTS, atol=0.0005)
