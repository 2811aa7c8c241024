"""Orientations of pelvis, trunk, head and feet in BVH files, relative to the rest pose.

Joint centres alone do not give them.  The rest pose (all rotations zero) serves as the neutral pose if it is upright.
"""

from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.rotations import perpendicular, unit
from zenocap.common.formats.bvh_joint_names import common_ancestor, joint_roles, to_y_up_of
from zenocap.common.formats.bvh_reader import Bvh
from zenocap.common.formats.trajectories import MATRICES

MOST_LEAN_DEG = (
    20.0  # of trunk and lower legs in the rest pose, for an upright one; chosen by hand, for skeletons in T- and A-pose
)


def segment_rotations(file: Bvh, path: Path) -> dict[str, Floats]:
    """Rotations (n, 3, 3) to the world of `pelvis`, `trunk`, `head`, `right_foot`, `left_foot`, in JointRotations' axes.

    Empty when the rest pose is not upright.  path: for errors.  Raises UserError for joints without a known name.
    """
    at = joint_roles(file, path)
    to_y_up = to_y_up_of({role: file.points[:, k] for role, k in at.items()})
    rest = _rest_points(file) @ to_y_up.T
    place = {role: rest[k] for role, k in at.items()}
    up = np.array([0.0, 1.0, 0.0])
    trunk = place["RShoulder"] + place["LShoulder"] - place["RHip"] - place["LHip"]
    shanks = [place[f"{side}Knee"] - place[f"{side}Ankle"] for side in "RL"]
    lean = max(float(np.degrees(np.arccos(np.clip(unit(line) @ up, -1.0, 1.0)))) for line in (trunk, *shanks))
    if lean > MOST_LEAN_DEG:
        return {}
    right = unit(perpendicular(place["RHip"] - place["LHip"], up))
    rest_axes = np.stack([np.cross(up, right), up, right], axis=-1)
    bones = {
        "pelvis": common_ancestor(file.parents, at["RHip"], at["LHip"]),
        "trunk": common_ancestor(file.parents, at["RShoulder"], at["LShoulder"]),
        "head": at["Head"],
        "right_foot": at["RAnkle"],
        "left_foot": at["LAnkle"],
    }
    world = MATRICES["opensim"]
    return {name: world @ to_y_up @ file.rotations[:, bone] @ to_y_up.T @ rest_axes for name, bone in bones.items()}


def _rest_points(file: Bvh) -> Floats:
    """Positions (joints, 3) in the rest pose, the root at the origin, in the file's axes and unit."""
    rest = np.zeros((len(file.names), 3))
    for k, parent in enumerate(file.parents):
        if parent >= 0:
            rest[k] = rest[parent] + file.rotations[0, parent].T @ (file.points[0, k] - file.points[0, parent])
    return rest
