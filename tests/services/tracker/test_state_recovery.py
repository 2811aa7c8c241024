"""A restarted tracker finds the person by the body and pose published before."""

import pytest
from msgspec import structs

from tests.support.built_messages import silhouette
from tests.support.tracker_ring import FRAME_NS, hip_error, in_motion, rendered_masks, ring, setup, t_pose_at
from tests.support.tracker_steps import pass_to, track_each
from zenocap.common import messages as m
from zenocap.common.codec import decode, encode
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.states import TrackerState
from zenocap.services.tracker.step import awaiting_person
from zenocap.simulation.body.pose import PersonPose

SETUP = setup(ring(4))
SEED = 3
AFTER = in_motion(SEED, 3)


def play(state: TrackerState | None, poses: list[PersonPose], start: int) -> tuple[TrackerState, list[m.Message]]:
    masks = [(frame, rendered_masks(SETUP.cameras, SEED, pose)) for frame, pose in enumerate(poses, start)]
    silhouettes = (
        silhouette(viewer, frame, frame * FRAME_NS, mask) for frame, views in masks for viewer, mask in views.items()
    )
    return track_each(SETUP, state, silhouettes)


@pytest.fixture(scope="module")
def before() -> tuple[m.TrackerBdp, m.TrackerPose]:
    """Last body and pose of a tracker, of a person in T-pose."""
    _, published = play(None, [t_pose_at(SEED)] * 5, 1)
    body = next(message for message in published if isinstance(message, m.TrackerBdp))
    pose = [message for message in published if isinstance(message, m.TrackerPose)][-1]
    return decode(encode(body), m.TrackerBdp), decode(encode(pose), m.TrackerPose)


@pytest.mark.nightly
def test_restart_republishes_and_finds_a_walking_person(before: tuple[m.TrackerBdp, m.TrackerPose]) -> None:
    state, published = pass_to(SETUP, None, before)
    assert published == list(before)
    assert tracker.describe(state) == "waiting for silhouettes"
    assert not awaiting_person(state)
    state, published = play(state, AFTER, 10)
    assert tracker.describe(state) == "tracking"
    found = [message for message in published if isinstance(message, m.TrackerPose)][-1]
    assert not found.lost
    assert hip_error(SEED, found.position, AFTER[-1]) < 0.08


def test_without_recovered_state_the_person_is_awaited() -> None:
    state, published = play(None, AFTER, 10)
    assert {type(message) for message in published} <= {m.ScenePoints}
    assert awaiting_person(state)


@pytest.mark.slow
def test_incomplete_foreign_or_discarded_state_is_not_used(before: tuple[m.TrackerBdp, m.TrackerPose]) -> None:
    _, pose = before
    other = m.TrackerBdp(frame=0, captured_ns=0, body=m.Body(anatomy="another", sizes={}, offsets={}))
    state, published = pass_to(SETUP, None, [pose, other, pose])
    assert published == []
    assert awaiting_person(state)
    requested, _ = pass_to(SETUP, state, [m.Request(frame=0, captured_ns=0, what="measure")])
    after, published = pass_to(SETUP, requested, before)
    assert published == []
    assert not awaiting_person(after)
    assert tracker.describe(after) == "waiting for silhouettes"


@pytest.mark.slow
def test_a_body_that_is_not_the_published_one_is_contradicted_with_the_next_frame_set(
    before: tuple[m.TrackerBdp, m.TrackerPose],
) -> None:
    """Pages and viewers used that of another program until the end."""
    body, _ = before
    state, _ = pass_to(SETUP, None, before)
    small = structs.replace(body.body, sizes=dict.fromkeys(body.body.sizes, (0.1, 0.1, 0.1)))
    state, published = pass_to(SETUP, state, [structs.replace(body, captured_ns=2**62, body=small)] * 20)
    assert published == []
    state, published = play(state, AFTER[:2], 10)
    assert [message for message in published if isinstance(message, m.TrackerBdp)] == [body]
    state, published = pass_to(SETUP, state, [body])  # its own, which it receives too
    assert (state.contradicted, published) == (False, [])


@pytest.mark.slow
def test_a_false_body_before_the_own_measurement_lasts_until_the_next_t_pose(
    before: tuple[m.TrackerBdp, m.TrackerPose],
) -> None:
    """It was taken for that of the tracker before a restart, and the person was never found with it."""
    body, pose = before
    small = structs.replace(body.body, sizes=dict.fromkeys(body.body.sizes, (0.1, 0.1, 0.1)))
    false = structs.replace(body, body=small)
    state, published = pass_to(SETUP, None, [false, pose])
    assert published == [false, pose]
    state, published = play(state, [t_pose_at(SEED)] * 6, 10)
    measured = next(message for message in published if isinstance(message, m.TrackerBdp))
    assert measured.measured
    leg, true_leg = (one.body.sizes["right_lower_leg"][0] for one in (measured, body))
    assert leg == pytest.approx(true_leg, abs=0.03)  # metres
    last = [message for message in published if isinstance(message, m.TrackerPose)][-1]
    assert not last.lost
    assert hip_error(SEED, last.position, t_pose_at(SEED)) < 0.08
    assert tracker.describe(state) == "tracking"
