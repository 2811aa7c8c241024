"""`zenocap export`: a take in the formats of other programs."""

from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Literal

import numpy as np

from common.formats.axes import Axes, Unit
from common.formats.csv import Angle, write_csv
from common.formats.poses import read_poses
from common.formats.resampling import resampled
from common.formats.track import Bound, PoseTrack, between, every_frame
from common.formats.trc import FormatError, write_trc

Format = Literal["trc", "bvh", "c3d", "csv"]
UNITS: dict[Format, Unit] = {"trc": "m", "bvh": "cm", "c3d": "mm", "csv": "m"}  # each one's customary
NUMBERED: tuple[Format, ...] = ("trc", "csv")  # rows say which frame they are; of the others row k is frame k


@dataclass(frozen=True)
class Wanted:
    """first, last: of the take's frames, both included.  fps: resample to it.  unit: None for the format's customary."""

    to: Format
    first: Bound | None = None
    last: Bound | None = None
    fps: float | None = None
    axes: Axes = "y-up"
    unit: Unit | None = None
    angle: Angle = "deg"


@dataclass(frozen=True)
class Exported:
    """What was written.  first, last: frame numbers.  empty: rows without pose, held ones in BVH.

    cut: what is missing of the take, None when it is whole.
    """

    rows: int
    first: int
    last: int
    rate: float
    unit: Unit
    empty: int
    cut: str | None


def export(take: Path, output: Path, wanted: Wanted) -> Exported:
    """Write the poses of `take` to `output`, which appears whole or not at all.  Raises FormatError and TakeError."""
    poses = read_poses(take)
    track = selected(poses.track(), wanted)
    unit = wanted.unit or UNITS[wanted.to]
    try:
        _write(output, track, wanted, unit)
    except OSError as error:
        raise FormatError(f"{output}: cannot be written: {error.strerror or error}") from error
    empty = int(np.count_nonzero(~track.known))
    return Exported(len(track.frames), int(track.frames[0]), int(track.frames[-1]), track.rate, unit, empty, poses.cut)


def selected(take: PoseTrack, wanted: Wanted) -> PoseTrack:
    """The rows that are written: the part that is wanted, resampled, and without holes where rows have no numbers."""
    track = between(take, wanted.first, wanted.last)
    if wanted.fps:
        track = resampled(track, wanted.fps)
    if wanted.to in NUMBERED:
        return track
    first = 0
    if wanted.first is not None:
        start_s = wanted.first.value if wanted.first.seconds else wanted.first.value / (take.rate or 1.0)
        first = min(max(0, ceil(start_s * track.rate - 1e-6)), int(track.frames[0]))
    return every_frame(track, first)


def _write(output: Path, track: PoseTrack, wanted: Wanted, unit: Unit) -> None:
    match wanted.to:
        case "trc":
            write_trc(output, track.trajectories(), axes=wanted.axes, unit=unit)
        case "csv":
            write_csv(output, track, axes=wanted.axes, unit=unit, angle=wanted.angle)
        case "bvh":
            from common.formats.bvh import write_bvh

            write_bvh(output, track, axes=wanted.axes, unit=unit)
        case "c3d":
            from common.formats.c3d import write_c3d

            write_c3d(output, track.trajectories(), axes=wanted.axes, unit=unit)
