"""Trajectories of named points, and the axes and units of other programs.

zenocap's own: metres, right-handed, Y up; the person first faces Z.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from zenocap.common.arrays import Floats, Ints

Axes = Literal["y-up", "z-up", "ros", "opensim", "unity", "unreal"]
Unit = Literal["m", "cm", "mm"]
Angle = Literal["deg", "rad"]
PER_METRE: Mapping[Unit, float] = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
DIGITS: Mapping[Unit, int] = {"m": 6, "cm": 4, "mm": 3}  # decimals written: to the micrometre
MAX_ABSENT = 1_000_000  # rows that a file leaves out; chosen by hand

# Rows: the other axes in zenocap's.  A rotation R becomes A R A^T, also for the two left-handed ones.
MATRICES: Mapping[Axes, Floats] = {
    "y-up": np.eye(3),
    "z-up": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),  # 90° about X: Blender, FreeMoCap; the front is -Y
    "ros": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),  # 120° about (1, 1, 1): X front, Y left, Z up
    "opensim": np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]),  # 90° about Y: X front, Y up, Z right
    "unity": np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, 1]]),  # mirrored: X right, Y up, Z front
    "unreal": np.array([[0.0, 0, 1], [-1, 0, 0], [0, 1, 0]]),  # mirrored: X front, Y right, Z up
}


@dataclass(frozen=True)
class Trajectories:
    """names: of the markers.  frames: (n,) frame numbers, rising.  times_s: (n,) seconds.

    points: (n, markers, 3) metres, Y up; NaN where there is no estimate.  rate: frames per second.
    """

    names: tuple[str, ...]
    frames: Ints
    times_s: Floats
    points: Floats
    rate: float


def with_absent_rows(data: Trajectories) -> Trajectories:
    """The same with a row, without points, for each interval of the rate in which the file has none."""
    if len(data.frames) < 2 or data.rate <= 0.0:
        return data
    steps = np.maximum(np.round(np.diff(data.times_s) * data.rate).astype(np.int64), 1)
    at = np.concatenate([[0], np.cumsum(steps)])
    if at[-1] == len(at) - 1 or at[-1] > MAX_ABSENT + len(at):
        return data
    every = np.arange(at[-1] + 1)
    points = np.full((len(every), *data.points.shape[1:]), np.nan)
    points[at] = data.points
    frames = np.round(np.interp(every, at, data.frames)).astype(np.int64)
    return replace(data, frames=frames, times_s=np.interp(every, at, data.times_s), points=points)


def axis_directions(axes: Axes) -> tuple[str, str, str]:
    """Directions of X, Y and Z of `axes` for a person who faces zenocap's Z, such as left, up, front."""
    names = (("left", "right"), ("up", "down"), ("front", "back"))
    found = []
    for row in MATRICES[axes]:
        own_axis = int(np.argmax(np.abs(row)))
        found.append(names[own_axis][int(row[own_axis] < 0)])
    return found[0], found[1], found[2]


def convert(points: Floats, axes: Axes, unit: Unit = "m") -> Floats:
    """Convert points (..., 3), Y up, metres, to other axes and another unit."""
    result: Floats = points @ MATRICES[axes].T * PER_METRE[unit]
    return result
