"""Forward kinematics of an anatomy: the transforms of [Two-view 2.2] chained from the world to every part."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose


@njit(cache=True, error_model="numpy")
def rotate(rotation: Floats, axis: int, angle: float) -> None:
    """rotation @ R_axis(angle) in place; rotation: (3, 3), axis: 0 x, 1 y, 2 z, angle in radians."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for row in range(3):
        a, b = rotation[row, i], rotation[row, j]
        rotation[row, i] = a * c + b * s
        rotation[row, j] = b * c - a * s


@njit(cache=True, error_model="numpy")
def place_part(
    joint: int, tree: NDArray[np.int64], offsets: Floats, position: Floats, angles: Floats, part_to_world: Floats
) -> None:
    """Write part_to_world[joint] (3, 4) from its parent's; the parent must be placed already."""
    parent = tree[joint, 0]
    out = part_to_world[joint]
    if parent < 0:
        for row in range(3):
            for col in range(3):
                out[row, col] = 1.0 if row == col else 0.0
            out[row, 3] = position[row]
    else:
        up = part_to_world[parent]
        for row in range(3):
            out[row, 3] = up[row, 3]
            for k in range(3):  # a slice would compile numba's error texts along: seconds
                out[row, k] = up[row, k]
                out[row, 3] += up[row, k] * offsets[joint, k]
    for k in range(3):
        axis = tree[joint, 2 + k]
        if axis >= 0:
            rotate(out[:, :3], axis, angles[tree[joint, 1] + k])


@njit(cache=True, error_model="numpy")
def place_parts(tree: NDArray[np.int64], offsets: Floats, position: Floats, angles: Floats, part_to_world: Floats) -> None:
    """Place every part: part_to_world (parts, 3, 4) is overwritten."""
    for joint in range(tree.shape[0]):
        place_part(joint, tree, offsets, position, angles, part_to_world)


def part_frames(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> Floats:
    """`part_to_world` of every part, (parts, 3, 4): rotation and, in the last column, the origin in metres."""
    part_to_world = np.zeros((len(anatomy.parts), 3, 4))
    place_parts(anatomy.tree, bdp.offsets, pose.position, pose.angles, part_to_world)
    return part_to_world


def joint_centres(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> Floats:
    """Joint centres in the world, (markers, 3) metres, ordered by `Anatomy.markers`."""
    frames = part_frames(anatomy, bdp, pose)
    centres = np.empty((len(anatomy.markers), 3))
    for k, marker in enumerate(anatomy.markers):
        if marker.joints:
            centres[k] = np.mean([frames[anatomy.index[joint], :, 3] for joint in marker.joints], axis=0)
        else:
            part = anatomy.index[marker.part]
            centres[k] = frames[part, :, 3] + marker.along * bdp.sizes[part, 0] * frames[part, :, 1]
            if bdp.bases is not None:
                centres[k] += frames[part, :, :3] @ bdp.bases[part]
    return centres
