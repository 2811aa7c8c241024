"""BVH: the pose as a skeleton, for Blender, MotionBuilder and game engines.

OFFSETs are the rest pose of `common.formats.skeleton` in the axes of the world; with all rotations zero the person is in
it.  The root has position and rotation and a zero OFFSET, every other joint a rotation.  Channels are Zrotation
Xrotation Yrotation, so R = Rz Rx Ry, in degrees, without jumps from row to row.
"""

from pathlib import Path

import numpy as np

from common.body.anatomy import Floats
from common.body.euler import angles_near
from common.formats.axes import MATRICES, Axes, Unit, turned
from common.formats.skeleton import Skeleton, bone_rotations, skeleton_of
from common.formats.track import PoseTrack, holding
from common.formats.trc import DIGITS, FormatError
from common.formats.whole import whole_file

ROTATION_AXES = "zxy"
ROTATIONS = " ".join(f"{axis.upper()}rotation" for axis in ROTATION_AXES)


def write_bvh(path: Path, track: PoseTrack, *, axes: Axes = "y-up", unit: Unit = "cm") -> None:
    """One row per frame, without holes between (`every_frame`); BVH has no blanks, so an empty row holds the last pose.

    Raises OSError, and FormatError when there is no pose or no frame rate.
    """
    if track.rate <= 0:
        raise FormatError(f"{path}: one frame has no frame rate, which BVH asks for: allowed: two frames or more")
    held = holding(track)
    skeleton = skeleton_of(track.anatomy, track.bdp)
    positions = turned(held.positions, axes, unit)
    angles = np.degrees(bone_angles(skeleton, held, axes))[:, hierarchy_order(skeleton)].reshape(len(held.frames), -1)
    with whole_file(path) as unfinished, unfinished.open("w", encoding="ascii", newline="\n") as file:
        file.write("\n".join(["HIERARCHY", *_hierarchy(skeleton, 0, "", axes, unit), ""]))
        file.write(f"MOTION\nFrames: {len(held.frames)}\nFrame Time: {1 / round(track.rate, 3):.8f}\n")
        for position, row in zip(positions, angles, strict=True):
            cells = [f"{value:.{DIGITS[unit]}f}" for value in position] + [f"{value:.6f}" for value in row]
            file.write(" ".join(cells) + "\n")


def bone_angles(skeleton: Skeleton, track: PoseTrack, axes: Axes) -> Floats:
    """(n, bones, 3) radians about Z, X and Y of other axes, of each row as near as can be to the row before."""
    matrix = MATRICES[axes]
    rotations = matrix @ bone_rotations(skeleton, track) @ matrix.T
    angles = np.zeros(rotations.shape[:3])
    turning = [k for k, parent in enumerate(skeleton.parents) if parent < 0 or skeleton.parts[k] != skeleton.parts[parent]]
    near = np.zeros((len(turning), 3))
    for row in range(len(rotations)):
        near = angles_near(ROTATION_AXES, rotations[row, turning], near)
        angles[row, turning] = near
    return angles


def hierarchy_order(skeleton: Skeleton, bone: int = 0) -> list[int]:
    """The bones as the hierarchy names them and the rows follow: each with all below it before the next."""
    children = [child for child, parent in enumerate(skeleton.parents) if parent == bone]
    return [bone, *(below for child in children for below in hierarchy_order(skeleton, child))]


def _hierarchy(skeleton: Skeleton, bone: int, indent: str, axes: Axes, unit: Unit) -> list[str]:
    inner = indent + "  "
    root = skeleton.parents[bone] < 0
    lines = [
        f"{indent}{'ROOT' if root else 'JOINT'} {skeleton.names[bone]}",
        f"{indent}{{",
        f"{inner}OFFSET {_triple(turned(skeleton.offsets[bone], axes, unit))}",
        f"{inner}CHANNELS {f'6 Xposition Yposition Zposition {ROTATIONS}' if root else f'3 {ROTATIONS}'}",
    ]
    for child, parent in enumerate(skeleton.parents):
        if parent == bone:
            lines += _hierarchy(skeleton, child, inner, axes, unit)
    if bone in skeleton.ends:
        offset = _triple(turned(skeleton.ends[bone], axes, unit))
        lines += [f"{inner}End Site", f"{inner}{{", f"{inner}  OFFSET {offset}", f"{inner}}}"]
    return [*lines, f"{indent}}}"]


def _triple(values: Floats) -> str:
    return " ".join(f"{value:.6f}" for value in values + 0.0)
