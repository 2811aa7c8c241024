"""Motion capture files (BVH) as motions of the simulated person: its own lengths, the file's joint rotations."""

from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.formats.bvh_joint_names import common_ancestor, roles_of, to_y_up_of
from zenocap.common.formats.bvh_reader import Bvh, read_bvh
from zenocap.common.formats.bvh_segments import rest_points
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import OUTWARD, SIDES, interpolate, minimum_jerk, neutral
from zenocap.simulation.body.rotation import blend, cross, from_x_and_y, ry, unit
from zenocap.simulation.body.skeleton import (
    BALL,
    BONES,
    CHEST,
    FOOT,
    FOREARM,
    HEAD,
    PELVIS,
    SHANK,
    THIGH,
    UPPER_ARM,
    WAIST,
    Bones,
    collar,
    pose_bones,
)
from zenocap.simulation.motion.timeline import t_pose

EMPTY_S, T_POSE_S, LOWERING_S, ENTRY_S = 1.0, 1.5, 0.6, 0.8
FLOOR_QUANTILE = 0.02  # of the lowest foot's height over all frames; a few frames of noise are below the floor


@dataclass(frozen=True)
class CapturedTake:
    """poses: by frame, None while the scene is empty.  motion_from: first frame of the captured motion."""

    poses: tuple[Bones | None, ...]
    motion_from: int


def captured_take(person: Person, path: Path, fps: float, from_s: float = 0.05, longest_s: float = 8.0) -> CapturedTake:
    """Empty scene 1 s, T-pose 1.5 s, arms down 0.6 s, transition 0.8 s, then the motion of a file, at `fps`.

    The person faces +Z in the T-pose and at the start of the motion, whose path is centred at the origin.  from_s: start
    within the file; the first frame of many files is a T-pose.  longest_s: the motion is cut after it.  Raises UserError.
    """
    file = read_bvh(path)
    times = np.arange(from_s, min(from_s + longest_s, (len(file.points) - 1) / file.rate), 1.0 / fps)
    motion = _centred(_bones(person, file, path, np.rint(times * file.rate).astype(np.int64)))
    start = motion[0].origin[PELVIS]
    shift = np.array([start[0], 0.0, start[2]])
    poses: list[Bones | None] = [None] * ceil(EMPTY_S * fps)
    stretched, standing = t_pose(person), neutral(person)
    lowering = [minimum_jerk(k / ceil(LOWERING_S * fps)) for k in range(1, ceil(LOWERING_S * fps) + 1)]
    opening = [stretched] * ceil(T_POSE_S * fps) + [interpolate(stretched, standing, share) for share in lowering]
    poses += [_moved(pose_bones(person, pose), shift) for pose in opening]
    last, count = _moved(pose_bones(person, standing), shift), ceil(ENTRY_S * fps)
    poses += [_between(last, motion[0], minimum_jerk(k / count)) for k in range(1, count)]
    return CapturedTake((*poses, *motion), len(poses))


