"""A pose track: the poses of one person as arrays, a row per frame, which is all that the formats know."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.kinematics import joint_centres
from common.formats.trc import FormatError, Trajectories

MAX_LEADING = 100_000  # rows before the first pose, in formats whose rows have no numbers


@dataclass(frozen=True)
class PoseTrack:
    """A person's poses, n rows.

    frames: (n,) frame numbers, rising.  times_s: (n,) seconds since frame 0.
    positions: (n, 3) navel in the world, metres, Y up.  angles: (n, angles) radians, ordered by `Anatomy.angles`.
    Both are NaN where the person is lost.  scores, views: by viewer, (n,) Eq. 1, NaN if unknown, and what it saw, "" if
    unknown.  lost: per row what is being searched for again.  rate: frames per second, 0 when it cannot be told.
    """

    anatomy: Anatomy
    bdp: Bdp
    frames: NDArray[np.int64]
    times_s: Floats
    positions: Floats
    angles: Floats
    scores: Mapping[str, Floats]
    views: Mapping[str, tuple[str, ...]]
    lost: tuple[str, ...]
    rate: float

    @property
    def known(self) -> NDArray[np.bool_]:
        """(n,) whether there is a pose."""
        known: NDArray[np.bool_] = ~np.isnan(self.positions[:, 0])
        return known

    def pose(self, row: int) -> Pose:
        return Pose(self.positions[row], self.angles[row])

    def trajectories(self) -> Trajectories:
        """Joint centres, NaN where the person is lost."""
        points = np.full((len(self.frames), len(self.anatomy.markers), 3), np.nan)
        for row in np.flatnonzero(self.known):
            points[row] = joint_centres(self.anatomy, self.bdp, self.pose(int(row)))
        names = tuple(marker.name for marker in self.anatomy.markers)
        return Trajectories(names, self.frames, self.times_s, points, round(self.rate, 3))

    def rows(self, indices: NDArray[np.int64]) -> "PoseTrack":
        """The rows at `indices` (m,); -1 makes an empty row, whose frame and time are still to be set."""
        there = indices >= 0
        at = np.where(there, indices, 0)
        return replace(
            self,
            frames=self.frames[at],
            times_s=self.times_s[at],
            positions=np.where(there[:, None], self.positions[at], np.nan),
            angles=np.where(there[:, None], self.angles[at], np.nan),
            scores={viewer: np.where(there, score[at], np.nan) for viewer, score in self.scores.items()},
            views={v: tuple(view[i] if i >= 0 else "" for i in indices) for v, view in self.views.items()},
            lost=tuple(self.lost[i] if i >= 0 else "person" for i in indices),
        )


def rate_of(frames: NDArray[np.int64], times_s: Floats) -> float:
    """Frames per second, 0 when one row does not tell; over all rows, because single times may jitter."""
    span = float(times_s[-1] - times_s[0]) if len(frames) > 1 else 0.0
    return float(frames[-1] - frames[0]) / span if span > 0 else 0.0


@dataclass(frozen=True)
class Bound:
    """One end of a range: a frame number, or seconds since frame 0."""

    value: float
    seconds: bool = False


def between(track: PoseTrack, first: Bound | None, last: Bound | None) -> PoseTrack:
    """The rows from `first` to `last`, both included.  Raises FormatError when there are none."""
    wanted = np.ones(len(track.frames), dtype=bool)
    for bound, sign in ((first, 1), (last, -1)):
        if bound is not None:
            values = track.times_s + sign * 1e-6 if bound.seconds else track.frames
            wanted &= sign * values >= sign * bound.value
    if not wanted.any():
        has = f"frames {track.frames[0]} to {track.frames[-1]}, {track.times_s[0]:.2f}s to {track.times_s[-1]:.2f}s"
        raise FormatError(f"--from and --until leave no frame: allowed: {has}")
    return track.rows(np.flatnonzero(wanted))


def every_frame(track: PoseTrack, first: int = 0) -> PoseTrack:
    """One row for each frame from `first` to the last, so that row k is frame first + k; those without pose are empty.

    For formats whose rows have no numbers.  Raises FormatError when more than 100 000 would come before the first pose.
    """
    if track.frames[0] - first > MAX_LEADING:
        raise FormatError(f"the first pose is of frame {track.frames[0]}, and rows count from {first}: give --from")
    frames = np.arange(first, track.frames[-1] + 1, dtype=np.int64)
    at = np.clip(np.searchsorted(track.frames, frames), 0, len(track.frames) - 1)
    indices = np.where(track.frames[at] == frames, at, -1)
    counted = track.times_s[0] + (frames - track.frames[0]) / (track.rate or 1.0)
    times_s = np.where(indices >= 0, track.times_s[at], counted)
    return replace(track.rows(indices), frames=frames, times_s=times_s)


def holding(track: PoseTrack) -> PoseTrack:
    """Every empty row takes the pose before it, the first ones that after them; for formats without blanks."""
    known = np.flatnonzero(track.known)
    if not len(known):
        raise FormatError("the person is lost in every frame: no pose to hold")
    at = known[np.clip(np.searchsorted(known, np.arange(len(track.frames)), side="right") - 1, 0, None)]
    return replace(track, positions=track.positions[at], angles=track.angles[at])
