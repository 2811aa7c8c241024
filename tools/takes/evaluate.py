"""`zenocap evaluate`: error of joint centres against ground truth."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.errors import UserError
from zenocap.common.formats.angle_series import angle_suffixes
from zenocap.common.formats.motion_files import centre_suffixes
from zenocap.common.formats.pose_track import Bound, inside
from zenocap.common.formats.trajectories import Trajectories
from zenocap.tools.takes.pairing import CLOCK_S, TimedValues, better_changes, paired_rows, period

LOST_M = 0.25
BAD_MM, BAD_LOST_PCT = 100.0, 20.0  # beyond which a change of the truth is searched; chosen by hand
UNITS = {"mm": 1e3, "cm": 1e2, "feet": 1 / 0.3048, "mm in place of m": 1e-3, "cm in place of m": 1e-2}
TURNS = {
    f"{degrees} degrees about Y": np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    for degrees, cosine, sine in ((90, 0.0, 1.0), (180, -1.0, 0.0), (-90, 0.0, -1.0))
}
PELVIS = ("LHip", "RHip", "Neck")


@dataclass(frozen=True)
class ScoredFrames:
    """Frames of the truth to score.  every: step in frames.

    offset: frame number of the track minus that of the truth; in time, so many frames of the track.
    """

    first: Bound | None = None
    last: Bound | None = None
    every: int = 1
    offset: int = 0


@dataclass(frozen=True)
class Accuracy:
    """Errors over all joints of all frames.  mpjpe, rmse, median: distance (mm).

    shape_mm: RMSE without each joint's mean offset in the person's pelvis frame, because two bodies do not define
    their joints alike.  lost_pct: share of the truth without estimate or more than 250 mm from it.
    """

    frames: int
    joints: int
    mpjpe_mm: float
    rmse_mm: float
    shape_mm: float
    median_mm: float
    lost_pct: float
    per_joint_mm: dict[str, float]


def check_truth(path: Path, *, angles: bool) -> None:
    """Raise UserError for a file without joint angles, or joint centres."""
    allowed = angle_suffixes() if angles else centre_suffixes()
    if path.suffix.lower() not in allowed:
        quantity = "joint angles" if angles else "joint centres"
        raise UserError(f"--truth {path}: suffix {path.suffix!r}: allowed for {quantity}: {', '.join(allowed)}")


def accuracy(track: Trajectories, truth: Trajectories, selection: ScoredFrames) -> Accuracy:
    """Errors of `track` against `truth`, paired by time.  Raises UserError without a joint or frame in common."""
    names = [name for name in truth.names if name in track.names]
    if not names:
        raise UserError(f"no joint in common: {', '.join(track.names)} and {', '.join(truth.names)}")
    if missing := [name for name in PELVIS if name not in truth.names]:
        raise UserError(f"the truth has no {', '.join(missing)}: allowed: a truth with {', '.join(PELVIS)}")
    kept = _kept(truth, selection)
    if not len(kept) or not len(track.frames):
        raise UserError("no frame in common with an estimate: check --from, --until and --offset")
    columns = [track.names.index(name) for name in names]
    take_at, truth_at = paired_rows(track.times_s - _shift_s(track, selection), truth.times_s[kept], track.rate)
    kept, take_at = kept[truth_at[truth_at >= 0]], take_at[truth_at >= 0]
    expected = truth.points[kept][:, [truth.names.index(name) for name in names]]
    found = np.where((take_at >= 0)[:, None, None], track.points[take_at][:, columns], np.nan)
    difference = found - expected
    distance = np.linalg.norm(difference, axis=2)
    estimated, known = ~np.isnan(distance), ~np.isnan(expected).any(axis=2)
    if not estimated.any():
        hints = doubts(track, truth, selection, np.inf)
        raise UserError(": ".join(["no frame in common with an estimate: check --from, --until and --offset", *hints[:1]]))
    own = np.einsum("fij,fnj->fni", _world_to_pelvis(truth, kept), difference)
    with np.errstate(invalid="ignore"):
        shape = own - np.nanmean(np.where(estimated[..., None], own, np.nan), axis=0, keepdims=True)
    lost = np.count_nonzero(known & ~estimated) + np.count_nonzero(distance > LOST_M)
    millimetres = 1e3 * distance[estimated]
    per_joint_mm = {
        name: 1e3 * float(distance[estimated[:, k], k].mean()) for k, name in enumerate(names) if estimated[:, k].any()
    }
    return Accuracy(
        frames=len(kept), joints=len(names), mpjpe_mm=float(millimetres.mean()),
        rmse_mm=float(np.sqrt((millimetres**2).mean())),
        shape_mm=1e3 * float(np.sqrt((np.linalg.norm(shape, axis=2)[estimated] ** 2).mean())),
        median_mm=float(np.median(millimetres)), lost_pct=100.0 * float(lost) / float(np.count_nonzero(known)),
        per_joint_mm=per_joint_mm,
    )  # fmt: skip


def _kept(truth: Trajectories, selection: ScoredFrames) -> Ints:
    """Rows of the truth to score: inside the selection, and with a pelvis frame."""
    frames = truth.frames
    wanted = (frames % selection.every == 0) & inside(frames, truth.times_s, selection.first, selection.last)
    for name in PELVIS:
        wanted &= ~np.isnan(truth.points[:, truth.names.index(name)]).any(axis=1)
    return np.flatnonzero(wanted)


def _world_to_pelvis(truth: Trajectories, rows: Ints) -> Floats:
    """(frames, 3, 3): rows X to the person's left, Y up along the torso, Z to the front."""
    left, right, neck = (truth.points[rows, truth.names.index(name)] for name in PELVIS)
    x = (left - right) / np.linalg.norm(left - right, axis=1, keepdims=True)
    z = np.cross(x, neck - (left + right) / 2)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _shift_s(track: Trajectories, selection: ScoredFrames) -> float:
    return selection.offset / track.rate if track.rate else 0.0


