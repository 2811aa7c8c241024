"""Motion to learn from, as coordinates of poses: from files of motion capture, from takes, from the synthetic actor."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.actor.person import person
from common.actor.repertoire import performance
from common.actor.truth import landmarks
from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Pose
from common.body.from_centres import NEEDED, poses_from_centres
from common.formats.bvh_roles import read_bvh_centres
from common.formats.poses import read_poses
from common.formats.track import PoseTrack, every_frame
from common.formats.trc import FormatError, Trajectories, read_trc

FORMATS = (".bvh", ".trc", ".mcap")
MAX_GAP_S = 0.25  # nothing is made up across a longer gap
FASTEST = 30.0  # rad/s: nobody's joint turns faster, so that what comes before in the first rows is a rest pose
REST_ROWS = 5


@dataclass(frozen=True)
class Motion:
    """coordinates: (n, d) radians in the order of `coordinates_of(anatomy).names`, one row a frame, without jumps; NaN
    where there is no pose.  rate: frames per second."""

    name: str
    rate: float
    coordinates: Floats


def read_motion(path: Path, anatomy: Anatomy, frames: range | None = None) -> Motion:
    """The motion in a .bvh, a .trc (HALPE names) or a take (.mcap), for an anatomy; its name is that of the file.

    frames: only those; frame numbers of the file, without step.  A rest pose that a file of motion capture begins with is
    no pose of the motion.  Raises FormatError, and TakeError for a .mcap that is
    no take.
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


def motion_of(name: str, rate: float, anatomy: Anatomy, poses: list[Pose]) -> Motion:
    """The poses of consecutive frames as a motion."""
    table = coordinates_of(anatomy)
    return Motion(name, rate, unwound(anatomy, np.array([table.of_pose(pose) for pose in poses])))


def actor_motion(kind: str, person_seed: int, seed: int, anatomy: Anatomy, rate: float = 60.0) -> Motion:
    """About half a minute of the synthetic actor: `walking`, `running`, `boxing` or `general`.

    person_seed: who.  seed: which performance.  Both 0 or more.  Raises ValueError for another kind.
    """
    somebody = person(person_seed)
    acted = performance(somebody, kind, seed)
    frames = [landmarks(somebody, acted.pose_at(k / rate)) for k in range(int(acted.duration_s * rate))]
    centres = {name: np.array([points[name] for points in frames]) for name in frames[0]}
    return motion_of(f"actor-{kind}-{person_seed}-{seed}", rate, anatomy, poses_from_centres(anatomy, centres))


def unwound(anatomy: Anatomy, coordinates: Floats) -> Floats:
    """The same rotations (n, d), every rotation vector as near as can be to that of the row before.

    A rotation by more than half a turn about one axis is one by less about the opposite axis; a motion that comes there
    goes on instead of jumping.
    """
    table, result = coordinates_of(anatomy), coordinates.copy()
    for first, joint in zip(table.first, anatomy.joints, strict=True):
        if first < 0 or len(joint.axes) != 3:
            continue
        near = np.zeros(3)
        for row in result[:, first : first + 3]:
            angle = float(np.linalg.norm(row))
            if not np.isfinite(angle):
                continue
            if angle > 1e-9:
                axis = row / angle
                row += 2.0 * np.pi * np.round((float(axis @ near) - angle) / (2.0 * np.pi)) * axis
            near = row
    return result


def _of_centres(path: Path, data: Trajectories, anatomy: Anatomy, frames: range | None) -> Motion:
    rows = _rows(path, data.frames, frames)
    centres = {name: data.points[rows, k] for k, name in enumerate(data.names)}
    missing = [name for name in NEEDED if name not in centres]
    if missing:
        raise FormatError(f"{path}: no marker {', '.join(missing)}; there are: {', '.join(data.names)}")
    rate = _rate(path, data.rate)
    try:
        found = motion_of(path.stem, rate, anatomy, poses_from_centres(anatomy, centres)).coordinates
        rest = _rest_rows(found, rate)
        if rest:
            later = {name: points[rest:] for name, points in centres.items()}
            found[:rest] = np.nan
            found[rest:] = motion_of(path.stem, rate, anatomy, poses_from_centres(anatomy, later)).coordinates
    except ValueError as error:
        raise FormatError(f"{path}: {error}") from error
    found[_in_gaps(centres, rate)] = np.nan
    return Motion(path.stem, rate, found)


def _rest_rows(coordinates: Floats, rate: float) -> int:
    leaps = np.flatnonzero((np.abs(np.diff(coordinates[: REST_ROWS + 1], axis=0)) * rate > FASTEST).any(axis=1))
    return int(leaps[-1]) + 1 if len(leaps) else 0


def _of_track(path: Path, track: PoseTrack, frames: range | None) -> Motion:
    rows = _rows(path, track.frames, frames)
    known = rows[track.known[rows]]
    if not len(known):
        raise FormatError(f"{path}: the person is lost in every frame of {frames or 'the take'}: no motion")
    table = coordinates_of(track.anatomy)
    coordinates = np.full((len(rows), table.dimension), np.nan)
    poses = np.array([table.of_pose(track.pose(int(row))) for row in known])
    coordinates[np.searchsorted(rows, known)] = unwound(track.anatomy, poses)
    return Motion(path.stem, _rate(path, track.rate), coordinates)


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
