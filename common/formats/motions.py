"""The poses of any file of motion for an anatomy: motion capture, trajectories of joint centres, takes."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of, unwound
from common.body.definition import Pose
from common.body.from_centres import NEEDED, poses_from_centres
from common.formats.bvh_roles import read_bvh_centres
from common.formats.poses import read_poses
from common.formats.track import PoseTrack, every_frame
from common.formats.trc import FormatError, Trajectories, read_trc

FORMATS = (".bvh", ".trc", ".mcap")
MAX_GAP_S = 0.25  # nothing is made up across a longer gap
FASTEST = (
    30.0  # rad/s about one axis: nobody's joint turns faster, so that what comes before in the first rows is a rest pose
)
REST_ROWS = 5


@dataclass(frozen=True)
class Motion:
    """The n poses of consecutive frames of a file.

    rate: frames per second.  times_s: (n,) seconds as the file counts them: of a take since its frame 0, of a TRC its
    column Time, of a BVH since its first frame.  poses: None where there is none.  known: (n,) False also where a pose
    only bridges a gap of more than MAX_GAP_S.
    """

    name: str
    rate: float
    times_s: Floats
    poses: tuple[Pose | None, ...]
    known: NDArray[np.bool_]


def read_poses_for(path: Path, anatomy: Anatomy, frames: range | None = None) -> Motion:
    """The motion in a .bvh, a .trc (HALPE names) or a take (.mcap), for an anatomy; its name is that of the file.

    frames: only those; frame numbers of the file, without step.  A rest pose that a file of motion capture begins with is
    no pose of the motion.  Raises FormatError, and TakeError for a .mcap that is no take.
    """
    match path.suffix.lower():
        case ".bvh":
            return _of_centres(path, read_bvh_centres(path), anatomy, frames)
        case ".trc":
            return _of_centres(path, read_trc(path), anatomy, frames)
        case ".mcap":
            track = every_frame(read_poses(path).track(), 0)
            if track.anatomy is not anatomy:
                return _of_centres(path, track.trajectories(), anatomy, frames)
            return _of_track(path, track, frames)
    raise FormatError(f"{path}: suffix {path.suffix!r}: allowed: {', '.join(FORMATS)}")


def read_centres(path: Path) -> Trajectories:
    """The joint centres (HALPE names) in a .bvh, a .trc or a take (.mcap), by the same clock as `read_poses_for`.

    Raises FormatError, and TakeError for a .mcap that is no take.
    """
    match path.suffix.lower():
        case ".bvh":
            return read_bvh_centres(path)
        case ".trc":
            return read_trc(path)
        case ".mcap":
            return every_frame(read_poses(path).track(), 0).trajectories()
    raise FormatError(f"{path}: suffix {path.suffix!r}: allowed: {', '.join(FORMATS)}")


def _of_centres(path: Path, data: Trajectories, anatomy: Anatomy, frames: range | None) -> Motion:
    rows = _rows(path, data.frames, frames)
    centres = {name: data.points[rows, k] for k, name in enumerate(data.names)}
    missing = [name for name in NEEDED if name not in centres]
    if missing:
        raise FormatError(f"{path}: no marker {', '.join(missing)}; there are: {', '.join(data.names)}")
    rate = _rate(path, data.rate)
    try:
        poses = poses_from_centres(anatomy, centres)
        rest = _rest_rows(anatomy, poses, rate)
        if rest:
            poses = poses_from_centres(anatomy, {name: points[rest:] for name, points in centres.items()})
    except ValueError as error:
        raise FormatError(f"{path}: {error}") from error
    known = ~_in_gaps(centres, rate)
    known[:rest] = False
    return Motion(path.stem, rate, data.times_s[rows], (*[None] * rest, *poses), known)


def _rest_rows(anatomy: Anatomy, poses: list[Pose], rate: float) -> int:
    """How many of the first rows come before a leap of some joint, other than the root."""
    table = coordinates_of(anatomy)
    first = unwound(anatomy, np.array([table.of_pose(pose) for pose in poses[: REST_ROWS + 1]]))
    leaps = np.flatnonzero((np.abs(np.diff(first, axis=0)) * rate > FASTEST).any(axis=1))
    return int(leaps[-1]) + 1 if len(leaps) else 0


def _of_track(path: Path, track: PoseTrack, frames: range | None) -> Motion:
    rows = _rows(path, track.frames, frames)
    known = track.known[rows]
    if not known.any():
        raise FormatError(f"{path}: the person is lost in every frame of {frames or 'the take'}: no motion")
    poses = tuple(track.pose(int(row)) if there else None for row, there in zip(rows, known, strict=True))
    return Motion(path.stem, _rate(path, track.rate), track.times_s[rows], poses, known)


def _rows(path: Path, numbers: NDArray[np.int64], frames: range | None) -> NDArray[np.int64]:
    wanted = np.ones(len(numbers), dtype=bool) if frames is None else np.isin(numbers, np.array(frames, dtype=np.int64))
    if not wanted.any():
        has = f"{numbers[0]} to {numbers[-1]}" if len(numbers) else "none"
        raise FormatError(f"{path}: no frame of {frames or 'any number'}: allowed: of its frames, {has}")
    return np.flatnonzero(wanted)


def _rate(path: Path, rate: float) -> float:
    if not rate > 0.0:
        raise FormatError(f"{path}: rate = {rate}: allowed: more than 0 frames per second; two frames or more")
    return rate


def _in_gaps(centres: Mapping[str, Floats], rate: float) -> NDArray[np.bool_]:
    """(n,) rows in which a needed centre is unknown, and it is for longer than MAX_GAP_S."""
    gaps = np.zeros(len(next(iter(centres.values()))), dtype=bool)
    for name in NEEDED:
        known = np.flatnonzero(np.isfinite(centres[name]).all(axis=1))
        edges = np.concatenate([[-1], known, [len(gaps)]])
        for before, after in pairwise(edges):
            at_an_end = before < 0 or after == len(gaps)
            if after - before > 1 and (at_an_end or after - before > MAX_GAP_S * rate):
                gaps[before + 1 : after] = True
    return gaps
