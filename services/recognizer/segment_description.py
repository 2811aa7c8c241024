"""Fixed-length description of a segment: statistics of joints, trunk, speeds and turning."""

from itertools import pairwise

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.motion_rows import HEADING, HEIGHT, JOINTS, POINTS, WAY
from zenocap.services.recognizer.parameters import QUANTILES, SPEED_HALF_S, THIRDS

# Without the joints the margin of the votes falls from 52 to 43 %; of the other groups of values none is needed by itself,
# and none was removed: four people were few (commit 97a2f22, 2026-11-25).
CHANNELS = HEIGHT + 1 + 5 + len(JOINTS)
VALUES = CHANNELS * (2 + len(QUANTILES) + THIRDS + 1) + 4


def describe(rows: Floats, rate: float) -> Floats:
    """Values (VALUES,) of a segment of rows (T, `motion_rows.WIDTH`), T of 1 or more, all finite; rate: rows per second.

    Of every channel: mean, standard deviation, quantiles, means of its thirds in time, last minus first; then the way
    forwards and to the left of the first heading (m), the turn (rad) and the logarithm of the duration (s).
    """
    values = channels(rows, rate)
    way, heading = rows[-1, WAY] - rows[0, WAY], _unit(rows[:, HEADING])
    turns = np.unwrap(np.arctan2(heading[:, 0], heading[:, 1]))
    thirds = [values[part].mean(axis=0) for part in _thirds(len(rows))]
    whole = [way @ heading[0], _leftwards(way, heading[0]), turns[-1] - turns[0], np.log(len(rows) / rate)]
    quantiles = np.quantile(values, QUANTILES, axis=0)
    return np.concatenate(
        [values.mean(axis=0), values.std(axis=0), *quantiles, *thirds, values[-1] - values[0], np.array(whole)]
    )


def channels(rows: Floats, rate: float) -> Floats:
    """(T, CHANNELS) of rows (T, `motion_rows.WIDTH`).

    Angles, joints, trunk and height of the rows; velocity of the navel forwards, to the left, and its length (m/s); turn
    (rad/s); velocity of the height and speeds of JOINTS against the hips (body heights/s).
    """
    count, half = len(rows), max(1, round(SPEED_HALF_S * rate))
    later = np.minimum(np.arange(count) + half, count - 1)
    before = np.maximum(np.arange(count) - half, 0)
    seconds = np.maximum(later - before, 1)[:, None] / rate
    moved = (rows[later] - rows[before]) / seconds
    heading = _unit(rows[:, HEADING])
    forwards = (moved[:, WAY] * heading).sum(axis=1)
    leftwards = _leftwards(moved[:, WAY], heading)
    turns = np.unwrap(np.arctan2(heading[:, 0], heading[:, 1]))
    turn = (turns[later] - turns[before]) / seconds[:, 0]
    speeds = np.linalg.norm(moved[:, POINTS].reshape(count, len(JOINTS), 3), axis=2)
    length = np.hypot(forwards, leftwards)
    return np.column_stack([rows[:, : HEIGHT + 1], forwards, leftwards, length, turn, moved[:, HEIGHT], speeds])


def _thirds(count: int) -> list[slice]:
    """Rows of each third; each has a row at least."""
    edges = [round(k * count / THIRDS) for k in range(THIRDS + 1)]
    return [slice(min(low, count - 1), max(high, low + 1)) for low, high in pairwise(edges)]


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)
    return unit


def _leftwards(way: Floats, heading: Floats) -> Floats:
    """Component of a way (..., 2) to the left of a heading (..., 2), both x and z."""
    left: Floats = way[..., 0] * heading[..., 1] - way[..., 1] * heading[..., 0]
    return left
