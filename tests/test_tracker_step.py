"""The tracker's step around a stand-in core: which instants reach it, and what is said of them."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracker_stand_in import BDP, FRAME_NS, POINTS, POSE, SIZE, SPREAD, Followed, stand_in, tracker_setup
from two_view_run import envelope

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.bus.protocol import Alive, Tick
from common.codec import decode, encode
from common.conversion import angles_of, bdp_of, points_of
from common.pairing import GONE_AFTER
from common.vision.packing import pack
from services.tracker import step as tracker
from services.tracker.states import MOST_READY, State

SETUP = tracker_setup()
VIEWERS = tuple(SETUP.cameras)
PERSON = np.zeros((SIZE[1], SIZE[0]), np.uint8)
PERSON[30:90, 70:90] = 1
NOBODY = np.zeros_like(PERSON)


@pytest.fixture(autouse=True)
def core() -> Iterator[None]:
    with stand_in():
        yield


def silhouette(viewer: str, frame: int, mask: np.ndarray = PERSON, offset_ns: int = 0) -> m.Silhouette:
    region, data = pack(mask)
    size = (mask.shape[1], mask.shape[0])
    captured_ns = (100 + frame) * FRAME_NS + offset_ns
    return m.Silhouette(frame=frame, captured_ns=captured_ns, viewer=viewer, size=size, region=region, data=data)


def instant(frame: int, viewers: tuple[str, ...] = VIEWERS, mask: np.ndarray = PERSON) -> list[m.Message]:
    return [silhouette(viewer, frame, mask) for viewer in viewers]


def play(messages: list[m.Message], state: State | None = None, *, busy: bool = False) -> tuple[State, list[m.Message]]:
    """busy: nothing comes to an end in between: one Tick for all at the end."""
    state = state or tracker.initial_state(SETUP)
    said: list[m.Message] = []
    for message in messages:
        state, more = tracker.step(SETUP, state, envelope(message))
        said += more
        if not busy:
            state, more = worked_off(state)
            said += more
    state, more = worked_off(state)
    return state, said + more


def worked_off(state: State) -> tuple[State, list[m.Message]]:
    said: list[m.Message] = []
    while tracker.pending(state):
        state, more = tracker.step(SETUP, state, Tick(1))
        said += more
    return state, said


def poses(said: list[m.Message]) -> list[m.TrackerPose]:
    return [message for message in said if isinstance(message, m.TrackerPose)]


def frames(said: list[m.Message]) -> list[int]:
    return [pose.frame for pose in poses(said)]


def shown(state: State) -> list[tuple[str, ...]]:
    assert isinstance(state.track, Followed)
    return [views for _, views in state.track.seen]


def test_the_body_comes_once_and_a_pose_with_every_instant() -> None:
    state, said = play([message for k in range(4) for message in instant(k)])
    kinds = [type(message) for message in said if not isinstance(message, m.ScenePoints)]
    assert kinds == [
        m.TrackerBdp,
        *[m.TrackerPose] * 4,
    ]
    body = decode(encode(said[0]), m.TrackerBdp).body
    np.testing.assert_array_equal(bdp_of(TEN_PARTS, body).sizes, BDP.sizes)
    assert frames(said) == [0, 1, 2, 3]
    assert tracker.describe(state) == "tracking"
    assert dict(tracker.counts(state)) == {}


def test_a_pose_says_all_that_the_core_found() -> None:
    pose = poses(play(instant(7))[1])[0]
    assert decode(encode(pose), m.TrackerPose) == pose
    assert (pose.frame, pose.captured_ns) == (7, 107 * FRAME_NS)
    assert pose.position == tuple(POSE.position)
    np.testing.assert_array_equal(angles_of(TEN_PARTS, pose.angles, TEN_PARTS.neutral), POSE.angles)
    np.testing.assert_array_equal([*pose.spread.values(), *pose.position_spread], SPREAD)
    assert list(pose.spread) == list(TEN_PARTS.angles)
    assert (pose.likelihood, pose.effective, pose.lost, pose.views) == (-0.5, 20.0, False, list(VIEWERS))


def test_nobody_seen_yet_is_no_pose_and_somebody_lost_is_the_last_one() -> None:
    _, said = play([*instant(0, mask=NOBODY), *instant(1), *instant(2, mask=NOBODY), *instant(3)])
    found = poses(said)
    assert [(pose.frame, pose.lost) for pose in found] == [(1, False), (2, True), (3, False)]
    assert found[1].position == found[0].position
    assert found[1].angles == found[0].angles
    assert (found[1].views, found[1].effective) == ([], 0.0)
    assert found[1].captured_ns == 102 * FRAME_NS


def test_views_are_given_in_the_rigs_order_whoever_came_first() -> None:
    forward, _ = play(instant(0))
    backward, _ = play(instant(0)[::-1])
    assert shown(forward) == shown(backward) == [VIEWERS]


def test_a_view_leaves_and_the_others_go_on_and_it_joins_again() -> None:
    two = VIEWERS[:2]
    gone = 3 + GONE_AFTER + 4
    before = [message for k in range(3) for message in instant(k)]
    without = [message for k in range(3, gone) for message in instant(k, two)]
    state, said = play([*before, *without])
    assert frames(said) == list(range(gone))
    assert tracker.describe(state) == "tracking, without viewer 3"
    state, more = play([message for k in range(gone, gone + 3) for message in instant(k)], state)
    assert frames(more) == list(range(gone, gone + 3))
    assert shown(state)[-1] == VIEWERS
    assert tracker.describe(state) == "tracking"
    # Nobody waits for who is gone: the first frame after coming back may be late.
    assert tracker.counts(state) == {"silhouette_unpaired": len(without) // 2 + 1, "silhouette_late": 1}


def test_a_late_view_holds_up_one_frame_and_no_more() -> None:
    _, said = play([*instant(0), *instant(1, VIEWERS[:2])])
    assert frames(said) == [0], "waiting for viewer 3"
    state, said = play([*instant(0), *instant(1, VIEWERS[:2]), *instant(2, VIEWERS[:1]), *instant(1, VIEWERS[2:])])
    assert frames(said) == [0, 1]
    assert shown(state) == [VIEWERS, VIEWERS[:2]]
    assert tracker.counts(state)["silhouette_late"] == 1


def test_one_view_alone_is_counted_and_no_pose() -> None:
    state, said = play([message for k in range(8) for message in instant(k, ("2",))])
    assert poses(said) == []
    assert tracker.counts(state)["alone"] >= 7
    assert tracker.describe(state) == "waiting for a second view; viewer 1 and 3 not there"


def test_a_tracker_that_cannot_keep_up_drops_the_oldest_instants() -> None:
    count = 10
    state, said = play([message for k in range(count) for message in instant(k)], busy=True)
    assert frames(said) == list(range(count - MOST_READY, count))
    assert tracker.counts(state) == {"dropped_instants": count - MOST_READY}


def test_damaged_silhouettes_and_other_sizes_leave_their_view_out() -> None:
    bad = silhouette("1", 0)
    bad = m.Silhouette(frame=0, captured_ns=bad.captured_ns, viewer="1", size=SIZE, region=bad.region, data=b"no zlib")
    large = silhouette("2", 1, np.zeros((240, 320), np.uint8))
    state, said = play([bad, *instant(0, ("2", "3")), large, *instant(1, ("1", "3"))])
    assert frames(said) == [0, 1]
    assert shown(state) == [("2", "3"), ("1", "3")]
    assert tracker.counts(state) == {"damaged": 2}
    state, said = play([bad, silhouette("2", 0, np.zeros((240, 320), np.uint8)), silhouette("3", 0)])
    assert said == []
    assert tracker.counts(state) == {"damaged": 2, "alone": 1}


def test_an_instant_that_fails_is_counted_said_and_left() -> None:
    state, said = play([*instant(0), *instant(1, mask=np.ones_like(PERSON)), *instant(2)][:6])
    assert frames(said) == [0]
    assert tracker.counts(state) == {"failed": 1}
    assert tracker.describe(state) == "tracking; an instant failed: a view that is all person"
    state, said = play(instant(2), state)
    assert frames(said) == [2]
    assert tracker.describe(state) == "tracking"


def test_views_that_disagree_are_in_the_health() -> None:
    messages = [silhouette("1", 0), silhouette("2", 0), silhouette("3", 0, NOBODY)]
    state, said = play(messages)
    assert poses(said)[0].views == ["1", "2"]
    assert tracker.describe(state) == "tracking; view 3 is empty"


def health(viewer: str, offset_ns: int) -> m.Health:
    return m.Health(
        frame=0, captured_ns=1, service="viewer", id=viewer, state="", rate=15.0, stages_ms={}, counts={},
        clock_offset_ns=offset_ns, clock_error_ns=1000,
    )  # fmt: skip


def test_clocks_of_other_machines_are_corrected_and_told() -> None:
    ahead = 3 * FRAME_NS
    messages = [silhouette("1", 0), silhouette("2", 0), silhouette("3", 0, offset_ns=ahead)]
    state, said = play([health("3", ahead), *messages])
    assert frames(said) == [0]
    assert poses(said)[0].captured_ns == 100 * FRAME_NS
    assert "viewer 3: its clock is 200.0 ms ahead of the integrator's" in tracker.describe(state)
    state, _ = play([health("3", 0), health("9", ahead), *instant(1)], state)
    assert "clock" not in tracker.describe(state)


def camera_message(viewer: str, focal: float = 1.0) -> m.CameraInfo:
    camera = SETUP.cameras[viewer]
    return m.CameraInfo(
        frame=0, captured_ns=1, viewer=viewer, name=camera.name, size=camera.size,
        matrix=(focal * camera.matrix).ravel().tolist(), distortions=[], rotation=camera.rotation.ravel().tolist(),
        translation=camera.translation.ravel().tolist(),
    )  # fmt: skip


def test_a_viewer_with_another_calibration_is_told() -> None:
    state, _ = play([*instant(0), *(camera_message(viewer) for viewer in VIEWERS)])
    assert tracker.describe(state) == "tracking"
    state, _ = play([camera_message("2", 1.01)], state)
    assert tracker.describe(state).startswith("tracking; viewer 2 has another calibration than this rig file")
    state, _ = play([camera_message("2")], state)
    assert tracker.describe(state) == "tracking"


def test_before_anything_came_it_says_so_and_other_events_are_nothing() -> None:
    state = tracker.initial_state(SETUP)
    assert tracker.describe(state) == "waiting for silhouettes"
    for event in (Tick(1), Alive("viewer", "1", True, 1), envelope(silhouette("9", 0))):
        after, said = tracker.step(SETUP, state, event)
        assert said == []
        assert not tracker.pending(after)


EVENTS = st.lists(st.tuples(st.sampled_from(["1", "2", "3", "tick"]), st.integers(0, 6)), max_size=40)


@given(EVENTS)
@settings(max_examples=100, deadline=None)
def test_whatever_comes_poses_are_in_the_order_of_time_and_of_two_views_or_more(events: list[tuple[str, int]]) -> None:
    state, said = tracker.initial_state(SETUP), []
    for viewer, frame in events:
        event = Tick(1) if viewer == "tick" else envelope(silhouette(viewer, frame))
        state, more = tracker.step(SETUP, state, event)
        said += more
        assert len(state.ready) <= MOST_READY
    times = [pose.captured_ns for pose in poses(said)]
    assert times == sorted(set(times))
    assert all(len(pose.views) >= 2 for pose in poses(said))


def test_the_same_events_give_the_same_bytes() -> None:
    messages = [message for k in range(5) for message in instant(k, VIEWERS[: 2 + k % 2])]
    first, second = ([encode(message) for message in play(messages)[1]] for _ in range(2))
    assert first == second


@given(EVENTS)
@settings(max_examples=100, deadline=None)
def test_a_tracker_that_keeps_up_drops_nothing_whatever_comes(events: list[tuple[str, int]]) -> None:
    """As offline: every instant is worked off before the next message."""
    messages: list[m.Message] = [silhouette(viewer, frame) for viewer, frame in events if viewer != "tick"]
    state, _ = play(messages)
    assert "dropped_instants" not in tracker.counts(state)


def test_scene_points_are_said_with_the_instant_but_no_more_than_ten_times_a_second() -> None:
    _, said = play([message for frame in range(7) for message in instant(frame)])
    clouds = [message for message in said if isinstance(message, m.ScenePoints)]
    assert [cloud.frame for cloud in clouds] == [0, 2, 4, 6]  # of 15 frames a second
    assert all(later.captured_ns - one.captured_ns >= tracker.POINTS_NS for one, later in pairwise(clouds))
    np.testing.assert_allclose(points_of(clouds[0]), POINTS, atol=0.0005)
