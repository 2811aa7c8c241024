"""Skeleton of animation programs for an anatomy: named bones, rest pose, rotations.

The rest pose is the T-pose facing Z, in which every bone's frame is the world's.  The ten parts move Hips (the whole
torso), Neck (with the head), LeftArm, LeftForeArm, LeftUpLeg, LeftLeg and the same on the right.  With fourteen, Hips is
the pelvis, Spine the chest, Head the head, LeftFoot and RightFoot the feet.  The other bones subdivide a part and do not
rotate in it; retargeting programs require them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.formats.pose_track import PoseTrack

BoneNames = Literal["zenocap", "vrm"]


@dataclass(frozen=True)
class Bone:
    """A bone that begins at a joint of the anatomy (and rotates with its part), or within a part.

    Within a part: at a marker of the anatomy, or at the fraction `along` of the part's height, moved by a fraction of the
    way to a joint (`towards`).  ends: the bone has no child and ends at the end of its part.
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
    """Bones of one arm and leg.  trunk: the part with the shoulders."""
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
    """names, parents: of the bones, parents first, -1 for the root.  parts: (bones,) index of the part of each bone.

    offsets: (bones, 3) from the parent bone in the rest pose, metres, world axes; the root's is zero.
    ends: by bone without child, offset of its End Site.  part_to_rest: (parts, 3, 3).
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    parts: Ints
    offsets: Floats
    ends: dict[int, Floats]
    part_to_rest: Floats


def skeleton_of(anatomy: Anatomy, bdp: Bdp) -> Skeleton:
    """Return the skeleton of a body.  Raises ValueError for an anatomy without one."""
    if anatomy.name not in BONES:
        raise ValueError(f"anatomy {anatomy.name!r} has no skeleton: allowed: {', '.join(BONES)}")
    bones = BONES[anatomy.name]
    bases = np.zeros((len(anatomy.parts), 3)) if bdp.bases is None else bdp.bases
    rest = part_frames(anatomy, bdp, Pose(np.zeros(3), t_pose_angles(anatomy)))
    names = [bone.name for bone in bones]
    markers = {marker.name: marker for marker in anatomy.markers}
    parts, places, ends = [], [], {}
    for k, bone in enumerate(bones):
        marker = markers.get(bone.marker)
        part = anatomy.index[bone.joint or bone.part or (marker.part if marker else "")]
        along = marker.along if marker else bone.along
        begin, axis = rest[part, :, 3], rest[part, :, :3] @ bases[part]  # joint, and offset of the part's axis from it
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
    """Rotations (n, bones, 3, 3) of bones relative to their parents; identity in the rest pose.  Every row has a pose."""
    rows = [part_frames(track.anatomy, track.bdp, track.pose(row)) for row in range(len(track.frames))]
    return turned_bones(skeleton, np.stack(rows))


def turned_bones(skeleton: Skeleton, part_to_world: Floats) -> Floats:
    """`bone_rotations` of part_to_world (n, parts, 3, 4), see `part_frames`."""
    bone_to_world = (part_to_world[..., :3] @ np.swapaxes(skeleton.part_to_rest, -1, -2))[:, skeleton.parts]
    parents = np.maximum(skeleton.parents, 0)
    rotations: Floats = np.swapaxes(bone_to_world[:, parents], -1, -2) @ bone_to_world
    rotations[:, 0] = bone_to_world[:, 0]
    same = np.flatnonzero(skeleton.parts == skeleton.parts[parents])
    rotations[:, same[same > 0]] = np.eye(3)
    return rotations


LIMBS = {"Arm": "UpperArm", "ForeArm": "LowerArm", "UpLeg": "UpperLeg", "Leg": "LowerLeg"}
UNITY_NAMES: Mapping[str, str] = {  # names in Unity's HumanBodyBones, where they differ from ours
    "Spine1": "Chest", **{f"{side}{ours}": f"{side}{unity}" for side in ("Left", "Right") for ours, unity in LIMBS.items()},
}  # fmt: skip


def unity_name(bone: str) -> str:
    """Name of a bone in Unity's HumanBodyBones."""
    return UNITY_NAMES.get(bone, bone)


def vrm_name(bone: str) -> str:
    """Name of a bone in VRM 1.0 (section Humanoid), which begins with a small letter."""
    name = unity_name(bone)
    return name[0].lower() + name[1:]
