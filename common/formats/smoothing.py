"""Smoothing of recorded poses: a Butterworth filter, forwards and backwards, which delays nothing.

Positions are filtered as they are, rotations as quaternions with continuous signs, hinges as angles; so the result is the
same in every world frame, and no angle wraps.  [Winter: Biomechanics and Motor Control of Human Movement, 4th ed., 3.4]
"""

from collections.abc import Iterator
from dataclasses import replace
from math import atan, ceil, pi, tan

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.joint_rotations import JointRotations, joint_angles, joint_columns, joint_rotations, root_jumps
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.resampling import bridged_s

DEFAULT_HZ = 6.0  # usual for gait [Winter 3.4.4.3], and Pose2Sim's default
MIN_HZ, MAX_RATIO = 0.1, 0.45  # Hz; of the frame rate, below the Nyquist frequency of 0.5; chosen by hand
ORDER = 2  # of one pass; two passes have order 4
BOTH_PASSES = (2**0.5 - 1) ** 0.25  # a pass at hz / this gives two passes with -3 dB at hz [Winter 3.4.4.2]
MIN_ROWS = 10  # of a stretch, and one period of the cut-off frequency; shorter ones are left as they are; chosen by hand
REGULAR = 0.05  # greatest deviation of regular intervals, of the median frame interval; chosen by hand
GRID_STEPS = 2  # of the uniform grid in a median interval, where frames are irregular; chosen by hand
MIN_LENGTH = 0.5  # of a filtered quaternion; shorter ones have no direction, and the row is left; chosen by hand


def smoothed(track: PoseTrack, hz: float) -> PoseTrack:
    """Return the track without motion faster than `hz` (-3 dB, order 4, no phase): same rows, times and lost frames.

    Rows without a pose, gaps of more than 0.25 s and jumps of the root end a stretch; each stretch is filtered on its own.
    Stretches of less than 10 frames or one period of `hz` are unchanged.  Frames at irregular times are interpolated to a
    uniform grid and back by a cubic spline.  Raises UserError for a frequency that the frame rate does not allow.
    """
    if not (step_s := track.step_s) > 0.0:
        return track
    highest = MAX_RATIO / step_s
    if not MIN_HZ <= hz <= highest:  # not a number as well
        raise UserError(
            f"smooth = {hz:g} Hz: allowed: {MIN_HZ:g} to {highest:.4g}, {MAX_RATIO:g} of the {1 / step_s:.4g} frames/s"
        )
    positions, angles = track.positions.copy(), track.angles.copy()
    for rows in _stretches(track):
        if _long_enough(rows, hz, step_s):
            positions[rows], angles[rows] = _smoothed_stretch(track, rows, hz)
    return replace(track, positions=positions, angles=angles)


def too_short(track: PoseTrack, hz: float) -> tuple[int, int]:
    """Number of stretches, and of the frames in them, that `smoothed` leaves unchanged because they are too short."""
    if not (step_s := track.step_s) > 0.0:
        return int(track.known.any()), int(np.count_nonzero(track.known))
    left = [len(rows) for rows in _stretches(track) if not _long_enough(rows, hz, step_s)]
    return len(left), sum(left)


def description(hz: float | None, left: tuple[int, int] = (0, 0)) -> str:
    """Smoothing of exported poses, in one line for the metadata of files.  left: of `too_short`."""
    if hz is None:
        return "none"
    text = f"Butterworth low-pass, -3 dB at {hz:g} Hz, order {2 * ORDER}, forwards and backwards (zero phase)"
    return f"{text}; {left[0]} stretches, {left[1]} frames, too short: unchanged" if left[0] else text


def _long_enough(rows: Ints, hz: float, step_s: float) -> bool:
    return len(rows) >= max(MIN_ROWS, 1.0 / (hz * step_s))


def _stretches(track: PoseTrack) -> Iterator[Ints]:
    """Row numbers of each stretch of poses without a lost row, a gap or a jump."""
    known = np.flatnonzero(track.known)
    if not len(known):
        return
    times_s = track.times_s[known]
    rotations = joint_rotations(track.anatomy, track.positions[known], track.angles[known])
    cuts = (np.diff(known) > 1) | (np.diff(times_s) > bridged_s(track)) | root_jumps(rotations, times_s)
    yield from np.split(known, np.flatnonzero(cuts) + 1)


def _smoothed_stretch(track: PoseTrack, rows: Ints, hz: float) -> tuple[Floats, Floats]:
    """Positions (n, 3) and angles (n, angles) of the rows (n,)."""
    raw = joint_rotations(track.anatomy, track.positions[rows], track.angles[rows])
    n, balls, _ = raw.quaternions.shape
    signals = np.concatenate([raw.positions, raw.quaternions.reshape(n, -1), raw.hinges], axis=1)
    signals = lowpass(track.times_s[rows], signals, hz)
    quaternions = signals[:, 3 : 3 + 4 * balls].reshape(n, balls, 4)
    lengths = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    quaternions = np.where(lengths < MIN_LENGTH, raw.quaternions, quaternions / np.maximum(lengths, MIN_LENGTH))
    limits = joint_columns(track.anatomy).limits
    low, high = np.minimum(limits[:, 0], raw.hinges.min(axis=0)), np.maximum(limits[:, 1], raw.hinges.max(axis=0))
    hinges = np.clip(signals[:, 3 + 4 * balls :], low, high)  # the filter overshoots
    found = JointRotations(signals[:, :3], quaternions, hinges)
    return found.positions, joint_angles(track.anatomy, found, track.angles[rows])


def lowpass(times_s: Floats, signals: Floats, hz: float) -> Floats:
    """Filter signals (n, m) at rising times (n,), in both directions: -3 dB at `hz`, order 4, no phase."""
    steps_s = np.diff(times_s)
    middle_s = float(np.median(steps_s))
    if np.abs(steps_s - middle_s).max() <= REGULAR * middle_s:
        return _both_passes(signals, hz, 1.0 / float(np.mean(steps_s)))
    count = ceil(GRID_STEPS * (times_s[-1] - times_s[0]) / middle_s)
    grid_s = np.linspace(times_s[0], times_s[-1], count + 1)
    uniform = _both_passes(np.asarray(CubicSpline(times_s, signals)(grid_s)), hz, 1.0 / float(grid_s[1] - grid_s[0]))
    result: Floats = np.asarray(CubicSpline(grid_s, uniform)(times_s))
    return result


def _both_passes(signals: Floats, hz: float, rate: float) -> Floats:
    """Filter signals (n, m) at `rate` per second."""
    one_pass_hz = rate / pi * atan(tan(pi * hz / rate) / BOTH_PASSES)  # by the bilinear transform, always below rate / 2
    sections = butter(ORDER, one_pass_hz, fs=rate, output="sos")
    padding = min(len(signals) - 1, max(MIN_ROWS, ceil(rate / hz)))
    result: Floats = np.asarray(sosfiltfilt(sections, signals, axis=0, padtype="odd", padlen=padding))
    return result
