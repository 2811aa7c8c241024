"""Poses and joint centres of motion files: BVH, TRC, C3D, takes."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of, unwrap_rotations
from zenocap.common.body.definition import Pose
from zenocap.common.body.inverse_kinematics import NEEDED, poses_from_centres
from zenocap.common.errors import UserError
from zenocap.common.formats.c3d_reader import read_c3d
from zenocap.common.formats.import_format import import_format_of, import_suffixes
from zenocap.common.formats.joint_map import UPS, JointMap
from zenocap.common.formats.marker_sets import named_centres
from zenocap.common.formats.pose_track import PoseTrack, every_frame
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import Trajectories, with_absent_rows
from zenocap.common.formats.trc import read_trc

MAX_GAP_S = 0.25  # longest gap in joint centres that poses bridge as known; chosen by hand
FASTEST = 30.0  # rad/s about one axis, faster than human joints: a leap from a rest pose in the first rows; chosen by hand
REST_ROWS = 5  # searched for a leap; chosen by hand


@dataclass(frozen=True)
class FileMotion:
    """Poses of n consecutive frames of a file.

    rate: frames per second.  times_s: (n,) seconds: of a take and a C3D since frame 0, of a TRC its column Time, of a BVH
    since its first frame.  poses: None for rows without.  known: (n,) False also where a pose bridges a gap longer than
    MAX_GAP_S.
    """

    name: str
    rate: float
    times_s: Floats
    poses: tuple[Pose | None, ...]
    known: Bools


def read_poses_for(path: Path, anatomy: Anatomy, frames: range | None = None, joints: JointMap | None = None) -> FileMotion:
    """Motion in a file of the import formats or a take (.mcap) for an anatomy; its name is the file's stem.

    frames: frame numbers of the file, without step; default: all.  joints: see `read_centres`.  A rest pose at the
    beginning of a file of motion capture is left out.  Raises UserError, also for a .mcap that is no take.
    """
    if path.suffix.lower() != ".mcap":
        return _of_centres(path, read_centres(path, joints), anatomy, frames)
    track = every_frame(read_poses(path).track(), 0)
    if track.anatomy is not anatomy:
        return _of_centres(path, track.trajectories(), anatomy, frames)
    return _of_track(path, track, frames)


def read_centres(path: Path, joints: JointMap | None = None) -> Trajectories:
    """Joint centres (HALPE names) in a file of the import formats or a take (.mcap), with the times of `read_poses_for`.

    joints: names of joints and markers that are not recognized; not used for takes.  Raises UserError, also for a .mcap
    that is no take.
    """
    if path.suffix.lower() == ".mcap":
        return every_frame(read_poses(path).track(), 0).trajectories()
    if (found := import_format_of(path)) is None:
        raise UserError(f"{path}: suffix {path.suffix!r}: allowed: {', '.join(centre_suffixes())}")
    return found.centres(path, joints)


def centre_suffixes() -> tuple[str, ...]:
    """Suffixes of files with joint centres: of the import formats, and of takes."""
    return (*import_suffixes(), ".mcap")


def trc_centres(path: Path, joints: JointMap | None) -> Trajectories:
    """Joint centres of a TRC file.  Raises UserError."""
    return named_centres(read_trc(path), path, UPS.index("y"), joints)


def c3d_centres(path: Path, joints: JointMap | None) -> Trajectories:
    """Joint centres of a C3D file.  Raises UserError."""
    return named_centres(read_c3d(path), path, UPS.index("z"), joints)


def _of_centres(path: Path, data: Trajectories, anatomy: Anatomy, frames: range | None) -> FileMotion:
    data = with_absent_rows(data)
    rows = _rows(path, data.frames, frames)
    centres = {name: points[rows] for name, points in needed_centres(path, data).items()}
    rate = _rate(path, data.rate)
    poses = poses_of_centres(path, anatomy, centres)
    if rest := _rest_rows(anatomy, poses, rate):
        poses = poses_of_centres(path, anatomy, {name: points[rest:] for name, points in centres.items()})
    known = ~_in_gaps(centres, rate)
    known[:rest] = False
    return FileMotion(path.stem, rate, data.times_s[rows], (*[None] * rest, *poses), known)


def needed_centres(path: Path, data: Trajectories) -> dict[str, Floats]:
    """Joint centres (n, 3) by name, those of NEEDED among them.  path: for errors.  Raises UserError."""
    if missing := [name for name in NEEDED if name not in data.names]:
        raise UserError(f"{path}: no marker {', '.join(missing)}; there are: {', '.join(data.names)}")
    return {name: data.points[:, k] for k, name in enumerate(data.names)}


def poses_of_centres(path: Path, anatomy: Anatomy, centres: Mapping[str, Floats]) -> list[Pose]:
    """Poses by inverse kinematics.  path: for errors.  Raises UserError."""
    try:
        return poses_from_centres(anatomy, centres)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def _rest_rows(anatomy: Anatomy, poses: list[Pose], rate: float) -> int:
    """Number of first rows before a leap of any joint except the root."""
    table = coordinates_of(anatomy)
    first = unwrap_rotations(anatomy, np.array([table.of_pose(pose) for pose in poses[: REST_ROWS + 1]]))
    leaps = np.flatnonzero((np.abs(np.diff(first, axis=0)) * rate > FASTEST).any(axis=1))
    return int(leaps[-1]) + 1 if len(leaps) else 0


def _of_track(path: Path, track: PoseTrack, frames: range | None) -> FileMotion:
    rows = _rows(path, track.frames, frames)
    known = track.known[rows]
    if not known.any():
        raise UserError(f"{path}: the person is lost in every frame of {frames or 'the take'}")
    poses = tuple(track.pose(int(row)) if has_pose else None for row, has_pose in zip(rows, known, strict=True))
    return FileMotion(path.stem, _rate(path, track.rate), track.times_s[rows], poses, known)


def _rows(path: Path, numbers: Ints, frames: range | None) -> Ints:
    selected = np.ones(len(numbers), dtype=bool) if frames is None else np.isin(numbers, np.array(frames, dtype=np.int64))
    if not selected.any():
        range_text = f"{numbers[0]} to {numbers[-1]}" if len(numbers) else "none"
        raise UserError(f"{path}: no frame of {frames or 'any number'}: allowed: of its frames, {range_text}")
    return np.flatnonzero(selected)


def _rate(path: Path, rate: float) -> float:
    if not rate > 0.0:
        raise UserError(f"{path}: rate = {rate}: allowed: more than 0 frames per second; two frames or more")
    return rate


def _in_gaps(centres: Mapping[str, Floats], rate: float) -> Bools:
    """(n,) whether a needed centre is unknown in a gap longer than MAX_GAP_S or at an end."""
    gaps = np.zeros(len(next(iter(centres.values()))), dtype=bool)
    for name in NEEDED:
        known = np.flatnonzero(np.isfinite(centres[name]).all(axis=1))
        edges = np.concatenate([[-1], known, [len(gaps)]])
        for before, after in pairwise(edges):
            at_an_end = before < 0 or after == len(gaps)
            if after - before > 1 and (at_an_end or after - before > MAX_GAP_S * rate):
                gaps[before + 1 : after] = True
    return gaps
