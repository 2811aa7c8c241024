"""Axes and units of other programs.  Ours are metres, right-handed, Y up, and the person first faces Z."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from common.body.anatomy import Floats

Axes = Literal["y-up", "z-up", "ros", "opensim", "unity", "unreal"]
Unit = Literal["m", "cm", "mm"]
PER_METRE: Mapping[Unit, float] = {"m": 1.0, "cm": 100.0, "mm": 1000.0}

# Rows are the other axes in ours.  A rotation R of ours is A R A^T there, for the two left-handed ones too.
MATRICES: Mapping[Axes, Floats] = {
    "y-up": np.eye(3),
    "z-up": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),  # 90° about X: Blender, FreeMoCap; the front is -Y
    "ros": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),  # 120° about (1, 1, 1): X front, Y left, Z up
    "opensim": np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]),  # 90° about Y: X front, Y up, Z right
    "unity": np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, 1]]),  # mirrored: X right, Y up, Z front
    "unreal": np.array([[0.0, 0, 1], [-1, 0, 0], [0, 1, 0]]),  # mirrored: X front, Y right, Z up
}


def directions(axes: Axes) -> tuple[str, str, str]:
    """Where X, Y and Z of `axes` point for somebody who first faces our Z: such as left, up, front."""
    names = (("left", "right"), ("up", "down"), ("front", "back"))
    found = []
    for row in MATRICES[axes]:
        ours = int(np.argmax(np.abs(row)))
        found.append(names[ours][int(row[ours] < 0)])
    return found[0], found[1], found[2]


def turned(points: Floats, axes: Axes, unit: Unit = "m") -> Floats:
    """Points (..., 3) of our world, metres, in other axes and another unit."""
    result: Floats = points @ MATRICES[axes].T * PER_METRE[unit]
    return result
