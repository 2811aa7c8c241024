"""A restarted tracker finds the person by the body and pose published before."""

import numpy as np
import pytest

from tests.support.tracker_ring import FRAME_NS, rendered_masks, ring, setup, simulated_person, t_pose_at
from tests.support.two_view_run import envelope
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Tick
from zenocap.common.codec import decode, encode
from zenocap.common.vision.mask_codec import pack
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.states import State
from zenocap.services.tracker.step import awaiting_person
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import motion_timeline

CAMERAS = ring(4)
SETUP = setup(CAMERAS)
SEED = 3
WALKING = motion_timeline(simulated_person(SEED), "walking", 0)
BEFORE = [t_pose_at(SEED)] * 5
AFTER = [WALKING.pose_at(WALKING.motion_from_s + k / 30) for k in range(3)]


def play(state: State, poses: list[object], start: int) -> tuple[State, list[m.Message]]:
    published: list[m.Message] = []
    for frame, pose in enumerate(poses, start):
        for viewer, mask in rendered_masks(CAMERAS, SEED, pose).items():  # type: ignore[arg-type]
            region, data = pack(mask)
            silhouette = m.Silhouette(
                frame=frame, captured_ns=frame * FRAME_NS, viewer=viewer, size=(mask.shape[1], mask.shape[0]),
                region=region, data=data,
            )  # fmt: skip
            state, more = tracker.step(SETUP, state, envelope(silhouette))
            published += more
        while tracker.pending(state):
            state, more = tracker.step(SETUP, state, Tick(0))
            published += more
    return state, published


def receive(state: State, *messages: m.Message) -> tuple[State, list[m.Message]]:
    published: list[m.Message] = []
    for message in messages:
        state, more = tracker.step(SETUP, state, envelope(message))
        published += more
    return state, published


@pytest.fixture(scope="module")
def before() -> tuple[m.TrackerBdp, m.TrackerPose]:
    """Last body and pose of a tracker, of a person in T-pose."""
    _, published = play(tracker.initial_state(SETUP), list(BEFORE), 1)
    body = next(message for message in published if isinstance(message, m.TrackerBdp))
    pose = [message for message in published if isinstance(message, m.TrackerPose)][-1]
    return decode(encode(body), m.TrackerBdp), decode(encode(pose), m.TrackerPose)


@pytest.mark.nightly
def test_restart_republishes_and_finds_a_walking_person(before: tuple[m.TrackerBdp, m.TrackerPose]) -> None:
    state, published = receive(tracker.initial_state(SETUP), *before)
    assert published == list(before)
    assert tracker.describe(state) == "waiting for silhouettes"
    assert not awaiting_person(state)
    state, published = play(state, list(AFTER), 10)
    assert tracker.describe(state) == "tracking"
    found = [message for message in published if isinstance(message, m.TrackerPose)][-1]
    assert not found.lost
    pose = AFTER[-1]
    assert pose is not None
    assert np.linalg.norm(np.array(found.position) - truth(simulated_person(SEED), pose).joints["Hip"]) < 0.08


def test_without_recovered_state_the_person_is_awaited() -> None:
    state, published = play(tracker.initial_state(SETUP), list(AFTER), 10)
    assert {type(message) for message in published} <= {m.ScenePoints}
    assert awaiting_person(state)


@pytest.mark.slow
def test_incomplete_foreign_or_discarded_state_is_not_used(before: tuple[m.TrackerBdp, m.TrackerPose]) -> None:
    body, pose = before
    other = m.TrackerBdp(frame=0, captured_ns=0, body=m.Body(anatomy="another", sizes={}, offsets={}))
    state, published = receive(tracker.initial_state(SETUP), pose, other, pose)
    assert published == []
    assert awaiting_person(state)
    requested, _ = receive(state, m.Request(frame=0, captured_ns=0, what="measure"))
    after, published = receive(requested, body, pose)
    assert published == []
    assert not awaiting_person(after)
    assert tracker.describe(after) == "waiting for silhouettes"
