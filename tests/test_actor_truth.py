"""The truth in the tracker's words is the truth of the picture."""

import numpy as np
import pytest

from common.actor.person import person
from common.actor.postures import POSTURES
from common.actor.script import demo_script, posture_take
from common.actor.truth import true_bdp, true_sizes, truth
from common.body.anatomy import TEN_PARTS
from common.body.kinematics import joint_centres, part_frames

PARTS = tuple(f"{side}_{segment}" for side in ("right", "left") for segment in ("upper_arm", "lower_arm"))
PARTS += tuple(f"{side}_{segment}" for side in ("right", "left") for segment in ("upper_leg", "lower_leg"))


@pytest.mark.parametrize("name", POSTURES)
@pytest.mark.parametrize("seed", [13])
def test_ten_part_angles_reproduce_segment_directions(name: str, seed: int) -> None:
    someone = person(seed)
    script, bdp = posture_take(someone, name, seed), true_bdp(someone)
    for t in np.arange(1.0, script.duration_s, 0.17):
        pose = script.pose_at(float(t))
        assert pose is not None
        told = truth(someone, pose)
        frames = part_frames(TEN_PARTS, bdp, told.ten_part_pose())
        assert set(told.directions) == set(PARTS)
        for part in PARTS:
            assert np.allclose(frames[TEN_PARTS.index[part], :, 1], told.directions[part], atol=1e-6), (t, part)
        torso = told.joints["Neck"] - told.joints["Hip"]
        assert np.allclose(frames[0, :, 1], torso / np.linalg.norm(torso), atol=1e-6)
        facing = frames[0, :, 2]
        assert np.arctan2(facing[0], facing[2]) == pytest.approx(told.yaw, abs=1e-6)


@pytest.mark.parametrize("name", POSTURES)
def test_ten_part_angles_keep_the_anatomy_s_limits(name: str) -> None:
    script = posture_take(person(4), name, 2)
    slack = np.radians(20.0)
    for t in np.arange(1.0, script.duration_s, 0.11):
        pose = script.pose_at(float(t))
        assert pose is not None
        angles = truth(script.person, pose).ten_part_pose().angles
        within = (angles > TEN_PARTS.limits[:, 0] - slack) & (angles < TEN_PARTS.limits[:, 1] + slack)
        outside = [name for name, good in zip(TEN_PARTS.angles, within, strict=True) if not good]
        assert not outside, (t, outside)


@pytest.mark.parametrize("name", POSTURES)
def test_ten_part_angles_have_no_sudden_turns_but_where_two_axes_meet(name: str) -> None:
    script = posture_take(person(4), name, 2)
    told = []
    for t in np.arange(1.0, script.duration_s, 1 / 40):
        pose = script.pose_at(float(t))
        assert pose is not None
        told.append(truth(script.person, pose).ten_part_pose().angles)
    turned = np.abs(np.diff(np.array(told), axis=0))
    for joint in ("right_shoulder", "left_shoulder", "right_hip", "left_hip"):
        apart = np.abs(np.cos(np.array(told)[1:, TEN_PARTS.index[f"{joint}.x"]])) > 0.4
        for axis in "zy":
            turned[:, TEN_PARTS.index[f"{joint}.{axis}"]] *= apart
    assert turned.max() < np.radians(30.0)


@pytest.mark.parametrize("seed", range(0, 40, 5))
def test_the_ten_part_figure_stands_close_to_the_actor(seed: int) -> None:
    someone = person(seed)
    pose = demo_script(someone, 0).pose_at(4.0)
    assert pose is not None
    told = truth(someone, pose)
    centres = joint_centres(TEN_PARTS, true_bdp(someone), told.ten_part_pose())
    for marker, centre in zip(TEN_PARTS.markers, centres, strict=True):
        assert np.linalg.norm(centre - told.joints[marker.name]) < 0.05, marker.name


def test_joints_are_the_fifteen_of_the_export_in_its_order() -> None:
    pose = demo_script(person(0), 0).pose_at(4.0)
    assert pose is not None
    assert list(truth(person(0), pose).joints) == [m.name for m in TEN_PARTS.markers]


def test_yaw_follows_the_walk_round_the_circle() -> None:
    someone = person(2)
    script = demo_script(someone, 0)
    walking = next(s for s in script.segments if s.name == "walking")
    yaws, headings = [], []
    for t in np.arange(walking.start_s + 1.0, walking.end_s - 1.0, 0.05):
        poses = script.pose_at(float(t) - 0.3), script.pose_at(float(t)), script.pose_at(float(t) + 0.3)
        hips = [truth(someone, p).joints["Hip"] for p in poses if p is not None]
        yaws.append(truth(someone, poses[1]).yaw if poses[1] is not None else np.nan)
        headings.append(np.arctan2(*(hips[2] - hips[0])[[0, 2]]))
    apart = np.angle(np.exp(1j * (np.array(yaws) - np.array(headings))))
    assert np.abs(apart).max() < np.radians(20.0)


@pytest.mark.parametrize("seed", range(0, 40, 5))
def test_sizes_are_those_of_a_body(seed: int) -> None:
    someone = person(seed)
    sizes = true_sizes(someone)
    assert sizes.lower_leg + sizes.upper_leg + sizes.torso + sizes.head == pytest.approx(someone.height)
    assert 0.02 < sizes.radii["lower_arm"] < sizes.radii["upper_arm"] < sizes.radii["upper_leg"] < 0.13
    assert sizes.torso_half_depth < sizes.torso_half_width < 0.25
    bdp = true_bdp(someone)
    assert bdp.sizes.shape == (10, 3)
    assert bdp.sizes.min() > 0.02
    assert np.array_equal(bdp.offsets[0], np.zeros(3))
