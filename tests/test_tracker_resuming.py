"""A tracker that was restarted finds the person by the body and the pose that were said before, and says them again."""

import numpy as np
import pytest
from tracker_ring import FRAME_NS, initial, ring, seen, setup, someone
from two_view_run import envelope

from common import messages as m
from common.actor.script import motion_script
from common.actor.truth import truth
from common.bus.protocol import Tick
from common.codec import decode, encode
from common.vision.packing import pack
from services.tracker import step as tracker
from services.tracker.states import State
from services.tracker.step import knows_nobody

CAMERAS = ring(4)
SETUP = setup(CAMERAS)
SEED = 3
WALKING = motion_script(someone(SEED), "walking", 0)
BEFORE = [initial(SEED)] * 5
AFTER = [WALKING.pose_at(WALKING.motion_from_s + k / 30) for k in range(3)]


def play(state: State, poses: list[object], start: int) -> tuple[State, list[m.Message]]:
    said: list[m.Message] = []
    for frame, pose in enumerate(poses, start):
        for viewer, mask in seen(CAMERAS, SEED, pose).items():  # type: ignore[arg-type]
            region, data = pack(mask)
            silhouette = m.Silhouette(
                frame=frame, captured_ns=frame * FRAME_NS, viewer=viewer, size=(mask.shape[1], mask.shape[0]),
                region=region, data=data,
            )  # fmt: skip
            state, more = tracker.step(SETUP, state, envelope(silhouette))
            said += more
        while tracker.pending(state):
            state, more = tracker.step(SETUP, state, Tick(0))
            said += more
    return state, said


def hear(state: State, *messages: m.Message) -> tuple[State, list[m.Message]]:
    said: list[m.Message] = []
    for message in messages:
        state, more = tracker.step(SETUP, state, envelope(message))
        said += more
    return state, said


@pytest.fixture(scope="module")
def before() -> tuple[m.TrackerBdp, m.TrackerPose]:
    """What a tracker said last of somebody in the initial posture."""
    _, said = play(tracker.initial_state(SETUP), list(BEFORE), 1)
    body = next(message for message in said if isinstance(message, m.TrackerBdp))
    pose = [message for message in said if isinstance(message, m.TrackerPose)][-1]
    return decode(encode(body), m.TrackerBdp), decode(encode(pose), m.TrackerPose)


def test_it_says_again_what_was_said_and_finds_who_walks_without_an_initial_posture(
    before: tuple[m.TrackerBdp, m.TrackerPose],
) -> None:
    state, said = hear(tracker.initial_state(SETUP), *before)
    assert said == list(before)
    assert tracker.describe(state) == "waiting for silhouettes"
    assert not knows_nobody(state)
    state, said = play(state, list(AFTER), 10)
    assert tracker.describe(state) == "tracking"
    found = [message for message in said if isinstance(message, m.TrackerPose)][-1]
    assert not found.lost
    pose = AFTER[-1]
    assert pose is not None
    assert np.linalg.norm(np.array(found.position) - truth(someone(SEED), pose).joints["Hip"]) < 0.08


def test_without_it_the_same_scenes_are_nobody_yet() -> None:
    state, said = play(tracker.initial_state(SETUP), list(AFTER), 10)
    assert {type(message) for message in said} <= {m.ScenePoints}
    assert knows_nobody(state)


def test_a_pose_alone_another_anatomy_or_a_wish_to_measure_anew_are_nothing_to_go_on(
    before: tuple[m.TrackerBdp, m.TrackerPose],
) -> None:
    body, pose = before
    other = m.TrackerBdp(frame=0, captured_ns=0, body=m.Body(anatomy="another", sizes={}, offsets={}))
    state, said = hear(tracker.initial_state(SETUP), pose, other, pose)
    assert said == []
    assert knows_nobody(state)
    asked, _ = hear(state, m.Request(frame=0, captured_ns=0, what="measure"))
    after, said = hear(asked, body, pose)
    assert said == []
    assert not knows_nobody(after)
    assert tracker.describe(after) == "waiting for silhouettes"
