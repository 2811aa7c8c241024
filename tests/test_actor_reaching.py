"""An arm that reaches: the wrist comes where it should, as far as the arm is long, and the elbow where it may."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.actor.person import person
from common.actor.pose import OUTWARD, neutral
from common.actor.reaching import Reach, in_chest, reaching
from common.actor.skeleton import pose_bones
from common.actor.truth import landmarks


@given(
    seed=st.integers(0, 30),
    side=st.sampled_from([0, 1]),
    azimuth=st.floats(-0.5, 1.6),
    height=st.floats(-1.2, 1.2),
    far=st.floats(0.5, 0.95),
)
@settings(deadline=None, max_examples=60)
def test_the_wrist_comes_where_it_should(seed: int, side: int, azimuth: float, height: float, far: float) -> None:
    someone, out = person(seed), OUTWARD[side]
    arm = someone.lengths.upper_arm + someone.lengths.forearm
    way = np.array([out * np.sin(azimuth) * np.cos(height), np.sin(height), np.cos(azimuth) * np.cos(height)])
    goal = np.array([out * someone.lengths.shoulder_half, 0.0, 0.0]) + far * arm * way
    pose = reaching(someone, neutral(someone), side, Reach(goal, np.array([out, -1.0, -0.5])))
    wrist = landmarks(someone, pose)[f"{'RL'[side]}Wrist"]
    assert np.linalg.norm(in_chest(pose_bones(someone, pose), wrist) - goal) < 0.03


@pytest.mark.parametrize("side", [0, 1])
def test_the_elbow_points_where_it_should_and_the_other_arm_stays(side: int) -> None:
    someone, out = person(3), OUTWARD[side]
    before = neutral(someone)
    for elbow in ([0.0, -1.0, 0.0], [out, 0.0, 0.0]):
        pose = reaching(someone, before, side, Reach(np.array([out * 0.15, 0.0, 0.35]), np.array(elbow)))
        joints = landmarks(someone, pose)
        bones = pose_bones(someone, pose)
        shoulder, mid, wrist = (in_chest(bones, joints[f"{'RL'[side]}{n}"]) for n in ("Shoulder", "Elbow", "Wrist"))
        off = mid - 0.5 * (shoulder + wrist)
        assert off @ elbow > 0.1
        np.testing.assert_array_equal(pose.arms[1 - side], before.arms[1 - side])


def test_what_is_out_of_reach_is_reached_for() -> None:
    someone = person(3)
    pose = reaching(someone, neutral(someone), 0, Reach(np.array([-0.2, 0.0, 3.0]), np.array([0.0, -1.0, 0.0])))
    joints = landmarks(someone, pose)
    stretched = np.linalg.norm(joints["RWrist"] - joints["RShoulder"])
    assert stretched > 0.97 * (someone.lengths.upper_arm + someone.lengths.forearm)
