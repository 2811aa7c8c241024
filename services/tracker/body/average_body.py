"""Average body of a given height."""

import numpy as np

from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy, without_side
from zenocap.common.body.definition import Bdp
from zenocap.common.body.proportions import HIP_HALF_BREADTH, SHOULDER_HALF_BREADTH, average_lengths, body_from_lengths

# In body heights; distances between joint centres, mean of the shares of men (1741 mm) and women (1735 mm) in table 4 of
# de Leva (1996), J. Biomech. 29:1223: shank (knee to ankle) 440.3 and 438.6 mm, thigh 422.2 and 368.5, trunk (middle of the
# hips to middle of the shoulders) 515.5 and 497.9, upper arm 281.7 and 275.1, forearm 268.9 and 264.3, wrist to tip of the
# third finger 187.9 and 170.1.  The statures are cited from memory.  Ankle: Drillis and Contini (1966), as in Winter,
# Biomechanics, 4th ed., fig. 4.1.  Radii and positions of axes are rough estimates of an average clothed adult.
ANKLE_HEIGHT, SHANK, THIGH, TRUNK = 0.039, 0.253, 0.227, 0.292
UPPER_ARM, FOREARM, HAND = 0.160, 0.153, 0.103
HIP_HEIGHT = ANKLE_HEIGHT + SHANK + THIGH
SHOULDER_HEIGHT = HIP_HEIGHT + TRUNK
WAIST = 0.10  # of the bend of the spine above the hip joints
THROAT, SKULL = 0.040, 0.055  # of the head's joint above the shoulder line, and of the skull's axis above that
# Paper (replaced): [Hybrid II] has cylinders; here tapered parts.
SHAPES = {  # height, then long and short radius at the base and at the far end; where the axis begins
    "pelvis": ((WAIST - 0.02, 0.092, 0.064, 0.082, 0.058), (0.0, 0.02, 0.0)),
    "chest": ((TRUNK - WAIST - 0.035, 0.082, 0.058, 0.092, 0.056), (0.0, 0.0, 0.0)),
    "neck_column": ((0.065, 0.070, 0.050, 0.034, 0.036), (0.0, -0.01, 0.0)),
    "head": ((1.0 - SHOULDER_HEIGHT - THROAT - SKULL, 0.044, 0.055, 0.044, 0.055), (0.0, SKULL, 0.008)),
    "upper_arm": ((UPPER_ARM, 0.031, 0.031, 0.024, 0.024), (0.0, 0.0, 0.0)),
    "lower_arm": ((FOREARM + HAND, 0.025, 0.025, 0.011, 0.011), (0.0, 0.0, 0.0)),
    "upper_leg": ((THIGH, 0.052, 0.052, 0.035, 0.035), (0.0, 0.0, 0.0)),
    "lower_leg": ((SHANK, 0.035, 0.035, 0.022, 0.022), (0.0, 0.0, 0.0)),
    "foot": ((0.130, 0.021, 0.019, 0.024, 0.012), (0.0, -0.022, -0.018)),
}
OFFSETS = {
    "waist": (0.0, WAIST, 0.0),
    "neck_base": (0.0, TRUNK - WAIST, 0.0),
    "neck": (0.0, THROAT, 0.0),
    "shoulder": (SHOULDER_HALF_BREADTH, TRUNK - WAIST, 0.0),
    "elbow": (0.0, UPPER_ARM, 0.0),
    "hip": (HIP_HALF_BREADTH, 0.0, 0.0),
    "knee": (0.0, THIGH, 0.0),
    "ankle": (0.0, SHANK, 0.0),
}


def body_of_height(height: float) -> Bdp:
    """Fourteen-part average body of a height in metres."""
    sizes, tips, bases, offsets = [], [], [], []
    for joint in FOURTEEN_PARTS.joints:
        shape, base = SHAPES[without_side(joint.part)]
        x, y, z = OFFSETS.get(without_side(joint.name), (0.0, 0.0, 0.0))
        sizes.append(shape[:3])
        tips.append(shape[3:])
        bases.append(base)
        offsets.append((-x if joint.name.startswith("right_") else x, y, z))
    return Bdp(height * np.array(sizes), height * np.array(offsets), height * np.array(tips), height * np.array(bases))


def average_body(anatomy: Anatomy, height: float) -> Bdp:
    """Average body of any anatomy, of a height in metres."""
    if anatomy is FOURTEEN_PARTS:
        return body_of_height(height)
    return body_from_lengths(anatomy, average_lengths(height))


def stature_of(anatomy: Anatomy, body: Bdp) -> float:
    """Height in metres, from the thigh; exact for an average body."""
    knee = next(k for k, joint in enumerate(anatomy.joints) if joint.name == "right_knee")
    return float(body.offsets[knee][1] / average_body(anatomy, 1.0).offsets[knee][1])