def pairing_notes(take: Trajectories, truth: Trajectories, selection: ScoredFrames) -> Iterator[str]:
    """Contradictions of frame numbers and times, which pair the rows."""
    shift_s, half = _shift_s(take, selection), 0.5 * period(truth.times_s) + CLOCK_S
    shared = sorted({int(frame) - selection.offset for frame in take.frames} & {int(frame) for frame in truth.frames})
    for frame in (shared[-1], shared[0]) if shared else ():
        take_s = float(take.times_s[np.searchsorted(take.frames, frame + selection.offset)]) - shift_s
        truth_s = float(truth.times_s[np.searchsorted(truth.frames, frame)])
        if abs(take_s - truth_s) > half:
            yield (
                f"frame {frame} of the truth is at {truth_s:.3f} s, and that of the take at {take_s:.3f} s: rows are "
                "paired by time, not by number"
            )
            break
    step = int(np.median(np.diff(take.frames))) if len(take.frames) > 1 else 1
    if step > selection.every and step * period(truth.times_s) < 1.5 * period(take.times_s):
        yield (f"the take has every {step}. frame of the truth, and the others count as lost: give --every {step}")


def doubts(take: Trajectories, truth: Trajectories, selection: ScoredFrames, found_mm: float) -> list[str]:
    """Changes of the truth, in words, after which the mean distance is less than half of `found_mm`."""
    names = tuple(name for name in truth.names if name in take.names)
    every, kept = np.arange(len(take.frames)), _kept(truth, selection)
    one, other = (
        TimedValues(names, data.times_s[rows], data.points[rows][:, [data.names.index(name) for name in names]], data.rate)
        for data, rows in ((take, every), (truth, kept))
    )
    changes = better_changes(one, other, _shift_s(take, selection), 1e-3 * found_mm, _distance, UNITS, TURNS)
    return [replace(change, mean=1e3 * change.mean).text("mm", found_mm) for change in changes]


def _distance(found: Floats, expected: Floats) -> Floats:
    distance: Floats = np.linalg.norm(found - expected, axis=2)
    return distance


def centre_lines(found: Accuracy) -> list[str]:
    """The errors as lines of text."""
    lines = [f"{name:10} {getattr(found, name)}" for name in ("frames", "joints")]
    for name in ("mpjpe_mm", "rmse_mm", "shape_mm", "median_mm", "lost_pct"):
        lines.append(f"{name:10} {getattr(found, name):.2f}")
    per_joint = "  ".join(f"{name} {value:.0f}" for name, value in found.per_joint_mm.items())
    return [*lines, f"joints mm  {per_joint}"]
