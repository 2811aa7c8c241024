"""Arm and leg joint angles in one view, one angle after the other.  [Two-view 3.3, 3.4, Fig. 10-12]

The rotation of a spherical joint is Rz Rx Ry.  A turn about Z_N changes theta_Z, a turn about X_N after theta_Z changes
theta_X, and the elbow or knee turns about the X axis of the joint before it.  Limbs: 0 right arm, 1 left arm, 2 right leg,
3 left leg.
"""

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.viewer.parameters import ARM_REGION, ELBOW_OUTWARD, FREE_ELBOW, LEG_REGION, LOW_UPPER_ARM, SQUAT_FOLD
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.limb_fit import LimbFit, LimbResult
from zenocap.services.viewer.two_view.limb_search import BOTH, FOLD, LOWER, tri_tree, turn_limb

Z_AXIS = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LimbAngles:
    """Angles of one limb, radians: z, x, y of the spherical joint and `bend` of elbow or knee (0 straight)."""

    z: float
    x: float
    y: float
    bend: float

    def rotation(self) -> Floats:
        """(3, 3) of the spherical joint: Rz(z) Rx(x) Ry(y)."""
        cz, sz, cx, sx, cy, sy = cos(self.z), sin(self.z), cos(self.x), sin(self.x), cos(self.y), sin(self.y)
        about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
        about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
        rotation: Floats = about_z @ about_x @ about_y
        return rotation

    def directions(self) -> Floats:
        """(2, 3) directions of the upper and lower part in the torso's frame."""
        rotation = self.rotation()
        return np.stack([rotation[:, 1], rotation[:, 1] * cos(self.bend) + rotation[:, 2] * sin(self.bend)])


def find_arm_facade(fit: BodyFit, k: int, start: LimbAngles) -> tuple[LimbAngles, LimbResult]:
    """Arm k in the facade: theta_Z of the shoulder, then the elbow in the range that theta_Z leaves.  [Two-view 3.3]"""
    # Paper (corrected): theta_Y = +-90 degrees with mirrored elbow ranges is one set of poses twice; searched once here.
    # The elbow's range is -t_ha (towards the torso) to 140 degrees; the sign of the result chooses theta_Y.
    right = k == 0
    outward = pi / 2 if right else -pi / 2  # theta_Y at which a positive bend leads away from the torso
    bend = start.bend if start.y * outward >= 0 else -start.bend
    limb = LimbFit(fit, k)
    angles = LimbAngles(start.z, start.x, outward, bend)
    z = _search(limb, angles, BOTH, Z_AXIS, ARM_REGION, angles.z, (0.0, pi) if right else (pi, 2 * pi))
    angles = LimbAngles(z, angles.x, outward, bend)
    lowest = -_free_elbow(z if right else 2 * pi - z)
    bend = _search(limb, angles, LOWER, angles.rotation()[:, 0], ARM_REGION, bend, (lowest, ELBOW_OUTWARD))
    return LimbAngles(z, angles.x, outward if bend >= 0 else -outward, abs(bend)), limb.finish()


def _free_elbow(z: float) -> float:
    """t_ha: largest bend of the elbow towards the torso at theta_Z of a right arm, radians.  [Two-view 3.3 (2)]"""
    return 2 * (pi - z) if z > LOW_UPPER_ARM else FREE_ELBOW


def find_arm_flank(fit: BodyFit, k: int, start: LimbAngles) -> tuple[LimbAngles, LimbResult]:
    """Arm k in the flank: theta_X of the shoulder alone.  [Two-view 3.3, Fig. 11]"""
    limb = LimbFit(fit, k)
    # Paper (open): 3.3 names X_N of the navel; by 2.2 (2) theta_X turns after theta_Z, as here.
    x = _search(limb, start, BOTH, _x_axis(start.z), ARM_REGION, start.x, (-pi, pi))
    return LimbAngles(start.z, x, start.y, start.bend), limb.finish()


