"""The backward pass repeats what the forward pass has tracked, and finds what that had lost."""

import numpy as np
import pytest

from tests.support.tracker_ring import FRAME_NS, rendered_masks, ring, setup, t_pose_at
from zenocap.common.body.definition import Pose
from zenocap.services.tracker.both_ways.backward import begin, evidence_in, step_back, with_fixed_body
from zenocap.services.tracker.both_ways.passes import ForwardPose, two_passes
from zenocap.services.tracker.filter.confidence import LIMBS
from zenocap.services.tracker.parameters import LOST_LIMB
from zenocap.services.tracker.tracking import initial_state, track

pytestmark = pytest.mark.slow
SEED, COUNT = 3, 24


@pytest.fixture(scope="module")
def forward() -> tuple:
    """Set-up, body, masks and poses of a person in the T-pose who glides along Z by 1 cm a frame."""
    made = setup(ring(3))
    state, body, poses = initial_state(made), None, []
    films = [rendered_masks(made.cameras, SEED, t_pose_at(SEED, z=0.01 * max(0, k - 8))) for k in range(COUNT)]
    for k, masks in enumerate(films):
        state, outcome = track(made, state, k * FRAME_NS, masks)
        body = body if outcome.body is None else outcome.body
        poses.append(outcome.pose)
    return made, body, films, poses


@pytest.mark.nightly
def test_the_backward_pass_is_near_the_forward_pass(forward: tuple) -> None:
    made, body, films, poses = forward
    first = next(k for k, pose in enumerate(poses) if pose is not None)
    assert first < 8
    fixed = with_fixed_body(made)
    state = begin(fixed, body, poses[-1], (COUNT - 1) * FRAME_NS, evidence_in(fixed, films[-1]))
    for k in range(COUNT - 2, first - 1, -1):
        state, found = step_back(fixed, state, k * FRAME_NS, evidence_in(fixed, films[k]))
        assert np.linalg.norm(found.position - poses[k].position) < 0.03
        limbs, heading = state.confidence
        assert min(*(limbs[name] for name in LIMBS), heading) > LOST_LIMB


@pytest.mark.nightly
def test_equal_input_gives_equal_poses_and_lost_frames_are_filled(forward: tuple) -> None:
    made, body, films, poses = forward
    first = next(k for k, pose in enumerate(poses) if pose is not None)
    gone = range(12, 16)
    views = tuple(made.cameras)
    known: list[ForwardPose] = []
    for k in range(first, COUNT):
        pose: Pose = known[-1].pose if k in gone else poses[k]
        known.append(ForwardPose(k * FRAME_NS, pose, k in gone, views))

    def run() -> dict:
        return dict(two_passes(made, body, known, ((one, films[one.captured_ns // FRAME_NS]) for one in reversed(known))))

    found, again = run(), run()
    assert list(found) == [one.captured_ns for one in known]
    for k in range(first, COUNT):
        one = found[k * FRAME_NS]
        assert not one.lost
        assert np.linalg.norm(one.pose.position - poses[k].position) < 0.03
        np.testing.assert_array_equal(one.pose.angles, again[k * FRAME_NS].pose.angles)
        if k in gone:
            np.testing.assert_array_equal(one.shares, 1.0)
            assert min(one.confidence.limbs.values()) > LOST_LIMB
