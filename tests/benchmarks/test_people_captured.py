"""Simulated people with motion capture: their own lengths, the file's directions, feet on the floor."""

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.harness.case import SHARED
from benchmarks.people.captured import CapturedTake, captured_take
from zenocap.common.formats.bvh_joint_names import read_bvh_centres
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import neutral
from zenocap.simulation.body.rotation import ry
from zenocap.simulation.body.skeleton import CHEST, FOOT, FOREARM, PELVIS, SHANK, THIGH, UPPER_ARM, Bones
from zenocap.simulation.ground_truth import truth

FILE = SHARED / "motions" / "cmu_07_01.bvh"
FPS = 30.0
SUBJECT = person(3)

pytestmark = pytest.mark.skipif(not FILE.is_file(), reason=f"{FILE} missing")


@pytest.fixture(scope="module")
def take() -> CapturedTake:
    return captured_take(SUBJECT, FILE, FPS)


def motion(take: CapturedTake) -> list[Bones]:
    found = [pose for pose in take.poses[take.motion_from :] if pose is not None]
    assert len(found) == len(take.poses) - take.motion_from > 50
    return found


def test_bones_have_the_lengths_of_the_person(take: CapturedTake) -> None:
    size = SUBJECT.lengths
    for pose in motion(take)[::20]:
        for side in (0, 1):
            for start, end, length in (
                (UPPER_ARM[side], FOREARM[side], size.upper_arm),
                (THIGH[side], SHANK[side], size.thigh),
                (SHANK[side], FOOT[side], size.shank),
            ):
                assert np.linalg.norm(pose.origin[end] - pose.origin[start]) == pytest.approx(length)
        np.testing.assert_allclose(
            pose.rotation @ pose.rotation.transpose(0, 2, 1), np.tile(np.eye(3), (13, 1, 1)), atol=1e-6
        )


def test_limb_directions_are_those_of_the_file(take: CapturedTake) -> None:
    centres = read_bvh_centres(FILE)
    names = centres.names
    heading = None
    for k, pose in list(enumerate(motion(take)))[::20]:
        frame = round((0.05 + k / FPS) * centres.rate)
        found = truth(SUBJECT, pose).joints
        for upper, lower in (("LKnee", "LAnkle"), ("RHip", "RKnee"), ("RElbow", "RWrist"), ("LShoulder", "LElbow")):
            expected = centres.points[frame, names.index(lower)] - centres.points[frame, names.index(upper)]
            own = found[lower] - found[upper]
            assert own[1] / np.linalg.norm(own) == pytest.approx(expected[1] / np.linalg.norm(expected), abs=0.02)
            turn = np.arctan2(*own[[0, 2]]) - np.arctan2(*expected[[0, 2]])
            if np.hypot(*own[[0, 2]]) > 0.15:
                heading = turn if heading is None else heading
                assert np.cos(turn - heading) > 0.99


def test_feet_stand_on_the_floor_and_the_person_faces_the_first_camera_at_the_start(take: CapturedTake) -> None:
    ankles = np.array([pose.origin[list(FOOT), 1].min() for pose in motion(take)])
    assert np.all(np.abs(ankles - SUBJECT.lengths.ankle_height) < 0.06)
    first = motion(take)[0]
    standing = min(FOOT, key=lambda foot: first.origin[foot, 1])
    assert first.rotation[standing, 1, 1] > 0.95
    assert first.rotation[standing, 2, 2] > 0.9
    assert first.rotation[PELVIS, 2, 2] > 0.95
    assert first.rotation[CHEST, 2, 2] > 0.8


def test_opening_is_an_empty_scene_then_a_t_pose_where_the_motion_starts(take: CapturedTake) -> None:
    assert all(pose is None for pose in take.poses[: int(FPS)])
    stretched, start = take.poses[int(1.5 * FPS)], motion(take)[0]
    assert stretched is not None
    joints = truth(SUBJECT, stretched).joints
    assert abs(joints["LWrist"][1] - joints["LShoulder"][1]) < 0.1
    np.testing.assert_allclose(stretched.origin[PELVIS, [0, 2]], start.origin[PELVIS, [0, 2]], atol=0.02)


def test_transition_has_no_jump(take: CapturedTake) -> None:
    known = [pose for pose in take.poses if pose is not None]
    moved = [float(np.abs(b.origin - a.origin).max()) for a, b in pairwise(known)]
    assert max(moved) < 0.2


def test_a_heading_turns_the_opening_and_the_motion() -> None:
    ahead, turned = (
        captured_take(SUBJECT, FILE, FPS, longest_s=0.5, opening=(None, neutral(SUBJECT)), heading=angle).poses
        for angle in (0.0, np.radians(120.0))
    )
    assert [pose is None for pose in turned] == [True] + [False] * (len(ahead) - 1)
    for one, other in zip(ahead[1:], turned[1:], strict=True):
        assert one is not None
        assert other is not None
        np.testing.assert_allclose(other.rotation, ry(np.radians(120.0)) @ one.rotation, atol=1e-6)
        np.testing.assert_allclose(other.origin[:, 1], one.origin[:, 1], atol=1e-6)
