"""`zenocap evaluate`: error of joint centres against ground truth."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.errors import UserError
from zenocap.common.formats.import_format import import_suffixes
from zenocap.common.formats.pose_track import Bound, inside
from zenocap.common.formats.trajectories import Trajectories

CENTRES = (".trc", ".c3d", ".bvh", ".mcap")  # suffixes of files with joint centres
ANGLES = (".mot", *CENTRES)
LOST_M = 0.25
CLOCK_S = 1e-6  # added to half an interval, for times rounded to decimals
# Another offset is searched where errors are beyond these, and named where it halves them; all chosen by hand.
BAD_MM, BAD_LOST_PCT = 100.0, 20.0
LEAST_OVERLAP = 0.5  # of the compared rows
SEARCHED_ROWS, MOST_OFFSETS = 100, 20_000
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
    allowed = dict.fromkeys((*(ANGLES if angles else CENTRES), *import_suffixes()))
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
        note = better_offset(track, truth, selection, np.inf)
        raise UserError(f"no frame in common with an estimate: check --from, --until and --offset{note and ': '}{note}")
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


def paired_rows(one_s: Floats, other_s: Floats, one_rate: float = 0.0) -> tuple[Ints, Ints]:
    """Rows (m,) of both rising series of times (n,), seconds, at the m instants of the slower one within the other's time.

    -1 in the faster series where it has no time within half of its interval.  At equal rates, every instant of `other_s`.
    one_rate: of a series that leaves rows out, per second; 0: that of its median interval.
    """
    one_period, other_period = 1.0 / one_rate if one_rate else _period(one_s), _period(other_s)
    if one_period > other_period * 1.001:  # rates of live takes are not exact
        half = 0.5 * other_period + CLOCK_S
        inner = np.flatnonzero((one_s >= other_s[0] - half) & (one_s <= other_s[-1] + half))
        return inner, _nearest(other_s, one_s[inner], half)
    rows = np.arange(len(other_s), dtype=np.int64)
    return _nearest(one_s, other_s, 0.5 * (one_period or other_period) + CLOCK_S), rows


def _nearest(times_s: Floats, wanted_s: Floats, tolerance_s: float) -> Ints:
    """Row (m,) of `times_s` (n,) nearest to each of `wanted_s` (m,), -1 farther away than the tolerance."""
    right = np.clip(np.searchsorted(times_s, wanted_s), 0, len(times_s) - 1)
    left = np.clip(right - 1, 0, None)
    nearest = np.where(np.abs(times_s[left] - wanted_s) < np.abs(times_s[right] - wanted_s), left, right)
    return np.where(np.abs(times_s[nearest] - wanted_s) <= tolerance_s, nearest, -1).astype(np.int64)


def _period(times_s: Floats) -> float:
    """Median interval, seconds; 0 for one row."""
    return float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0


def _shift_s(track: Trajectories, selection: ScoredFrames) -> float:
    return selection.offset / track.rate if track.rate else 0.0


def pairing_notes(take: Trajectories, truth: Trajectories, selection: ScoredFrames, found: Accuracy) -> Iterator[str]:
    """Contradictions of frame numbers and times, which pair the rows, and what is odd about the result."""
    shift_s, half = _shift_s(take, selection), 0.5 * _period(truth.times_s) + CLOCK_S
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
    if step > selection.every and step * _period(truth.times_s) < 1.5 * _period(take.times_s):
        yield (f"the take has every {step}. frame of the truth, and the others count as lost: give --every {step}")
    if found.mpjpe_mm > BAD_MM or found.lost_pct > BAD_LOST_PCT:
        yield from filter(None, [better_offset(take, truth, selection, found.mpjpe_mm)])


def better_offset(take: Trajectories, truth: Trajectories, selection: ScoredFrames, found_mm: float) -> str:
    """Another offset with less than half the error `found_mm`, in words; empty without one."""
    names = [name for name in truth.names if name in take.names]
    kept, period = _kept(truth, selection), _period(take.times_s)
    kept = kept[:: -(-len(kept) // SEARCHED_ROWS) or 1]
    if not len(kept) or not period or not take.rate:
        return ""
    expected = truth.points[kept][:, [truth.names.index(name) for name in names]]
    points = take.points[:, [take.names.index(name) for name in names]]
    steps = np.round((truth.times_s[kept] - truth.times_s[kept[0]]) / period).astype(np.int64)  # in rows of the take
    best: tuple[float, int] = (found_mm / 2.0, 0)
    for start in range(-int(steps[-1]), len(points))[:MOST_OFFSETS]:
        rows = steps + start
        inside_take = (rows >= 0) & (rows < len(points))
        if np.count_nonzero(inside_take) < LEAST_OVERLAP * len(rows):
            continue
        distance = np.linalg.norm(points[rows[inside_take]] - expected[inside_take], axis=2)
        if np.count_nonzero(np.isfinite(distance)) > LEAST_OVERLAP * distance.size:
            best = min(best, (1e3 * float(np.nanmean(distance)), start))
    if best[0] >= found_mm / 2.0 or not np.isfinite(best[0]):
        return ""
    offset = round((take.times_s[0] + best[1] * period - truth.times_s[kept[0]]) * take.rate)
    return f"with --offset {offset} the mean distance is {best[0]:.0f} mm: do numbers and times of the truth begin again?"


def centre_lines(found: Accuracy) -> list[str]:
    """The errors as lines of text."""
    lines = [f"{name:10} {getattr(found, name)}" for name in ("frames", "joints")]
    for name in ("mpjpe_mm", "rmse_mm", "shape_mm", "median_mm", "lost_pct"):
        lines.append(f"{name:10} {getattr(found, name):.2f}")
    per_joint = "  ".join(f"{name} {value:.0f}" for name, value in found.per_joint_mm.items())
    return [*lines, f"joints mm  {per_joint}"]
