"""The torso's rotation from its three angles and back.  [Two-view 2.2 (1)]"""

import numpy as np

from common.body.anatomy import Floats

TURNS = np.radians([-16.0, -8.0, 0.0, 8.0, 16.0])  # about the vertical: the turns whose scores the viewers share
LOW, HIGH = 0.35, 0.65  # th_low and th_high between the flank's and the facade's width


def torso_rotation(yaw: float, lean: float, roll: float) -> Floats:
    """M_W^N = Ry(yaw) Rx(lean) Rz(roll): the torso's frame to the world, (3, 3).

    yaw: from +Z towards +X.  lean: forward.  roll: to the person's right.  Radians.
    """
    cy, sy, cx, sx, cz, sz = np.cos(yaw), np.sin(yaw), np.cos(lean), np.sin(lean), np.cos(roll), np.sin(roll)
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    rotation: Floats = ry @ rx @ rz
    return rotation


def tilt_of_spine(spine: Floats, yaw: float) -> tuple[float, float]:
    """(lean, roll) that point the torso's +Y along the unit vector `spine` (3,) of the world, at a given yaw."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = c * spine[0] - s * spine[2], spine[1], s * spine[0] + c * spine[2]
    return float(np.arctan2(z, y)), float(-np.arcsin(np.clip(x, -1, 1)))


def width_thresholds(flank_width: float, facade_width: float) -> tuple[float, float]:
    """(th_low, th_high) of the upper body's width, in the unit of the widths in the initial posture.  [Two-view 3.1]"""
    gap = facade_width - flank_width
    return flank_width + LOW * gap, flank_width + HIGH * gap
