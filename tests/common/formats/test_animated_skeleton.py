"""Animated skeletons: joint centres, rest pose, gaps and broken poses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.pose_tracks import moving, track_of
from tests.support.scene_takes import motion_of
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.errors import UserError
from zenocap.common.formats.animated_skeleton import animated_skeleton
from zenocap.common.formats.pose_track import every_frame
from zenocap.tools.takes.export import skin_of

JOINTS = {"LHip": "LeftUpLeg", "RKnee": "RightLeg", "LElbow": "LeftForeArm", "RWrist": "RightHand", "LAnkle": "LeftFoot"}


def placed(quaternions: np.ndarray, offsets: np.ndarray, parents: tuple[int, ...], root: np.ndarray) -> np.ndarray:
    """(bones, 3) positions by chaining quaternions x, y, z, w."""
    places, turns = np.zeros_like(offsets), np.zeros((len(offsets), 3, 3))
    for bone, parent in enumerate(parents):
        turn = Rotation.from_quat(quaternions[bone]).as_matrix()
        places[bone] = root if parent < 0 else places[parent] + turns[parent] @ offsets[bone]
        turns[bone] = turn if parent < 0 else turns[parent] @ turn
    return places


def test_bones_are_at_the_joint_centres() -> None:
    track = moving()
    motion = motion_of(track)
    names = [marker.name for marker in track.anatomy.markers]
    for row in range(len(track.frames)):
        places = placed(motion.rotations[row], motion.offsets, motion.parents, motion.positions[row])
        centres = joint_centres(track.anatomy, track.bdp, track.pose(row))
        for ours, bone in JOINTS.items():
            np.testing.assert_allclose(places[motion.names.index(bone)], centres[names.index(ours)], atol=1e-9)


def test_the_rest_pose_stands_on_the_floor_with_the_arms_sideways() -> None:
    motion = motion_of(moving())
    assert (motion.skin.points + motion.offsets[0])[:, 1].min() == pytest.approx(0.0)
    places = dict(zip(motion.names, motion.places, strict=True))
    assert places["LeftHand"][0] > 0.5 > -0.5 > places["RightHand"][0]
    assert places["LeftHand"][1] == pytest.approx(places["LeftArm"][1], abs=0.02)
    hands = np.abs(motion.skin.points[:, 0]) > places["LeftForeArm"][0] + 0.1
    bones = {motion.names[bone] for bone in motion.skin.bones[hands].tolist()}
    assert bones == {"LeftForeArm", "RightForeArm"}


def test_rotations_do_not_change_their_sign_and_gaps_repeat_the_last_pose() -> None:
    motion = motion_of(moving(20, lost=(5, 6)))
    assert (np.einsum("nbk,nbk->nb", motion.rotations[1:], motion.rotations[:-1]) >= 0).all()
    np.testing.assert_array_equal(motion.positions[6], motion.positions[4])
    assert np.flatnonzero(~motion.known).tolist() == [5, 6]
    np.testing.assert_allclose(motion.times_s, np.arange(20) / 30)


def test_one_pose_is_a_motion_of_one_row() -> None:
    track = moving(3).rows(np.array([1]))
    motion = motion_of(every_frame(replace(track, rate=0.0), 1))
    assert (motion.rate, motion.times_s.tolist(), len(motion.rotations)) == (0.0, [0.0], 1)


def test_names_of_vrm() -> None:
    track = moving(2)
    motion = animated_skeleton(track, skin_of(track.anatomy, track.bdp), "vrm")
    assert motion.names == motion.humanoid
    required = {"hips", "spine", "chest", "neck", "head", "leftUpperArm", "leftLowerArm", "leftHand", "rightUpperLeg"}
    assert required | {"rightLowerLeg", "rightFoot", "leftShoulder"} <= set(motion.names)


def test_broken_poses_are_refused() -> None:
    track = moving(4)
    angles = np.array(track.angles)
    angles[2, 3] = np.inf
    with pytest.raises(UserError, match="frame 2: a position or an angle is not finite"):
        motion_of(replace(track, angles=angles))
    with pytest.raises(UserError, match="lost in every frame"):
        motion_of(track_of(np.full((3, 3), np.nan), np.zeros((3, track.angles.shape[1]))))
