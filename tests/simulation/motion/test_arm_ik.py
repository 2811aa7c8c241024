"""Two-bone inverse kinematics of an arm: wrist at the target, elbow direction."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import OUTWARD, neutral
from zenocap.simulation.body.skeleton import pose_bones
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.arm_ik import ArmGoal, in_chest, reach_goal


@pytest.mark.slow
@given(
    seed=st.integers(0, 30),
    side=st.sampled_from([0, 1]),
    azimuth=st.floats(-0.5, 1.6),
    height=st.floats(-1.2, 1.2),
    reach=st.floats(0.5, 0.95),
)
@settings(max_examples=60)
def test_wrist_reaches_the_goal(seed: int, side: int, azimuth: float, height: float, reach: float) -> None:
    subject, outward = person(seed), OUTWARD[side]
    arm = subject.lengths.upper_arm + subject.lengths.forearm
    direction = np.array([outward * np.sin(azimuth) * np.cos(height), np.sin(height), np.cos(azimuth) * np.cos(height)])
    goal = np.array([outward * subject.lengths.shoulder_half, 0.0, 0.0]) + reach * arm * direction
    pose = reach_goal(subject, neutral(subject), side, ArmGoal(goal, np.array([outward, -1.0, -0.5])))
    wrist = landmarks(subject, pose)[f"{'RL'[side]}Wrist"]
    assert np.linalg.norm(in_chest(pose_bones(subject, pose), wrist) - goal) < 0.03


@pytest.mark.parametrize("side", [0, 1])
def test_elbow_points_in_the_given_direction_and_the_other_arm_is_unchanged(side: int) -> None:
    subject, outward = person(3), OUTWARD[side]
    before = neutral(subject)
    for elbow in ([0.0, -1.0, 0.0], [outward, 0.0, 0.0]):
        pose = reach_goal(subject, before, side, ArmGoal(np.array([outward * 0.15, 0.0, 0.35]), np.array(elbow)))
        joints = landmarks(subject, pose)
        bones = pose_bones(subject, pose)
        shoulder, elbow_position, wrist = (
            in_chest(bones, joints[f"{'RL'[side]}{n}"]) for n in ("Shoulder", "Elbow", "Wrist")
        )
        offset = elbow_position - 0.5 * (shoulder + wrist)
        assert offset @ elbow > 0.1
        np.testing.assert_array_equal(pose.arms[1 - side], before.arms[1 - side])


def test_arm_is_stretched_towards_a_goal_out_of_reach() -> None:
    subject = person(3)
    pose = reach_goal(subject, neutral(subject), 0, ArmGoal(np.array([-0.2, 0.0, 3.0]), np.array([0.0, -1.0, 0.0])))
    joints = landmarks(subject, pose)
    stretched = np.linalg.norm(joints["RWrist"] - joints["RShoulder"])
    assert stretched > 0.97 * (subject.lengths.upper_arm + subject.lengths.forearm)
