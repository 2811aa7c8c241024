"""`zenocap evaluate`: error of joint centres against ground truth."""

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
SAME_RATE = 0.02  # relative difference up to which two durations are equal; chosen by hand
PELVIS = ("LHip", "RHip", "Neck")


@dataclass(frozen=True)
class ScoredFrames:
    """Frames of the truth to score.  offset: frame number of the track minus that of the truth.  every: step in frames."""

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
    """Errors of `track` against `truth`.  Raises UserError without a joint or frame in common."""
    names = [name for name in truth.names if name in track.names]
    if not names:
        raise UserError(f"no joint in common: {', '.join(track.names)} and {', '.join(truth.names)}")
    if missing := [name for name in PELVIS if name not in truth.names]:
        raise UserError(f"the truth has no {', '.join(missing)}: allowed: a truth with {', '.join(PELVIS)}")
    kept = _kept(truth, selection)
    expected = truth.points[kept][:, [truth.names.index(name) for name in names]]
    found = np.full_like(expected, np.nan)
    rows = {int(frame): k for k, frame in enumerate(track.frames)}
    columns = [track.names.index(name) for name in names]
    for k, frame in enumerate(truth.frames[kept]):
        row = rows.get(int(frame) + selection.offset)
        if row is not None:
            found[k] = track.points[row, columns]
    difference = found - expected
    distance = np.linalg.norm(difference, axis=2)
    estimated, known = ~np.isnan(distance), ~np.isnan(expected).any(axis=2)
    if not estimated.any():
        raise UserError("no frame in common with an estimate: check --from, --until and --offset")
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


def pairing_note(take: Trajectories, truth: Trajectories, every: int, offset: int) -> str:
    """What is wrong with joint centres that are paired by frame number; empty where nothing is.

    every: step in frames of the truth.  offset: frame number of the take minus that of the truth.
    """
    shared = sorted({int(frame) - offset for frame in take.frames} & {int(frame) for frame in truth.frames})
    if len(shared) < 2:
        return ""
    ends = [int(np.searchsorted(truth.frames, frame)) for frame in (shared[0], shared[-1])]
    own = [int(np.searchsorted(take.frames, frame + offset)) for frame in (shared[0], shared[-1])]
    truth_s, take_s = np.diff(truth.times_s[ends]).item(), np.diff(take.times_s[own]).item()
    if abs(take_s - truth_s) > SAME_RATE * truth_s:
        return (
            f"frames {shared[0]} to {shared[-1]} last {take_s:.2f} s in the take and {truth_s:.2f} s in the truth: frames "
            "of equal numbers are compared, so these figures mean nothing; use a truth of the same rate, or --angles"
        )
    step = int(np.median(np.diff(take.frames)))
    if step > every:
        return f"the take has every {step}. frame of the truth, and the others count as lost: give --every {step}"
    return ""


def centre_lines(found: Accuracy) -> list[str]:
    """The errors as lines of text."""
    lines = [f"{name:10} {getattr(found, name)}" for name in ("frames", "joints")]
    for name in ("mpjpe_mm", "rmse_mm", "shape_mm", "median_mm", "lost_pct"):
        lines.append(f"{name:10} {getattr(found, name):.2f}")
    per_joint = "  ".join(f"{name} {value:.0f}" for name, value in found.per_joint_mm.items())
    return [*lines, f"joints mm  {per_joint}"]
