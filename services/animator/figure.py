"""The virtual actor as shapes: every part a smooth tapered capsule with elliptic ends, placed by the kinematics.

A shape stands at its near end, its axis along its own +Y, the long radius along X and the short one along Z.
"""

from dataclasses import dataclass

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.kinematics import joint_centres, part_frames
from common.body.quaternions import quaternions


@dataclass(frozen=True)
class Capsules:
    """What of the shapes does not change with the pose, in the order of `Anatomy.parts`.

    lengths: (parts,) of the axes.  near, far: (parts, 2) long and short radius at both ends.  Metres.
    """

    lengths: Floats
    near: Floats
    far: Floats


@dataclass(frozen=True)
class Figure:
    """One pose.

    frames: (parts, 3, 4) part to world.  positions: (parts, 3) near ends of the axes, metres, world.
    quaternions: (parts, 4) x, y, z, w of the parts' rotations.
    centres: (markers, 3) joint centres, metres, world, ordered by `Anatomy.markers`.
    """

    frames: Floats
    positions: Floats
    quaternions: Floats
    centres: Floats


def capsules(bdp: Bdp) -> Capsules:
    """The shapes of a body."""
    near = bdp.sizes[:, 1:]
    return Capsules(bdp.sizes[:, 0], near, near if bdp.tips is None else bdp.tips)


def figure(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> Figure:
    """A body's shapes where a pose puts them."""
    frames = part_frames(anatomy, bdp, pose)
    positions = frames[:, :, 3].copy()
    if bdp.bases is not None:
        positions += np.einsum("pij,pj->pi", frames[:, :, :3], bdp.bases)
    return Figure(frames, positions, quaternions(frames[:, :, :3]), joint_centres(anatomy, bdp, pose))
