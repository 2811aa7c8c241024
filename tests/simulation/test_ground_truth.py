"""Ground truth in the tracker's anatomy against the simulated skeleton."""

from collections.abc import Iterator

import numpy as np
import pytest

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.kinematics import joint_centres, part_frames
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import Truth, true_bdp, true_sizes, truth
from zenocap.simulation.motion.postures import POSTURES
from zenocap.simulation.motion.timeline import MotionTimeline, demo_timeline, posture_timeline

PARTS = tuple(f"{side}_{segment}" for side in ("right", "left") for segment in ("upper_arm", "lower_arm"))
PARTS += tuple(f"{side}_{segment}" for side in ("right", "left") for segment in ("upper_leg", "lower_leg"))


def truths(script: MotionTimeline, step_s: float) -> Iterator[tuple[float, Truth]]:
    """From the T-pose on, with their times."""
    for t in np.arange(1.0, script.duration_s, step_s):
        yield t, truth(script.person, script.pose_at(float(t)))


@pytest.mark.parametrize("name", POSTURES)
def test_ten_part_angles_reproduce_segment_directions(name: str) -> None:
    subject = person(13)
    script, bdp = posture_timeline(subject, name, 13), true_bdp(subject)
    for t, true_pose in truths(script, 0.17):
        frames = part_frames(TEN_PARTS, bdp, true_pose.ten_part_pose())
        assert set(true_pose.directions) == set(PARTS)
        for part in PARTS:
            assert np.allclose(frames[TEN_PARTS.index[part], :, 1], true_pose.directions[part], atol=1e-6), (t, part)
        torso = true_pose.joints["Neck"] - true_pose.joints["Hip"]
        assert np.allclose(frames[0, :, 1], torso / np.linalg.norm(torso), atol=1e-6)
        facing = frames[0, :, 2]
        assert np.arctan2(facing[0], facing[2]) == pytest.approx(true_pose.yaw, abs=1e-6)


@pytest.mark.parametrize("name", POSTURES)
def test_ten_part_angles_stay_within_the_anatomy_limits_except_near_gimbal_lock(name: str) -> None:
    script = posture_timeline(person(4), name, 2)
    slack = np.radians(20.0)
    for t, true_pose in truths(script, 0.11):
        angles = true_pose.ten_part_pose().angles
        within = (angles > TEN_PARTS.limits[:, 0] - slack) & (angles < TEN_PARTS.limits[:, 1] + slack)
        outside = {name.rpartition(".")[0] for name, good in zip(TEN_PARTS.angles, within, strict=True) if not good}
        locked = {
            joint for joint in outside
            if f"{joint}.z" in TEN_PARTS.index and abs(np.cos(angles[TEN_PARTS.index[f"{joint}.x"]])) < 0.4
        }  # fmt: skip
        assert outside == locked, t


@pytest.mark.slow
@pytest.mark.parametrize("name", POSTURES)
def test_ten_part_angles_are_continuous_except_near_gimbal_lock(name: str) -> None:
    script = posture_timeline(person(4), name, 2)
    angles = np.array([true_pose.ten_part_pose().angles for _, true_pose in truths(script, 1 / 40)])
    turned = np.abs(np.diff(angles, axis=0))
    for joint in ("right_shoulder", "left_shoulder", "right_hip", "left_hip"):
        well_separated = np.abs(np.cos(angles[1:, TEN_PARTS.index[f"{joint}.x"]])) > 0.4
        for axis in "zy":
            turned[:, TEN_PARTS.index[f"{joint}.{axis}"]] *= well_separated
    assert turned.max() < np.radians(30.0)


@pytest.mark.parametrize("seed", range(0, 40, 5))
def test_ten_part_joint_centres_are_close_to_the_true_joints(seed: int) -> None:
    subject = person(seed)
    true_pose = truth(subject, demo_timeline(subject, 0).pose_at(4.0))
    centres = joint_centres(TEN_PARTS, true_bdp(subject), true_pose.ten_part_pose())
    for marker, centre in zip(TEN_PARTS.markers, centres, strict=True):
        assert np.linalg.norm(centre - true_pose.joints[marker.name]) < 0.05, marker.name


def test_joints_have_the_names_and_order_of_the_export() -> None:
    pose = demo_timeline(person(0), 0).pose_at(4.0)
    assert list(truth(person(0), pose).joints) == [m.name for m in TEN_PARTS.markers]


@pytest.mark.slow
def test_yaw_follows_the_walk_round_the_circle() -> None:
    subject = person(2)
    script = demo_timeline(subject, 0)
    walking = next(s for s in script.segments if s.name == "walking")
    for t in np.arange(walking.start_s + 1.0, walking.end_s - 1.0, 0.05):
        before, now, after = (truth(subject, script.pose_at(float(t) + late_s)) for late_s in (-0.3, 0.0, 0.3))
        heading = np.arctan2(*(after.joints["Hip"] - before.joints["Hip"])[[0, 2]])
        assert np.cos(now.yaw - heading) > np.cos(np.radians(20.0))


@pytest.mark.parametrize("seed", range(0, 40, 5))
def test_body_sizes_are_plausible(seed: int) -> None:
    subject = person(seed)
    sizes = true_sizes(subject)
    assert sizes.lower_leg + sizes.upper_leg + sizes.torso + sizes.head == pytest.approx(subject.height)
    assert 0.02 < sizes.radii["lower_arm"] < sizes.radii["upper_arm"] < sizes.radii["upper_leg"] < 0.13
    assert sizes.torso_half_depth < sizes.torso_half_width < 0.25
    bdp = true_bdp(subject)
    assert bdp.sizes.shape == (10, 3)
    assert bdp.sizes.min() > 0.02
    assert np.array_equal(bdp.offsets[0], np.zeros(3))
