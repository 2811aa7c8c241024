"""Geometry of the virtual actor: capsules by kinematics, outlines in a camera's image.

Every body part is a smooth tapered capsule with elliptic ends.  A capsule starts at the near end of its part, has its
axis along its own +Y, the long radius along X and the short one along Z.
"""

from dataclasses import dataclass
from itertools import compress

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import body_ellipses, joint_centres, part_frames
from zenocap.common.body.rotations import matrix_to_quaternion
from zenocap.common.camera.pinhole import Camera
from zenocap.common.vision.prediction import seen_parts


@dataclass(frozen=True)
class CapsuleShapes:
    """Shapes of all parts, independent of the pose, in the order of `Anatomy.parts`.

    lengths: (parts,) of the axes.  near, far: (parts, 2) long and short radius at both ends.  Metres.
    """

    lengths: Floats
    near: Floats
    far: Floats


@dataclass(frozen=True)
class PlacedCapsules:
    """Capsules of one pose, in the world.

    frames: (parts, 3, 4) part to world.  positions: (parts, 3) near ends of the axes, metres.
    quaternions: (parts, 4) x, y, z, w of the parts' rotations.
    centres: (markers, 3) joint centres, metres, ordered by `Anatomy.markers`.
    """

    frames: Floats
    positions: Floats
    quaternions: Floats
    centres: Floats


def capsule_shapes(bdp: Bdp) -> CapsuleShapes:
    near = bdp.sizes[:, 1:]
    return CapsuleShapes(bdp.sizes[:, 0], near, near if bdp.tips is None else bdp.tips)


def placed_capsules(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> PlacedCapsules:
    """Return where a pose places the capsules of a body."""
    frames = part_frames(anatomy, bdp, pose)
    positions = frames[:, :, 3].copy()
    if bdp.bases is not None:
        positions += np.einsum("pij,pj->pi", frames[:, :, :3], bdp.bases)
    return PlacedCapsules(frames, positions, matrix_to_quaternion(frames[:, :, :3]), joint_centres(anatomy, bdp, pose))


def part_outlines(anatomy: Anatomy, bdp: Bdp, pose: Pose, camera: Camera) -> list[tuple[str, Floats]]:
    """Return each part's name and its convex outline in the camera's image, (corners, 2) px, lens distortion included.

    Parts that are not entirely in front of the camera are left out.
    """
    seen, pixels = seen_parts(camera, np.stack(body_ellipses(bdp, part_frames(anatomy, bdp, pose))))
    found: list[tuple[str, Floats]] = []
    for part, points in zip(compress(anatomy.parts, seen), pixels[seen], strict=True):
        hull = cv2.convexHull(points.astype(np.float32))
        found.append((part, np.asarray(hull, dtype=np.float64).reshape(-1, 2)))
    return found
