"""The skeleton that animation programs know, laid over an anatomy: named bones, their rest pose, their rotations.

The rest pose is upright, facing Z, arms sideways, and there every bone's frame is the world's.  The ten parts move
Hips (the whole torso), Neck (the head with it), LeftArm, LeftForeArm, LeftUpLeg, LeftLeg and their right twins.  With
fourteen, Hips is the pelvis alone, Spine turns the chest, Head the head, LeftFoot and RightFoot the feet.  The other
bones only divide a part and never turn in it; they are there because others look for them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.kinematics import part_frames
from common.body.proportions import stretched_angles
from common.formats.track import PoseTrack


@dataclass(frozen=True)
class Bone:
    """A bone begins at a joint of the anatomy (and turns with its part), or else inside a part.

    Inside a part: at a marker of the anatomy, or at the share `along` of the part's height, moved by the share `towards`
    of the way from there to a joint.  ends: it has no child and ends where its part does.
    """

    name: str
    parent: str
    joint: str = ""
    part: str = ""
    marker: str = ""
    along: float = 0.0
    towards: tuple[str, float] = ("", 0.0)
    ends: bool = False


def _side(ours: str, theirs: str, trunk: str, foot: Bone) -> tuple[Bone, ...]:
    """One arm and leg.  trunk: the part that carries the shoulders."""
    initial = theirs[0]
    return (
        Bone(f"{theirs}Shoulder", "Spine1", part=trunk, along=1.0, towards=(f"{ours}_shoulder", 0.2)),
        Bone(f"{theirs}Arm", f"{theirs}Shoulder", joint=f"{ours}_shoulder"),
        Bone(f"{theirs}ForeArm", f"{theirs}Arm", joint=f"{ours}_elbow"),
        Bone(f"{theirs}Hand", f"{theirs}ForeArm", marker=f"{initial}Wrist", ends=True),
        Bone(f"{theirs}UpLeg", "Hips", joint=f"{ours}_hip"),
        Bone(f"{theirs}Leg", f"{theirs}UpLeg", joint=f"{ours}_knee"),
        foot,
    )


BONES: Mapping[str, tuple[Bone, ...]] = {
    TEN_PARTS.name: (
        Bone("Hips", "", joint="navel"),
        Bone("Spine", "Hips", part="torso", along=0.3),
        Bone("Spine1", "Spine", part="torso", along=0.65),
        Bone("Neck", "Spine1", joint="neck"),
        Bone("Head", "Neck", part="head", along=0.3, ends=True),
        *_side("left", "Left", "torso", Bone("LeftFoot", "LeftLeg", marker="LAnkle", ends=True)),
        *_side("right", "Right", "torso", Bone("RightFoot", "RightLeg", marker="RAnkle", ends=True)),
    ),
    FOURTEEN_PARTS.name: (
        Bone("Hips", "", joint="navel"),
        Bone("Spine", "Hips", joint="waist"),
        Bone("Spine1", "Spine", part="chest", along=0.5),
        Bone("Neck", "Spine1", joint="neck_base"),
        Bone("Head", "Neck", joint="neck", ends=True),
        *_side("left", "Left", "chest", Bone("LeftFoot", "LeftLeg", joint="left_ankle", ends=True)),
        *_side("right", "Right", "chest", Bone("RightFoot", "RightLeg", joint="right_ankle", ends=True)),
    ),
}


@dataclass(frozen=True)
class Skeleton:
    """names, parents: of the bones, -1 for the root; parents come first.  parts: (bones,) the part each turns with.

    offsets: (bones, 3) from the parent bone in the rest pose, metres, our world's axes; the root's is zero.
    ends: by bone, from its own beginning to its End Site, for those without child.  part_to_rest: (parts, 3, 3).
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    parts: NDArray[np.int64]
    offsets: Floats
    ends: dict[int, Floats]
    part_to_rest: Floats


def skeleton_of(anatomy: Anatomy, bdp: Bdp) -> Skeleton:
    """The skeleton of one body.  Raises ValueError for an anatomy without one."""
    if anatomy.name not in BONES:
        raise ValueError(f"anatomy {anatomy.name!r} has no skeleton: allowed: {', '.join(BONES)}")
    bones = BONES[anatomy.name]
    bases = np.zeros((len(anatomy.parts), 3)) if bdp.bases is None else bdp.bases
    rest = part_frames(anatomy, bdp, Pose(np.zeros(3), stretched_angles(anatomy)))
    names = [bone.name for bone in bones]
    markers = {marker.name: marker for marker in anatomy.markers}
    parts, places, ends = [], [], {}
    for k, bone in enumerate(bones):
        marker = markers.get(bone.marker)
        part = anatomy.index[bone.joint or bone.part or (marker.part if marker else "")]
        along = marker.along if marker else bone.along
        begin, axis = rest[part, :, 3], rest[part, :, :3] @ bases[part]  # of the joint, and from it to the part's axis
        place = begin if bone.joint else begin + axis + along * bdp.sizes[part, 0] * rest[part, :, 1]
        if bone.towards[0]:
            place = place + bone.towards[1] * (rest[anatomy.index[bone.towards[0]], :, 3] - place)
        if bone.ends:
            ends[k] = begin + axis + bdp.sizes[part, 0] * rest[part, :, 1] - place
        parts.append(part)
        places.append(place)
    parents = tuple(names.index(bone.parent) if bone.parent else -1 for bone in bones)
    offsets = np.array(places) - np.array(places)[np.maximum(parents, 0)]
    return Skeleton(tuple(names), parents, np.array(parts), offsets, ends, rest[:, :, :3])


def bone_rotations(skeleton: Skeleton, track: PoseTrack) -> Floats:
    """(n, bones, 3, 3) of every bone against its parent, zero turn being the rest pose; every row must have a pose."""
    rows = [part_frames(track.anatomy, track.bdp, track.pose(row)) for row in range(len(track.frames))]
    return turned_bones(skeleton, np.stack(rows))


def turned_bones(skeleton: Skeleton, part_to_world: Floats) -> Floats:
    """`bone_rotations` where parts are: part_to_world (n, parts, 3, 4), as `part_frames` gives each row."""
    bone_to_world = (part_to_world[..., :3] @ np.swapaxes(skeleton.part_to_rest, -1, -2))[:, skeleton.parts]
    parents = np.maximum(skeleton.parents, 0)
    rotations: Floats = np.swapaxes(bone_to_world[:, parents], -1, -2) @ bone_to_world
    rotations[:, 0] = bone_to_world[:, 0]
    same = np.flatnonzero(skeleton.parts == skeleton.parts[parents])
    rotations[:, same[same > 0]] = np.eye(3)
    return rotations
