"""Pose tracks: the poses of one person as arrays, one row per frame, the input of all exports."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.joint_conventions import Convention, limb_of
from zenocap.common.body.keypoints import keypoints
from zenocap.common.errors import UserError
from zenocap.common.formats.trajectories import Trajectories

MAX_LEADING = 100_000  # empty rows before the first pose, in formats without frame numbers; chosen by hand


@dataclass(frozen=True)
class PoseTrack:
    """A person's poses, n rows.

    frames: (n,) frame numbers, rising.  times_s: (n,) seconds since frame 0.
    positions: (n, 3) navel in the world, metres, Y up.  angles: (n, angles) radians, ordered by `Anatomy.angles`.
    Both are NaN where the person is lost.  scores: by viewer, (n,) matching score (Eq. 1), NaN if unknown.
    views: by viewer, role in each row, "" if unknown.  lost: in each row, limbs that are being relocalized, or "person".
    rate: frames per second, 0 if unknown.  limbs: by limb, (n,) probability that it is right, NaN if unknown; empty where
    no pose states it.
    """

    anatomy: Anatomy
    bdp: Bdp
    frames: Ints
    times_s: Floats
    positions: Floats
    angles: Floats
    scores: Mapping[str, Floats]
    views: Mapping[str, tuple[str, ...]]
    lost: tuple[str, ...]
    rate: float
    limbs: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def known(self) -> Bools:
        """(n,) whether a row has a pose."""
        known: Bools = ~np.isnan(self.positions[:, 0])
        return known

    @property
    def step_s(self) -> float:
        """Median interval of the rows, seconds; 0 for one row."""
        return float(np.median(np.diff(self.times_s))) if len(self.times_s) > 1 else 0.0

    def pose(self, row: int) -> Pose:
        return Pose(self.positions[row], self.angles[row])

    def trajectories(
        self, joints: Convention = "zenocap", min_confidence: float = 0.0, *, spine: bool = False
    ) -> Trajectories:
        """Points of a joint convention, NaN where the person is lost.

        min_confidence: points of a limb are NaN where its probability to be right is less.  spine: see `points_of`.
        """
        body = keypoints(joints, self.anatomy, self.bdp, spine=spine)
        points = np.full((len(self.frames), len(body.names), 3), np.nan)
        for row in np.flatnonzero(self.known):
            points[row] = body.at(self.pose(int(row)))
        for limb, confidence in self.limbs.items():
            of_limb = np.array([limb_of(name) == limb for name in body.names])
            points[(confidence < min_confidence)[:, None] & of_limb] = np.nan
        return Trajectories(body.names, self.frames, self.times_s, points, round(self.rate, 3))

    def rows(self, indices: Ints) -> "PoseTrack":
        """Track of the rows at `indices` (m,); -1 gives an empty row, whose frame and time the caller sets."""
        present = indices >= 0
        at = np.where(present, indices, 0)
        return replace(
            self,
            frames=self.frames[at],
            times_s=self.times_s[at],
            positions=np.where(present[:, None], self.positions[at], np.nan),
            angles=np.where(present[:, None], self.angles[at], np.nan),
            scores={viewer: np.where(present, score[at], np.nan) for viewer, score in self.scores.items()},
            views={v: tuple(view[i] if i >= 0 else "" for i in indices) for v, view in self.views.items()},
            lost=tuple(self.lost[i] if i >= 0 else "person" for i in indices),
            limbs={limb: np.where(present, values[at], np.nan) for limb, values in self.limbs.items()},
        )


def rate_of(frames: Ints, times_s: Floats) -> float:
    """Mean frames per second over all rows, 0 for a single row."""
    span = float(times_s[-1] - times_s[0]) if len(frames) > 1 else 0.0
    return float(frames[-1] - frames[0]) / span if span > 0 else 0.0


@dataclass(frozen=True)
class Bound:
    """One end of a range: a frame number, or seconds since frame 0."""

    value: float
    seconds: bool = False


def inside(frames: Ints, times_s: Floats, first: Bound | None, last: Bound | None) -> Bools:
    """(n,) whether each row is between `first` and `last`, inclusive; None for an open end."""
    found = np.ones(len(frames), dtype=bool)
    for bound, sign in ((first, 1), (last, -1)):
        if bound is not None:
            values = times_s + sign * 1e-6 if bound.seconds else frames
            found &= sign * values >= sign * bound.value
    return found


def between(track: PoseTrack, first: Bound | None, last: Bound | None) -> PoseTrack:
    """Return the rows from `first` to `last`, inclusive.  Raises UserError when there are none."""
    selected = inside(track.frames, track.times_s, first, last)
    if not selected.any():
        range_text = f"frames {track.frames[0]} to {track.frames[-1]}, {track.times_s[0]:.2f}s to {track.times_s[-1]:.2f}s"
        raise UserError(f"--from and --until leave no frame: allowed: {range_text}")
    return track.rows(np.flatnonzero(selected))


def every_frame(track: PoseTrack, first: int = 0) -> PoseTrack:
    """Return one row for each frame from `first` to the last; row k is frame first + k, empty without a pose.

    Times of absent frames are between those of their neighbours.  For formats without frame numbers.  Raises UserError for
    more than MAX_LEADING rows before the first pose.
    """
    if track.frames[0] - first > MAX_LEADING:
        raise UserError(f"the first pose is of frame {track.frames[0]}, and rows count from {first}: give --from")
    frames = np.arange(first, track.frames[-1] + 1, dtype=np.int64)
    at = np.clip(np.searchsorted(track.frames, frames), 0, len(track.frames) - 1)
    indices = np.where(track.frames[at] == frames, at, -1)
    counted = track.times_s[0] + (frames - track.frames[0]) / (track.rate or 1.0)
    between_s = np.interp(frames, track.frames, track.times_s)
    times_s = np.where(indices >= 0, track.times_s[at], np.where(frames < track.frames[0], counted, between_s))
    return replace(track.rows(indices), frames=frames, times_s=times_s)


def holding(track: PoseTrack) -> PoseTrack:
    """Fill empty rows with the previous pose, the first ones with the next; for formats without blanks."""
    known = np.flatnonzero(track.known)
    if not len(known):
        raise UserError("the person is lost in every frame: no pose to hold")
    at = known[np.clip(np.searchsorted(known, np.arange(len(track.frames)), side="right") - 1, 0, None)]
    return replace(track, positions=track.positions[at], angles=track.angles[at])
