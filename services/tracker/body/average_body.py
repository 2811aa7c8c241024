"""Average body of a given height."""

import numpy as np

from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.body.proportions import (
    HIP_HALF_BREADTH,
    HIP_HEIGHT,
    KNEE_HEIGHT,
    SHOULDER_HALF_BREADTH,
    SHOULDER_HEIGHT,
    average_lengths,
    body_from_lengths,
)

# In body heights.  Segment lengths: Drillis and Contini (1966) as in Winter, Biomechanics, 4th ed., fig. 4.1 (from memory,
# as in `zenocap.common.body.proportions`).  Radii and positions of axes are rough estimates of an average clothed adult.
ANKLE_HEIGHT, UPPER_ARM, FOREARM, HAND, FOOT = 0.039, 0.186, 0.146, 0.108, 0.152
WAIST = 0.10  # of the bend of the spine above the hip joints
THROAT, SKULL = 0.040, 0.055  # of the head's joint above the shoulder line, and of the skull's axis above that
# Paper (replaced): [Hybrid II] has cylinders; here tapered parts.
SHAPES = {  # height, then long and short radius at the base and at the far end; where the axis begins
    "pelvis": ((WAIST - 0.02, 0.092, 0.064, 0.082, 0.058), (0.0, 0.02, 0.0)),
    "chest": ((SHOULDER_HEIGHT - HIP_HEIGHT - WAIST - 0.035, 0.082, 0.058, 0.092, 0.056), (0.0, 0.0, 0.0)),
    "neck_column": ((0.065, 0.070, 0.050, 0.034, 0.036), (0.0, -0.01, 0.0)),
    "head": ((1.0 - SHOULDER_HEIGHT - THROAT - SKULL, 0.044, 0.055, 0.044, 0.055), (0.0, SKULL, 0.008)),
    "upper_arm": ((UPPER_ARM, 0.031, 0.031, 0.024, 0.024), (0.0, 0.0, 0.0)),
    "lower_arm": ((FOREARM + HAND, 0.025, 0.025, 0.011, 0.011), (0.0, 0.0, 0.0)),
    "upper_leg": ((HIP_HEIGHT - KNEE_HEIGHT, 0.052, 0.052, 0.035, 0.035), (0.0, 0.0, 0.0)),
    "lower_leg": ((KNEE_HEIGHT - ANKLE_HEIGHT, 0.035, 0.035, 0.022, 0.022), (0.0, 0.0, 0.0)),
    "foot": ((0.130, 0.021, 0.019, 0.024, 0.012), (0.0, -0.022, -0.018)),
}
OFFSETS = {
    "waist": (0.0, WAIST, 0.0),
    "neck_base": (0.0, SHOULDER_HEIGHT - HIP_HEIGHT - WAIST, 0.0),
    "neck": (0.0, THROAT, 0.0),
    "shoulder": (SHOULDER_HALF_BREADTH, SHOULDER_HEIGHT - HIP_HEIGHT - WAIST, 0.0),
    "elbow": (0.0, UPPER_ARM, 0.0),
    "hip": (HIP_HALF_BREADTH, 0.0, 0.0),
    "knee": (0.0, HIP_HEIGHT - KNEE_HEIGHT, 0.0),
    "ankle": (0.0, KNEE_HEIGHT - ANKLE_HEIGHT, 0.0),
}


def body_of_height(height: float) -> Bdp:
    """Fourteen-part average body of a height in metres."""
    sizes, tips, bases, offsets = [], [], [], []
    for joint in FOURTEEN_PARTS.joints:
        shape, base = SHAPES[_common(joint.part)]
        x, y, z = OFFSETS.get(_common(joint.name), (0.0, 0.0, 0.0))
        sizes.append(shape[:3])
        tips.append(shape[3:])
        bases.append(base)
        offsets.append((-x if joint.name.startswith("right_") else x, y, z))
    return Bdp(height * np.array(sizes), height * np.array(offsets), height * np.array(tips), height * np.array(bases))


def _common(name: str) -> str:
    return name.removeprefix("right_").removeprefix("left_")


def average_body(anatomy: Anatomy, height: float) -> Bdp:
    """Average body of any anatomy, of a height in metres."""
    if anatomy is FOURTEEN_PARTS:
        return body_of_height(height)
    return body_from_lengths(anatomy, average_lengths(height))
