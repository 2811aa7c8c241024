"""Choice among equal Euler angles over time: inside the reader's ranges, and continuous."""

from collections.abc import Sequence

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.rotations import GIMBAL_LOCK, cardan_angles, matrix_to_euler

TURN = 2.0 * np.pi
FREE = (-np.inf, np.inf)  # of an angle that may grow past full turns
UPRIGHT = (-np.pi / 2, np.pi / 2)  # of the middle angle, where a reader states no ranges
NO_RANGES = (FREE, UPRIGHT, FREE)
# Jump (rad) that is as bad as one radian beyond a range for one second.  Chosen by hand: with 10, 30 and 100 the arms of
# golden takes are inside wherever one solution is, except in 12, 11 and 7 rows, all of them near a T-pose.
JUMP_PER_S = 30.0
TURNS = (0, -1, 1)  # about the middle of a range; the first is taken where none is better


def continuous_euler(axes: str, rotations: Floats, ranges: Sequence[tuple[float, float]], step_s: float) -> Floats:
    """Euler angles (n, 3) of rotations (n, 3, 3) about three different `axes`, radians.

    Of the two solutions and their full turns, those with the least time outside `ranges`, each (lowest, highest), and the
    smallest jumps; outside where both are, as of arms of our body.  No row decides for the others: takes begin in a T-pose,
    where both meet.  A free angle is within half a turn of 0 in the middle row.  step_s: interval of the rows, seconds.
    """
    if not len(rotations):
        return np.empty((0, 3))
    one = _turned(cardan_angles(axes, rotations), ranges)
    other = _turned(np.stack([one[:, 0] + np.pi, np.pi - one[:, 1], one[:, 2] + np.pi], axis=-1), ranges)
    both = np.stack([one, other], axis=1)  # (n, solutions, angles)
    weight = JUMP_PER_S * (step_s or 1.0)
    outside = weight * np.sum([_outside(both[..., k], ranges[k]) for k in range(3)], axis=0)
    jumps = _short(both[1:, None] - both[:-1, :, None])  # from each solution of a row to each of the next
    chosen = both[np.arange(len(both)), _cheapest(outside, np.abs(jumps).sum(axis=-1))]
    near = np.stack([_whole_turns(chosen[:, k], ranges[k], weight) for k in range(3)], axis=-1)
    return matrix_to_euler(axes, rotations, _kept_in_lock(near, np.cos(one[:, 1]) < GIMBAL_LOCK))


def _whole_turns(angles: Floats, allowed: tuple[float, float], weight: float) -> Floats:
    """Angles (n,) equal modulo full turns: continuous from the middle row, and turned back where that leaves the range."""
    if not np.isfinite(allowed).all():
        middle = len(angles) // 2
        steps = _short(np.diff(angles))
        whole: Floats = angles[middle] + np.concatenate(
            [-np.cumsum(steps[:middle][::-1])[::-1], [0.0], np.cumsum(steps[middle:])]
        )
        return whole
    every = angles[:, None] + TURN * np.array(TURNS)
    jumps = np.abs(every[1:, None, :] - every[:-1, :, None])
    found: Floats = every[np.arange(len(every)), _cheapest(weight * _outside(every, allowed), jumps)]
    return found


def _cheapest(costs: Floats, jumps: Floats) -> Ints:
    """Choice (n,) with the lowest sum of costs (n, choices) and jumps (n - 1, choices, choices).  Viterbi's algorithm."""
    total, origins = costs[0], np.zeros(costs.shape, dtype=np.int64)
    for row in range(1, len(costs)):
        ways = total[:, None] + jumps[row - 1]
        origins[row] = ways.argmin(axis=0)
        total = ways.min(axis=0) + costs[row]
    choice = np.empty(len(costs), dtype=np.int64)
    choice[-1] = total.argmin()
    for row in range(len(costs) - 1, 0, -1):
        choice[row - 1] = origins[row, choice[row]]
    return choice


def _turned(angles: Floats, ranges: Sequence[tuple[float, float]]) -> Floats:
    """Angles (n, 3) equal modulo full turns, within half a turn of the middle of each range, or of 0."""
    middle = np.array([0.5 * (low + high) if np.isfinite(low) else 0.0 for low, high in ranges])
    return middle + _short(angles - middle)


def _outside(angles: Floats, allowed: tuple[float, float]) -> Floats:
    """Distance of each angle from its range."""
    beyond: Floats = np.maximum(np.maximum(allowed[0] - angles, angles - allowed[1]), 0.0)
    return beyond


def _short(angles: Floats) -> Floats:
    """Equal angles modulo full turns, within half a turn."""
    found: Floats = (angles + np.pi) % TURN - np.pi
    return found


def _kept_in_lock(near: Floats, locked: Bools) -> Floats:
    """Angles (n, 3) whose first one, which is arbitrary in gimbal lock, is there that of the nearest other row."""
    if locked.all() or not locked.any():
        return near
    free, rows = np.flatnonzero(~locked), np.arange(len(near))
    right = np.clip(np.searchsorted(free, rows), 0, len(free) - 1)
    left = np.clip(right - 1, 0, None)
    nearest = free[np.where(np.abs(free[left] - rows) < np.abs(free[right] - rows), left, right)]
    return np.where(locked[:, None], np.column_stack([near[nearest, 0], near[:, 1:]]), near)