def _bones(person: Person, file: Bvh, path: Path, frames: Ints) -> list[Bones]:
    """The person's skeleton in frames of a file, heading of the first frame +Z, feet on the floor y = 0."""
    at = roles_of(file.names, path)
    to_y_up = to_y_up_of({role: file.points[:, k] for role, k in at.items()})
    rest = rest_points(file) @ to_y_up.T
    left = unit(np.array([1.0, 0.0, 1.0]) * (rest[at["LHip"]] - rest[at["RHip"]]))
    upright = from_x_and_y(left, np.array([0.0, 1.0, 0.0]))
    joints, rest_axes = np.zeros(BONES, dtype=np.int64), np.tile(upright, (BONES, 1, 1))
    joints[PELVIS] = common_ancestor(file.parents, at["RHip"], at["LHip"])
    joints[CHEST] = common_ancestor(file.parents, at["RShoulder"], at["LShoulder"])
    joints[HEAD] = at["Head"]
    for side in SIDES:
        chain = [at[f"{'RL'[side]}{role}"] for role in ("Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle")]
        for bone, start, end in (
            (UPPER_ARM[side], chain[0], chain[1]),
            (FOREARM[side], chain[1], chain[2]),
            (THIGH[side], chain[3], chain[4]),
            (SHANK[side], chain[4], chain[5]),
        ):
            joints[bone], rest_axes[bone] = start, _least_turn(-upright[:, 1], unit(rest[end] - rest[start])) @ upright
        joints[FOOT[side]] = chain[5]
    rotations = to_y_up @ file.rotations[frames][:, joints] @ to_y_up.T @ rest_axes
    across = rotations[0, PELVIS, :, 0]
    facing = ry(-float(np.arctan2(-across[2], across[0])))
    leg = sum(float(np.linalg.norm(rest[at[a]] - rest[at[b]])) for a, b in (("RHip", "RKnee"), ("RKnee", "RAnkle")))
    scale = (person.lengths.thigh + person.lengths.shank) / leg
    hips = 0.5 * (file.points[frames, at["RHip"]] + file.points[frames, at["LHip"]]) @ (scale * facing @ to_y_up).T
    poses = [_skeleton(person, facing @ turn, place) for turn, place in zip(rotations, hips, strict=True)]
    floor = float(np.quantile([_lowest(person, pose) for pose in poses], FLOOR_QUANTILE))
    return [_moved(pose, np.array([0.0, -floor, 0.0])) for pose in poses]


def _skeleton(person: Person, rotation: Floats, hips: Floats) -> Bones:
    """Bones (13) of the person's lengths with given rotations (13, 3, 3) and middle of the hips (3,), metres."""
    size, origin = person.lengths, np.empty((BONES, 3))
    origin[PELVIS] = hips
    origin[CHEST] = hips + rotation[PELVIS, :, 1] * (WAIST * size.torso)
    origin[HEAD] = origin[CHEST] + rotation[CHEST, :, 1] * ((1.0 - WAIST) * size.torso)
    for side in SIDES:
        upper, thigh, shank = rotation[UPPER_ARM[side]], rotation[THIGH[side]], rotation[SHANK[side]]
        raised = 0.5 - 0.5 * float(rotation[CHEST, :, 1] @ upper[:, 1])
        origin[UPPER_ARM[side]] = origin[HEAD] + rotation[CHEST] @ collar(person, side, raised)
        origin[FOREARM[side]] = origin[UPPER_ARM[side]] - upper[:, 1] * size.upper_arm
        origin[THIGH[side]] = hips + rotation[PELVIS, :, 0] * (OUTWARD[side] * size.hip_half)
        origin[SHANK[side]] = origin[THIGH[side]] - thigh[:, 1] * size.thigh
        origin[FOOT[side]] = origin[SHANK[side]] - shank[:, 1] * size.shank
    return Bones(rotation, origin)


def _lowest(person: Person, pose: Bones) -> float:
    """Height of the lowest point of both soles, metres."""
    size = person.lengths
    points = np.array([[0.0, -size.ankle_height, 0.0], [0.0, -size.ankle_height, BALL * size.foot]])
    return min(float((pose.origin[foot] + points @ pose.rotation[foot].T)[:, 1].min()) for foot in FOOT)


def _centred(poses: list[Bones]) -> list[Bones]:
    """The poses with the middle of their path's extent on the ground at the origin."""
    path = np.array([pose.origin[PELVIS] for pose in poses])
    middle = 0.5 * (path.min(axis=0) + path.max(axis=0)) * [1.0, 0.0, 1.0]
    return [_moved(pose, -middle) for pose in poses]


def _moved(pose: Bones, by: Floats) -> Bones:
    return Bones(pose.rotation, pose.origin + by)


def _between(first: Bones, second: Bones, share: float) -> Bones:
    turned = [blend(a, b, share) for a, b in zip(first.rotation, second.rotation, strict=True)]
    return Bones(np.array(turned), (1.0 - share) * first.origin + share * second.origin)


def _least_turn(start: Floats, end: Floats) -> Floats:
    """(3, 3) rotation by the smallest angle from one unit vector to another, less than half a turn apart."""
    axis = cross(start, end)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turn: Floats = np.eye(3) + skew + skew @ skew / (1.0 + float(start @ end))
    return turn
