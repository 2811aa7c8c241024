"""Motion capture files (BVH) as motions of the simulated person, with its own lengths."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.formats.bvh_joint_names import read_bvh_centres
from zenocap.common.formats.trajectories import Trajectories
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import OUTWARD, SIDES, PersonPose, Placement, interpolate, minimum_jerk, neutral, place
from zenocap.simulation.body.rotation import blend, cross, from_x_and_y, rx, ry, unit
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


def captured_take(
    person: Person, path: Path, fps: float, from_s: float = 0.05, longest_s: float = 8.0,
    opening: Sequence[PersonPose | None] = (), heading: float = 0.0,
) -> CapturedTake:  # fmt: skip
    """An opening, by default that of `t_pose_opening`, transition 0.8 s, then the motion of a file, at `fps`.

    The person has a heading, radians from +Z towards +X, in the opening and at the start of the motion, whose path is
    centred at the origin.  from_s: start within the file; the first frame of many files is a T-pose.  longest_s: the
    motion is cut after it.  opening: facing +Z at the origin.  Raises UserError.
    """
    centres = read_bvh_centres(path)
    times = np.arange(from_s, min(from_s + longest_s, (len(centres.points) - 1) / centres.rate), 1.0 / fps)
    towards_z, turn = _bones(person, centres, np.rint(times * centres.rate).astype(np.int64)), ry(heading)
    motion = _centred([Bones(turn @ pose.rotation, pose.origin @ turn.T) for pose in towards_z])
    x, _, z = motion[0].origin[PELVIS].tolist()
    before = opening or t_pose_opening(person, fps)
    poses = [None if pose is None else pose_bones(person, place(pose, Placement(x, z, heading))) for pose in before]
    last, count = poses[-1] or motion[0], ceil(ENTRY_S * fps)
    poses += [between(last, motion[0], minimum_jerk(k / count)) for k in range(1, count)]
    return CapturedTake((*poses, *motion), len(poses))


def t_pose_opening(person: Person, fps: float) -> list[PersonPose | None]:
    """Empty scene 1 s, T-pose 1.5 s, arms down 0.6 s."""
    stretched, standing, steps = t_pose(person), neutral(person), ceil(LOWERING_S * fps)
    lowering = [interpolate(stretched, standing, minimum_jerk(k / steps)) for k in range(1, steps + 1)]
    return [*[None] * ceil(EMPTY_S * fps), *[stretched] * ceil(T_POSE_S * fps), *lowering]


def _bones(person: Person, centres: Trajectories, frames: Ints) -> list[Bones]:
    """The person's skeleton in frames of a file, heading of the first frame +Z, feet on the floor y = 0."""
    at = {name: centres.points[frames, k] for k, name in enumerate(centres.names)}
    across = at["LHip"][0] - at["RHip"][0]
    facing = ry(float(np.arctan2(across[2], across[0])))
    at = {name: points @ facing.T for name, points in at.items()}
    legs = [np.linalg.norm(at[f"{a}"] - at[f"{b}"], axis=1) for a, b in (("RHip", "RKnee"), ("RKnee", "RAnkle"))]
    scale = (person.lengths.thigh + person.lengths.shank) / float(np.median(legs[0] + legs[1]))
    sole = max(_sole_angle(at, side) for side in "RL")
    poses = []
    for k in range(len(frames)):
        one = {name: points[k] for name, points in at.items()}
        poses.append(_skeleton(person, _rotations(one, sole), scale * one["Hip"]))
    floor = float(np.quantile([_lowest(person, pose) for pose in poses], FLOOR_QUANTILE))
    return [_moved(pose, np.array([0.0, -floor, 0.0])) for pose in poses]


def _sole_angle(at: dict[str, Floats], side: str) -> float:
    """Angle in radians of the line from ankle to toe below the horizontal while the foot stands: where it is lowest."""
    foot = at[f"{side}Toe"] - at[f"{side}Ankle"]
    low = np.argsort(at[f"{side}Ankle"][:, 1] + at[f"{side}Toe"][:, 1])[: max(1, len(foot) // 5)]
    return float(np.median(np.arctan2(-foot[low, 1], np.hypot(foot[low, 0], foot[low, 2]))))


def _rotations(at: dict[str, Floats], sole: float) -> Floats:
    """Bones to world (13, 3, 3) from joint centres; the turn of a limb about its axis follows from the bone above."""
    rotation = np.empty((BONES, 3, 3))
    trunk = at["Neck"] - at["Hip"]
    rotation[PELVIS] = from_x_and_y(at["LHip"] - at["RHip"], trunk)
    rotation[CHEST] = from_x_and_y(at["LShoulder"] - at["RShoulder"], trunk)
    rotation[HEAD] = from_x_and_y(rotation[CHEST, :, 0], at["Head"] - at["Neck"])
    for side, letter in zip(SIDES, "RL", strict=True):
        joints = {name: at[f"{letter}{name}"] for name in ("Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Toe")}
        rotation[UPPER_ARM[side]] = _along(rotation[CHEST], joints["Elbow"] - joints["Shoulder"])
        rotation[FOREARM[side]] = _along(rotation[UPPER_ARM[side]], joints["Wrist"] - joints["Elbow"])
        rotation[THIGH[side]] = from_x_and_y(rotation[PELVIS, :, 0], joints["Hip"] - joints["Knee"])
        rotation[SHANK[side]] = from_x_and_y(rotation[THIGH[side], :, 0], joints["Knee"] - joints["Ankle"])
        forward = unit(joints["Toe"] - joints["Ankle"])
        foot_up = joints["Knee"] - joints["Ankle"]
        rotation[FOOT[side]] = from_x_and_y(cross(foot_up, forward), cross(forward, cross(foot_up, forward))) @ rx(-sole)
    return rotation


def _along(above: Floats, direction: Floats) -> Floats:
    """Rotation (3, 3) of a bone along `direction` (3,), turned the shortest way from the bone above, (3, 3)."""
    turned: Floats = _least_turn(-above[:, 1], unit(direction)) @ above
    return turned


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


def between(first: Bones, second: Bones, share: float) -> Bones:
    turned = [blend(a, b, share) for a, b in zip(first.rotation, second.rotation, strict=True)]
    return Bones(np.array(turned), (1.0 - share) * first.origin + share * second.origin)


def _least_turn(start: Floats, end: Floats) -> Floats:
    """(3, 3) rotation by the smallest angle from one unit vector to another, less than half a turn apart."""
    axis = cross(start, end)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turn: Floats = np.eye(3) + skew + skew @ skew / (1.0 + float(start @ end))
    return turn
