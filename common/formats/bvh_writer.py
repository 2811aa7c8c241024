"""BVH export: poses as a skeleton, for Blender, MotionBuilder and game engines.

OFFSETs are the rest pose of `common.formats.skeleton`, the pose with all rotations zero, in the axes of the world.  The
root has a zero OFFSET, position and rotation; every other joint has a rotation.  Channels are Zrotation Xrotation
Yrotation (R = Rz Rx Ry), in degrees, continuous over the rows.
"""

from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import atomic_file
from zenocap.common.errors import UserError
from zenocap.common.formats.euler_solutions import NO_RANGES, continuous_euler
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.pose_track import PoseTrack, holding
from zenocap.common.formats.skeleton import Skeleton, bone_rotations, skeleton_of
from zenocap.common.formats.trajectories import DIGITS, MATRICES, Axes, Unit, convert

ROTATION_AXES = "zxy"
ROTATIONS = " ".join(f"{axis.upper()}rotation" for axis in ROTATION_AXES)


def write_bvh(path: Path, track: PoseTrack, *, axes: Axes = "y-up", unit: Unit = "cm") -> None:
    """Write one row per frame; `track` has consecutive frames (`every_frame`).  Empty rows repeat the previous pose.

    Raises OSError, and UserError when there is no pose or no frame rate.
    """
    if track.rate <= 0:
        raise UserError(f"{path}: one frame has no frame rate, which BVH requires: allowed: two frames or more")
    held = holding(track)
    skeleton = skeleton_of(track.anatomy, track.bdp)
    positions = convert(held.positions, axes, unit)
    angles = np.degrees(bone_angles(skeleton, held, axes))[:, hierarchy_order(skeleton)].reshape(len(held.frames), -1)
    with atomic_file(path) as unfinished, unfinished.open("w", encoding="ascii", newline="\n") as file:
        file.write("\n".join(["HIERARCHY", *_hierarchy(skeleton, 0, "", axes, unit), ""]))
        file.write(f"MOTION\nFrames: {len(held.frames)}\nFrame Time: {1 / round(track.rate, 3):.8f}\n")
        for position, row in zip(positions, angles, strict=True):
            cells = [f"{value:.{DIGITS[unit]}f}" for value in position] + [f"{value:.6f}" for value in row]
            file.write(" ".join(cells) + "\n")


def bone_angles(skeleton: Skeleton, track: PoseTrack, axes: Axes) -> Floats:
    """Angles (n, bones, 3) about Z, X and Y of other axes, radians, continuous over the rows."""
    matrix = MATRICES[axes]
    rotations = matrix @ bone_rotations(skeleton, track) @ matrix.T
    angles = np.zeros(rotations.shape[:3])
    turning = [k for k, parent in enumerate(skeleton.parents) if parent < 0 or skeleton.parts[k] != skeleton.parts[parent]]
    for bone in turning:
        angles[:, bone] = continuous_euler(ROTATION_AXES, rotations[:, bone], NO_RANGES, track.step_s)
    return angles


def hierarchy_order(skeleton: Skeleton, bone: int = 0) -> list[int]:
    """Indices of the bones in the order of the HIERARCHY: depth first from `bone`."""
    children = [child for child, parent in enumerate(skeleton.parents) if parent == bone]
    return [bone, *(descendant for child in children for descendant in hierarchy_order(skeleton, child))]


def _hierarchy(skeleton: Skeleton, bone: int, indent: str, axes: Axes, unit: Unit) -> list[str]:
    inner = indent + "  "
    root = skeleton.parents[bone] < 0
    lines = [
        f"{indent}{'ROOT' if root else 'JOINT'} {skeleton.names[bone]}",
        f"{indent}{{",
        f"{inner}OFFSET {_triple(convert(skeleton.offsets[bone], axes, unit))}",
        f"{inner}CHANNELS {f'6 Xposition Yposition Zposition {ROTATIONS}' if root else f'3 {ROTATIONS}'}",
    ]
    for child, parent in enumerate(skeleton.parents):
        if parent == bone:
            lines += _hierarchy(skeleton, child, inner, axes, unit)
    if bone in skeleton.ends:
        offset = _triple(convert(skeleton.ends[bone], axes, unit))
        lines += [f"{inner}End Site", f"{inner}{{", f"{inner}  OFFSET {offset}", f"{inner}}}"]
    return [*lines, f"{indent}}}"]


def _triple(values: Floats) -> str:
    return " ".join(f"{value:.6f}" for value in values + 0.0)


def export(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    write_bvh(path, request.track, axes=request.axes, unit=request.unit)
