"""Rotation matrices and the two angle orders of the tracker's anatomy."""

from math import asin, atan2, cos, sin

import numpy as np

from zenocap.common.arrays import Floats


def rx(angle: float) -> Floats:
    """(3, 3) rotation about X by `angle` radians."""
    c, s = cos(angle), sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def ry(angle: float) -> Floats:
    """(3, 3) rotation about Y by `angle` radians: +Z turns towards +X."""
    c, s = cos(angle), sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rz(angle: float) -> Floats:
    """(3, 3) rotation about Z by `angle` radians."""
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def yxz_angles(rotation: Floats) -> tuple[float, float, float]:
    """Angles (y, x, z) in radians with rotation = Ry Rx Rz; x in [-pi/2, pi/2]."""
    x = asin(float(np.clip(-rotation[1, 2], -1.0, 1.0)))
    return atan2(rotation[0, 2], rotation[2, 2]), x, atan2(rotation[1, 0], rotation[1, 1])


def zxy_angles(rotation: Floats) -> tuple[float, float, float]:
    """Angles (z, x, y) in radians with rotation = Rz Rx Ry; x in [-pi/2, pi/2]."""
    x = asin(float(np.clip(rotation[2, 1], -1.0, 1.0)))
    return atan2(-rotation[0, 1], rotation[1, 1]), x, atan2(-rotation[2, 0], rotation[2, 2])


def unit(vector: Floats) -> Floats:
    """The vector (3,) normalized to length one."""
    scaled: Floats = vector / float(np.sqrt(vector @ vector))
    return scaled


def cross(a: Floats, b: Floats) -> Floats:
    """Cross product of two vectors (3,); numpy's own takes ten times as long for one pair."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def from_x_and_y(x_axis: Floats, y_axis: Floats) -> Floats:
    """(3, 3) rotation whose columns are the unit axes; y_axis is kept, x_axis made perpendicular to it."""
    y = unit(y_axis)
    x = unit(x_axis - (x_axis @ y) * y)
    return np.array([x, y, cross(x, y)]).T


def blend(first: Floats, second: Floats, share: float) -> Floats:
    """Interpolate two rotations less than half a turn apart; share 0 gives the first, 1 the second."""
    mixed = (1.0 - share) * first + share * second
    return from_x_and_y(mixed[:, 0], mixed[:, 1])
