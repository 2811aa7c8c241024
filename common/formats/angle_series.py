"""Joint angles in degrees of takes (.mcap), BVH, TRC, C3D and OpenSim's .mot files, over time."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.body.clinical_angles import JointRotations, clinical_angles, joint_rotations, with_rigid_trunk
from zenocap.common.body.inverse_kinematics import NEEDED
from zenocap.common.body.rotations import perpendicular, unit
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_joint_names import centres_of, common_ancestor, joint_roles, to_y_up_of
from zenocap.common.formats.bvh_reader import Bvh, read_bvh
from zenocap.common.formats.import_format import import_format_of
from zenocap.common.formats.mot import Mot, read_mot
from zenocap.common.formats.motion_files import centre_suffixes, needed_centres, poses_of_centres, read_centres
from zenocap.common.formats.opensim_coordinates import rotations_of
from zenocap.common.formats.pose_track import PoseTrack, every_frame
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import MATRICES, Trajectories

SIDES = ("right", "left")
# Of trunk and lower legs in the rest pose, for an upright one; chosen by hand, for skeletons in T- and A-pose.
MOST_LEAN_DEG = 20.0
SOURCES = {"right_ankle": "RToe", "left_ankle": "LToe", "neck": "Head"}  # centres without which a joint is not measured


@dataclass(frozen=True)
class BvhPoses:
    """Poses of a BVH file: joint centres, and orientations of segments, see `segment_rotations`."""

    centres: Trajectories
    segments: Mapping[str, Floats]


AngleSource: TypeAlias = PoseTrack | Trajectories | BvhPoses | Mot


@dataclass(frozen=True)
class AngleSeries:
    """Angles of n rows.

    frames: (n,) numbers, rising; of a .mot, time times rate.  times_s: (n,) seconds; of a take since frame 0.
    known: (n,) whether a row has a pose.  angles: by name (see `clinical_angles`), (n,) degrees, NaN where not defined.
    rate: rows per second.  notes: assumptions made while reading.
    """

    frames: Ints
    times_s: Floats
    known: Bools
    angles: Mapping[str, Floats]
    rate: float
    notes: tuple[str, ...] = ()


def read_source(path: Path) -> AngleSource:
    """Poses, joint centres or coordinates of a file, by its suffix, see `angle_suffixes`.  Raises UserError."""
    match path.suffix.lower():
        case ".mot":
            return read_mot(path)
        case ".bvh":
            bvh = read_bvh(path)
            return BvhPoses(centres_of(bvh, path), segment_rotations(bvh, path))
        case ".mcap":
            return filled(read_poses(path).track())
    if import_format_of(path) is not None:
        return read_centres(path)
    raise UserError(f"{path}: suffix {path.suffix!r}: allowed: {', '.join(angle_suffixes())}")


def angle_suffixes() -> tuple[str, ...]:
    """Suffixes of files with joint angles, or with joint centres that give them."""
    return (".mot", *centre_suffixes())


def filled(track: PoseTrack) -> PoseTrack:
    """Track with a row, empty if need be, for each frame from its first to its last."""
    return every_frame(track, int(track.frames[0]))


def has_rigid_trunk(source: AngleSource) -> bool:
    """Whether the trunk is one part: poses of ten parts, and joint centres without `Waist`."""
    match source:
        case PoseTrack():
            return source.anatomy is TEN_PARTS
        case Trajectories():
            return "Waist" not in source.names
    return False


def angle_series(source: AngleSource, path: Path, *, rigid_trunk: bool) -> AngleSeries:
    """Angles of a file's poses.  path: for errors.  Raises UserError.

    rigid_trunk: measure hips and shoulders against a trunk that is one part, for comparison with poses that have no more.
    """
    match source:
        case Mot():
            rotations, notes = rotations_of(source, path)
            rotations = with_rigid_trunk(rotations) if rigid_trunk else rotations
            frames = np.round(source.times_s * source.rate).astype(np.int64)
            known = np.ones(len(frames), dtype=bool)
            return AngleSeries(frames, source.times_s, known, clinical_angles(rotations), source.rate, notes)
        case Trajectories():
            return _of_centres(source, {}, path, rigid_trunk)
        case BvhPoses():
            found = _of_centres(source.centres, source.segments, path, rigid_trunk)
            note = f"the rest pose of {path.name} is not upright: pelvis, trunk, head and feet are from joint centres"
            return found if source.segments or rigid_trunk else replace(found, notes=(*found.notes, note))
        case PoseTrack() if rigid_trunk and not has_rigid_trunk(source):
            return _of_centres(source.trajectories(), {}, path, rigid_trunk)
        case PoseTrack():
            angles = clinical_angles(joint_rotations(source.anatomy, source.angles))
            return AngleSeries(source.frames, source.times_s, source.known, angles, source.rate)


def _of_centres(data: Trajectories, segments: Mapping[str, Floats], path: Path, rigid_trunk: bool) -> AngleSeries:
    """Angles from joint centres.  segments: orientations that replace those from centres, unless the trunk is rigid."""
    centres, anatomy = needed_centres(path, data), TEN_PARTS if rigid_trunk else FOURTEEN_PARTS
    poses = poses_of_centres(path, anatomy, centres)
    known: Bools = np.all(np.isfinite(np.stack([centres[name] for name in NEEDED])), axis=(0, 2))
    values = np.where(known[:, None], np.array([pose.angles for pose in poses]), np.nan)
    rotations: JointRotations = joint_rotations(anatomy, values)
    if segments and not rigid_trunk:
        rotations = _with_segments(rotations, segments)
    else:
        rotations = {joint: value for joint, value in rotations.items() if SOURCES.get(joint, NEEDED[0]) in centres}
    return AngleSeries(data.frames, data.times_s, known, clinical_angles(rotations), data.rate)


def _with_segments(rotations: JointRotations, segments: Mapping[str, Floats]) -> dict[str, Floats]:
    """Joint rotations with other orientations of pelvis, trunk, head and feet, and those of the limbs in the world."""
    pelvis, trunk = segments["pelvis"], segments["trunk"]
    result = {"pelvis": pelvis, "trunk_inclination": trunk, "trunk": _relative(pelvis, trunk)}
    result["neck"] = _relative(trunk, segments["head"])
    for side in SIDES:
        thigh = rotations["pelvis"] @ rotations[f"{side}_hip"]
        shank = thigh @ rotations[f"{side}_knee"]
        arm = rotations["trunk_inclination"] @ rotations[f"{side}_shoulder"]
        result[f"{side}_hip"], result[f"{side}_shoulder"] = _relative(pelvis, thigh), _relative(trunk, arm)
        result[f"{side}_knee"], result[f"{side}_elbow"] = rotations[f"{side}_knee"], rotations[f"{side}_elbow"]
        result[f"{side}_ankle"] = _relative(shank, segments[f"{side}_foot"])
    return result


def _relative(parent: Floats, child: Floats) -> Floats:
    """Rotations (n, 3, 3), child to parent, of orientations (n, 3, 3) in the world."""
    relative: Floats = np.swapaxes(parent, 1, 2) @ child
    return relative


def segment_rotations(file: Bvh, path: Path) -> dict[str, Floats]:
    """Rotations (n, 3, 3) to the world of `pelvis`, `trunk`, `head`, `right_foot`, `left_foot`, in JointRotations' axes.

    Joint centres alone do not give them: the rest pose (all rotations zero) is the neutral one if it is upright, else the
    result is empty.  path: for errors.  Raises UserError for joints without a known name.
    """
    at = joint_roles(file, path)
    to_y_up = to_y_up_of({role: file.points[:, k] for role, k in at.items()})
    rest = _rest_points(file) @ to_y_up.T
    place = {role: rest[k] for role, k in at.items()}
    up = np.array([0.0, 1.0, 0.0])
    trunk = place["RShoulder"] + place["LShoulder"] - place["RHip"] - place["LHip"]
    shanks = [place[f"{side}Knee"] - place[f"{side}Ankle"] for side in "RL"]
    lean = max(float(np.degrees(np.arccos(np.clip(unit(line) @ up, -1.0, 1.0)))) for line in (trunk, *shanks))
    if lean > MOST_LEAN_DEG:
        return {}
    right = unit(perpendicular(place["RHip"] - place["LHip"], up))
    rest_axes = np.stack([np.cross(up, right), up, right], axis=-1)
    bones = {
        "pelvis": common_ancestor(file.parents, at["RHip"], at["LHip"]),
        "trunk": common_ancestor(file.parents, at["RShoulder"], at["LShoulder"]),
        "head": at["Head"],
        "right_foot": at["RAnkle"],
        "left_foot": at["LAnkle"],
    }
    world = MATRICES["opensim"]
    return {name: world @ to_y_up @ file.rotations[:, bone] @ to_y_up.T @ rest_axes for name, bone in bones.items()}


def _rest_points(file: Bvh) -> Floats:
    """Positions (joints, 3) in the rest pose, the root at the origin, in the file's axes and unit."""
    rest = np.zeros((len(file.names), 3))
    for k, parent in enumerate(file.parents):
        if parent >= 0:
            rest[k] = rest[parent] + file.rotations[0, parent].T @ (file.points[0, k] - file.points[0, parent])
    return rest
