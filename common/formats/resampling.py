"""Resampling of pose tracks: positions linearly, rotations of joints by spherical interpolation."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.rotations import euler_to_matrix, matrix_to_euler
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack

# All values below are chosen by hand.
MAX_GAP_S = 0.25  # longest gap that is interpolated; with a low frame rate, 1.5 median periods
EXACT_S = 1e-6  # between a grid time and a row, within which the row is copied
MAX_ROWS = 10_000_000  # of the result


def resampled(track: PoseTrack, fps: float) -> PoseTrack:
    """Return rows at k / fps seconds since frame 0 for every k within the track; k is the new frame number.

    Rows are interpolated between poses at most 0.25 s (or 1.5 median periods) apart, and empty otherwise.  Views, scores
    and `lost` are those of the nearest row.  Raises UserError.
    """
    start, end = float(track.times_s[0]), float(track.times_s[-1])
    if (end - start) * fps > MAX_ROWS:
        raise UserError(f"--fps {fps:g}: more than {MAX_ROWS} rows; allowed: fewer, or a part with --from and --until")
    frames = np.arange(np.ceil((start - EXACT_S) * fps), np.floor((end + EXACT_S) * fps) + 1).astype(np.int64)
    if not len(frames):
        raise UserError(f"--fps {fps:g}: no multiple of 1/{fps:g} s between {start:.6f} and {end:.6f} s")
    times_s = frames / fps
    known = np.flatnonzero(track.known)
    nearest = track.rows(_nearest(track.times_s, times_s))
    if not len(known):
        return replace(nearest, frames=frames, times_s=times_s, rate=fps)
    source_s = track.times_s[known]
    after = np.clip(np.searchsorted(source_s, times_s - EXACT_S), 0, len(known) - 1)
    before = np.clip(after - 1, 0, None)
    exact = np.abs(source_s[after] - times_s) <= EXACT_S
    before = np.where(exact, after, before)
    span = source_s[after] - source_s[before]
    made = exact | ((span > 0) & (span <= bridged_s(track)) & (source_s[before] <= times_s) & (times_s <= source_s[after]))
    share = np.where(made & ~exact, (times_s - source_s[before]) / np.where(span > 0, span, 1.0), 0.0)
    a, b = known[before], known[after]
    positions = track.positions[a] + share[:, None] * (track.positions[b] - track.positions[a])
    angles = _angles_between(track, track.angles[a], track.angles[b], share)
    limbs = ("" if what == "person" else what for what in nearest.lost)
    return replace(
        nearest, frames=frames, times_s=times_s, positions=np.where(made[:, None], positions, np.nan),
        angles=np.where(made[:, None], angles, np.nan),
        lost=tuple(what if ok else "person" for what, ok in zip(limbs, made, strict=True)), rate=fps,
    )  # fmt: skip


def bridged_s(track: PoseTrack) -> float:
    """Longest gap that is interpolated, seconds."""
    return max(MAX_GAP_S, 1.5 * track.step_s)


def _angles_between(track: PoseTrack, before: Floats, after: Floats, share: Floats) -> Floats:
    """Angles (n, angles) at fraction `share` (n,) between `before` and `after` (n, angles), joint by joint."""
    angles = before + share[:, None] * (after - before)
    at = 0
    for joint in track.anatomy.joints:
        columns = slice(at, at + len(joint.axes))
        at += len(joint.axes)
        if len(joint.axes) == 3:
            start = Rotation.from_matrix(euler_to_matrix(joint.axes, before[:, columns]))
            end = Rotation.from_matrix(euler_to_matrix(joint.axes, after[:, columns]))
            turn = (start.inv() * end).as_rotvec()
            between = np.asarray((start * Rotation.from_rotvec(share[:, None] * turn)).as_matrix(), dtype=np.float64)
            angles[:, columns] = matrix_to_euler(joint.axes, between, angles[:, columns])
    return angles


def _nearest(source_s: Floats, times_s: Floats) -> Ints:
    right = np.clip(np.searchsorted(source_s, times_s), 0, len(source_s) - 1)
    left = np.clip(right - 1, 0, None)
    return np.where(np.abs(source_s[left] - times_s) < np.abs(source_s[right] - times_s), left, right)
