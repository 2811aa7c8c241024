"""Body model for compiled functions: kinematic tree, tapered parts, ranges of the joint coordinates."""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.rotations import matrix_to_vector, vector_to_matrix
from zenocap.common.jit import kernel, leaf_kernel

MAX_BALL_ANGLE = 2.0  # rad: of a ball joint's coordinates from the middle of the range; chosen by hand


class BodyModel(NamedTuple):
    """Body of one person.  d coordinates, p parts.

    parent: (p,) part or -1.  first: (p,) first coordinate of a part or -1.  kind: (p,) 3 ball, 1 hinge, 0 rigid or root.
    axis: (p,) of a hinge, 0 x, 1 y, 2 z.  reference: (p, 3, 3), see `Coordinates`.  offsets: (p, 3) joint in its parent.
    bases: (p, 3) start of the axis, in the part.  lengths: (p,) of the axis, without the round cap of a free end.
    free: (p,) 1 for a part without children, else 0.
    radii: (p, 4) long and short radius at the base, then at the far end, metres.
    low, high: (d,) range of the coordinates.  [Hybrid Eq. 41]
    """

    parent: Ints
    first: Ints
    kind: Ints
    axis: Ints
    reference: Floats
    offsets: Floats
    bases: Floats
    lengths: Floats
    free: Floats
    radii: Floats
    low: Floats
    high: Floats


def model_of(anatomy: Anatomy, bdp: Bdp) -> BodyModel:
    """Body model of a body."""
    coordinates = coordinates_of(anatomy)
    parts = len(anatomy.parts)
    parent = anatomy.tree[:, 0].copy()
    free = ~np.isin(np.arange(parts), parent)
    lengths = bdp.sizes[:, 0] - np.where(free, bdp.far_radii.mean(axis=1), 0.0)
    kind = np.array([len(j.axes) if k and j.axes else 0 for k, j in enumerate(anatomy.joints)], dtype=np.int64)
    low, high = _ranges(anatomy)
    return BodyModel(
        parent=parent,
        first=coordinates.first,
        kind=kind,
        axis=np.maximum(anatomy.tree[:, 2], 0),
        reference=coordinates.reference,
        offsets=np.ascontiguousarray(bdp.offsets, dtype=np.float64),
        bases=np.ascontiguousarray(bdp.starts, dtype=np.float64),
        lengths=np.maximum(lengths, 0.01),
        free=free.astype(np.float64),
        radii=np.concatenate([bdp.sizes[:, 1:], bdp.far_radii], axis=1),
        low=low,
        high=high,
    )


def _ranges(anatomy: Anatomy) -> tuple[Floats, Floats]:
    """(d,) lowest and highest coordinates: a hinge's limits; of a ball joint a cube, or its limits where axes coincide."""
    coordinates = coordinates_of(anatomy)
    # Paper (replaced): Eq. 41 bounds Euler angles; a ball joint has a cube of rotation vectors.
    low, high = np.full(coordinates.dimension, -MAX_BALL_ANGLE), np.full(coordinates.dimension, MAX_BALL_ANGLE)
    for k, joint in enumerate(anatomy.joints):
        start = int(coordinates.first[k])
        if start < 0:
            continue
        if len(joint.axes) == 1:
            low[start], high[start] = joint.limits[0]
        elif np.array_equal(coordinates.reference[k], np.eye(3)):
            for axis, (lowest, highest) in zip(joint.axes, joint.limits, strict=True):
                low[start + "xyz".index(axis)], high[start + "xyz".index(axis)] = lowest, highest
    return low, high


class RootedPose(NamedTuple):
    """Pose in the coordinates of the filter, for compiled code too.

    position: (3,) of the root, metres.  rotation: (3, 3) root to world.  values: (d,) joint coordinates, radians.
    """

    position: Floats
    rotation: Floats
    values: Floats

    @staticmethod
    def of(anatomy: Anatomy, body: Bdp, pose: Pose) -> "RootedPose":
        """A pose of a body in these coordinates."""
        rotation = np.ascontiguousarray(part_frames(anatomy, body, pose)[0, :, :3])
        return RootedPose(pose.position.copy(), rotation, coordinates_of(anatomy).of_pose(pose))

    def copy(self) -> "RootedPose":
        return RootedPose(self.position.copy(), self.rotation.copy(), self.values.copy())

    def pose(self, anatomy: Anatomy) -> Pose:
        """The same pose with joint angles."""
        return Pose(self.position.copy(), coordinates_of(anatomy).angles(self.values, self.rotation))


@kernel
def forward_kinematics(model: BodyModel, pose: RootedPose, frames: Floats) -> None:
    """Write frames (p, 3, 4), part to world, of a pose."""
    turn, local = np.empty((3, 3)), np.empty((3, 3))
    for k in range(model.parent.shape[0]):
        up = model.parent[k]
        out = frames[k]
        if up < 0:
            _place_root(pose, out)
            continue
        for row in range(3):
            out[row, 3] = frames[up, row, 3]
            for column in range(3):
                out[row, 3] += frames[up, row, column] * model.offsets[k, column]
        kind = model.kind[k]
        if kind == 0:
            for row in range(3):
                for column in range(3):
                    out[row, column] = frames[up, row, column]
            continue
        local_rotation(model, k, pose.values, turn, local)
        for row in range(3):
            for column in range(3):
                total = 0.0
                for inner in range(3):
                    total += frames[up, row, inner] * local[inner, column]
                out[row, column] = total


@kernel
def frames_of(model: BodyModel, pose: RootedPose) -> Floats:
    """Frames (p, 3, 4), part to world, of a pose."""
    frames = np.empty((model.parent.shape[0], 3, 4))
    forward_kinematics(model, pose, frames)
    return frames


@leaf_kernel
def _place_root(pose: RootedPose, out: Floats) -> None:
    """Write the frame (3, 4) of the root."""
    for row in range(3):
        out[row, 3] = pose.position[row]
        for column in range(3):
            out[row, column] = pose.rotation[row, column]


@leaf_kernel
def local_rotation(model: BodyModel, part: int, values: Floats, turn: Floats, local: Floats) -> None:
    """Write local (3, 3), part to parent, of a moving part; turn: (3, 3) scratch."""
    start = model.first[part]
    if model.kind[part] == 1:
        vector = turn[0]
        for k in range(3):
            vector[k] = values[start] if k == model.axis[part] else 0.0
        vector_to_matrix(vector, local)
        return
    vector_to_matrix(values[start : start + 3], turn)
    for row in range(3):
        for column in range(3):
            total = 0.0
            for inner in range(3):
                total += model.reference[part, row, inner] * turn[inner, column]
            local[row, column] = total


def pose_difference(before: RootedPose, after: RootedPose) -> Floats:
    """(6 + d,) from one pose to another: metres, rotation vector in the world, coordinates in radians."""
    turn = np.empty(3)
    matrix_to_vector(after.rotation @ before.rotation.T, turn)
    return np.concatenate([after.position - before.position, turn, after.values - before.values])