def find_leg_facade(
    fit: BodyFit, k: int, start: LimbAngles, limits: Floats, squatting: bool
) -> tuple[LimbAngles, LimbResult]:
    """Leg k in the facade: theta_Z of the hip; when squatting also theta_X with the knee at -2 theta_X.  [Two-view 3.4]

    limits: (2,) of theta_Z, radians.
    """
    limb = LimbFit(fit, k)
    angles = LimbAngles(start.z, start.x, 0.0, start.bend)
    # Paper (open): 3.4 gives no range of theta_Z of the hip; here the anatomy's.
    z = _search(limb, angles, BOTH, Z_AXIS, LEG_REGION, angles.z, (float(limits[0]), float(limits[1])))
    angles = LimbAngles(z, angles.x, angles.y, angles.bend)
    if not squatting:
        return angles, limb.finish()
    fold = min(max(start.x, 0.0), SQUAT_FOLD)
    angles = LimbAngles(z, fold, 0.0, -2 * fold)
    x = _search(limb, angles, FOLD, _x_axis(z), LEG_REGION, fold, (0.0, SQUAT_FOLD))
    return LimbAngles(z, x, 0.0, -2 * x), limb.finish()


def find_leg_flank(
    fit: BodyFit, k: int, start: LimbAngles, x_limits: Floats, knee_limits: Floats
) -> tuple[LimbAngles, LimbResult]:
    """Leg k in the flank: theta_X of the hip, then the knee.  Limits: (2,) radians.  [Two-view 3.4]"""
    limb = LimbFit(fit, k)
    angles = LimbAngles(start.z, start.x, 0.0, start.bend)
    # Paper (open): 3.4 gives no ranges of hip and knee in the flank; here the anatomy's.
    x = _search(limb, angles, BOTH, _x_axis(angles.z), LEG_REGION, angles.x, (float(x_limits[0]), float(x_limits[1])))
    angles = LimbAngles(angles.z, x, 0.0, angles.bend)
    low, high = float(knee_limits[0]), float(knee_limits[1])
    bend = _search(limb, angles, LOWER, angles.rotation()[:, 0], LEG_REGION, angles.bend, (low, high))
    return LimbAngles(angles.z, x, 0.0, bend), limb.finish()


def _x_axis(z: float) -> Floats:
    """(3,) X_N after theta_Z = z, about which theta_X turns a limb."""
    return np.array([cos(z), sin(z), 0.0])


def _search(
    limb: LimbFit, angles: LimbAngles, what: int, axis: Floats, region: float, value: float, allowed: tuple[float, float]
) -> float:
    """Overlapped tri-tree search of one angle; leaves the limb at the result and returns it.

    value: the angle now.  The search region is centred on it and moved into the allowed range.  [Two-view 3.5]
    """
    low, high = allowed
    width = min(region, high - low)
    centre = min(max(value, low + width / 2), high - width / 2)
    moved, found = np.empty((2, 3)), np.empty((2, 3))
    turn_limb(angles.directions(), axis, what, centre - value, moved)
    turn, score, matchings = tri_tree(moved, axis, what, width, limb.body, limb.fit.image)
    turn_limb(moved, axis, what, turn, found)
    limb.start(found)
    limb.score = score
    limb.matchings += (matchings,)
    return centre + turn


def other_starts(start: LimbAngles, is_leg: bool, facade: bool, lost: bool) -> tuple[LimbAngles, ...]:
    """Angles from which the addition restart searches a limb as well: hanging, and all around for a lost limb."""
    hanging = LimbAngles(pi, 0.0, start.y, 0.0)
    if not lost:
        return () if is_leg else (hanging,)
    if facade:
        turns = () if is_leg else (-ARM_REGION, ARM_REGION)
        return (hanging, *(LimbAngles(start.z + turn, 0.0, start.y, 0.0) for turn in turns))
    return (hanging, *(LimbAngles(pi, turn, start.y, 0.0) for turn in (-ARM_REGION, ARM_REGION, 2 * ARM_REGION)))
