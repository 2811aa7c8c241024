"""The actor as the humanoid that avatars are made for: Unity's bones and axes, a T-pose as the rest.

The rest pose is upright, facing Z, the arms sideways; there every bone's rotation is none.  Rotations are against the
parent bone, positions are the bones' beginnings in the parent's frame, metres.  Unity's axes are ours with X mirrored:
X right, Y up, Z front, left-handed, so that a rotation R of ours is A R A^T there.
"""

from collections.abc import Mapping

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.kinematics import part_frames
from common.body.quaternions import quaternions
from common.formats.axes import MATRICES, turned
from common.formats.skeleton import skeleton_of, turned_bones

AXES = MATRICES["unity"]
NAMES: Mapping[str, str] = {  # of our bones in Unity's HumanBodyBones, where they differ
    "Spine1": "Chest",
    "LeftArm": "LeftUpperArm",
    "LeftForeArm": "LeftLowerArm",
    "LeftUpLeg": "LeftUpperLeg",
    "LeftLeg": "LeftLowerLeg",
    "RightArm": "RightUpperArm",
    "RightForeArm": "RightLowerArm",
    "RightUpLeg": "RightUpperLeg",
    "RightLeg": "RightLowerLeg",
}


class Humanoid:
    """One body's bones.

    names: of HumanBodyBones, parents first.  parents: index of each bone's, -1 for the hips.
    """

    def __init__(self, anatomy: Anatomy, body: Bdp) -> None:
        """Raises ValueError for an anatomy without a skeleton."""
        self._anatomy, self._body = anatomy, body
        self._skeleton = skeleton_of(anatomy, body)
        self.names = tuple(NAMES.get(name, name) for name in self._skeleton.names)
        self.parents = self._skeleton.parents
        self._offsets = turned(self._skeleton.offsets, "unity")

    def bones(self, pose: Pose) -> Floats:
        """(bones, 7): position, metres, and rotation, a quaternion x, y, z, w, in the parent; of the hips in the world."""
        frames = part_frames(self._anatomy, self._body, pose)
        rotations = AXES @ turned_bones(self._skeleton, frames[None])[0] @ AXES.T
        positions = self._offsets.copy()
        positions[0] = turned(pose.position, "unity")
        return np.concatenate([positions, quaternions(rotations)], axis=1)
