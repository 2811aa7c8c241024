"""A skeleton with a skin and its motion, as scenes for animation programs (glTF, USD) have it.

Metres, right-handed, Y up; the person first faces Z, which is what both formats recommend.  In the rest pose all bones have
the axes of the world, so a bone's rest transform is a translation.
"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints, Ints32
from zenocap.common.body.rotations import matrix_to_quaternion
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack, holding
from zenocap.common.formats.skeleton import BoneNames, bone_rotations, skeleton_of, vrm_name


@dataclass(frozen=True)
class Skin:
    """Triangle mesh of a body in the rest pose; every point moves with one bone.

    points, normals: (n, 3), relative to the root bone, metres.  triangles: (m, 3) rows of points.  bones: (n,) index.
    materials: (m,) row of `colours` and `names` of each triangle.  colours: (k, 3) red, green, blue, linear, in [0, 1].
    """

    points: Floats
    normals: Floats
    triangles: Ints32
    bones: Ints
    materials: Ints
    colours: Floats
    names: tuple[str, ...]


@dataclass(frozen=True)
class AnimatedSkeleton:
    """names, parents: of the bones, parents first, -1 for the root.  humanoid: their VRM names.

    offsets: (bones, 3) from the parent bone in the rest pose, metres; of the root so that the soles are at height 0.
    moving: (bones,) whether a bone ever turns against its parent.  rate: rows per second, 0 for one row.
    times_s: (n,) seconds, from 0.  frames: (n,) frame numbers.  known: (n,) whether a row has a pose of its own.
    positions: (n, 3) of the root.  rotations: (n, bones, 4) x, y, z, w relative to the parent, without changes of sign.
    """

    names: tuple[str, ...]
    humanoid: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Floats
    moving: Bools
    rate: float
    frames: Ints
    times_s: Floats
    known: Bools
    positions: Floats
    rotations: Floats
    skin: Skin

    @property
    def places(self) -> Floats:
        """(bones, 3) positions of the bones in the rest pose."""
        places = np.array(self.offsets)
        for bone, parent in enumerate(self.parents):
            if parent >= 0:
                places[bone] += places[parent]
        return places


def animated_skeleton(track: PoseTrack, skin: Skin, names: BoneNames = "zenocap") -> AnimatedSkeleton:
    """Return the motion of a track with consecutive frames (`every_frame`).  Empty rows repeat the previous pose.

    Raises UserError without a pose, and for a pose with a value that is not finite.
    """
    held = holding(track)
    broken = np.flatnonzero(~(np.isfinite(held.positions).all(axis=1) & np.isfinite(held.angles).all(axis=1)))
    if len(broken):
        raise UserError(f"frame {held.frames[broken[0]]}: a position or an angle is not finite: allowed: finite numbers")
    skeleton = skeleton_of(track.anatomy, track.bdp)
    rotations = bone_rotations(skeleton, held)
    quaternions = matrix_to_quaternion(rotations.reshape(-1, 3, 3)).reshape(len(rotations), -1, 4)
    for row in range(1, len(quaternions)):
        flipped = np.einsum("bk,bk->b", quaternions[row - 1], quaternions[row]) < 0
        quaternions[row, flipped] *= -1
    parents = np.maximum(skeleton.parents, 0)
    offsets = np.array(skeleton.offsets)
    offsets[0] = [0.0, -float(skin.points[:, 1].min()), 0.0]
    humanoid = tuple(vrm_name(name) for name in skeleton.names)
    return AnimatedSkeleton(
        names=humanoid if names == "vrm" else skeleton.names,
        humanoid=humanoid,
        parents=skeleton.parents,
        offsets=offsets,
        moving=np.array([k == 0 or skeleton.parts[k] != skeleton.parts[parents[k]] for k in range(len(parents))]),
        rate=round(track.rate, 3),
        frames=held.frames,
        times_s=np.arange(len(held.frames)) / (round(track.rate, 3) or 1.0),
        known=track.known,
        positions=held.positions,
        rotations=quaternions,
        skin=skin,
    )
