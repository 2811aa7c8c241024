"""Forward kinematics: part frames [Two-view 2.2], joint centres and surface points."""

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.jit import kernel


@kernel
def rotate(rotation: Floats, axis: int, angle: float) -> None:
    """Multiply rotation (3, 3) by R_axis(angle) from the right, in place; axis: 0 x, 1 y, 2 z, angle in radians."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for row in range(3):
        a, b = rotation[row, i], rotation[row, j]
        rotation[row, i] = a * c + b * s
        rotation[row, j] = b * c - a * s


@kernel
def place_part(joint: int, tree: Ints, offsets: Floats, position: Floats, angles: Floats, part_to_world: Floats) -> None:
    """Write part_to_world[joint] (3, 4) from its parent's, which must have been written."""
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
            for k in range(3):  # a slice would add seconds of compilation, for numba's error texts
                out[row, k] = up[row, k]
                out[row, 3] += up[row, k] * offsets[joint, k]
    for k in range(3):
        axis = tree[joint, 2 + k]
        if axis >= 0:
            rotate(out[:, :3], axis, angles[tree[joint, 1] + k])


@kernel
def place_parts(tree: Ints, offsets: Floats, position: Floats, angles: Floats, part_to_world: Floats) -> None:
    """Write the frames of all parts to part_to_world (parts, 3, 4)."""
    for joint in range(tree.shape[0]):
        place_part(joint, tree, offsets, position, angles, part_to_world)


def part_frames(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> Floats:
    """Return `part_to_world` (parts, 3, 4): rotation and, in the last column, origin in metres."""
    part_to_world = np.zeros((len(anatomy.parts), 3, 4))
    place_parts(anatomy.tree, bdp.offsets, pose.position, pose.angles, part_to_world)
    return part_to_world


def joint_centres(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> Floats:
    """Joint centres (markers, 3) in the world, metres, in the order of `Anatomy.markers`."""
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


def end_ellipses(
    part_to_world: Floats, size: Floats, count: int = 24, *, tip: Floats | None = None, base: Floats | float = 0.0
) -> Floats:
    """Points (2 count, 3) in the world, metres, on both end ellipses of a part, whose convex hull is the part.

    part_to_world: (3, 4).  size: (3,) height, long and short radius, metres.  tip: (2,) radii at the far end, metres;
    default: those of the near end.  base: (3,) beginning of the axis in the part's frame, metres.
    """
    turn = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    ring = np.stack([np.cos(turn), np.zeros(count), np.sin(turn)], axis=1)
    across, deep = size[1:] if tip is None else tip
    near, far = ring * [size[1], 1.0, size[2]], ring * [across, 1.0, deep] + [0.0, size[0], 0.0]
    points: Floats = (np.concatenate([near, far]) + base) @ part_to_world[:, :3].T + part_to_world[:, 3]
    return points


def body_ellipses(bdp: Bdp, part_frames: Floats) -> list[Floats]:
    """`end_ellipses` of every part; part_frames: (parts, 3, 4), see the function `part_frames`."""
    parts = zip(part_frames, bdp.sizes, bdp.far_radii, bdp.starts, strict=True)
    return [end_ellipses(frame, size, tip=tip, base=base) for frame, size, tip, base in parts]
