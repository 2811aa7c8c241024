"""From measured lengths to a body: [Two-view 2.4], with anthropometric proportions where the paper is silent."""

from collections.abc import Mapping

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp

# The sources below are named from memory; their tables have not been checked against these numbers.
# Proportions where the paper is silent, or where its own (torso : leg = 4 : 6) would raise the hips by 84 mm.
# Heights over body height: Drillis and Contini (1966), as in Winter, Biomechanics, 4th ed., fig. 4.1.
HIP_HEIGHT, KNEE_HEIGHT, SHOULDER_HEIGHT = 0.530, 0.285, 0.818
# Shoulder joint centre: biacromial breadth 0.225 (Gordon et al. 1989), less 0.011 from either acromion to the joint.
# Paper: the torso's edge, which in a silhouette is anything from the waist's to the deltoid's.
SHOULDER_HALF_BREADTH = 0.225 / 2 - 0.011
# Joint centres, mean of both sexes (de Leva 1996): upper arm, forearm, wrist to fingertip in mm.
UPPER_ARM_SHARE = 278.4 / (278.4 + 266.6 + 180.0)
# Hip joint centre: 0.36 of the distance between the iliac spines from the middle (Bell et al. 1990), that distance 0.151
# of body height (Gordon et al. 1989).
HIP_HALF_BREADTH = 0.36 * 0.151

# The initial posture, in body heights: arms stretched sideways seen from the front, nothing sticking out from the side.
FRONT_SPAN = (0.70, 1.30)
SIDE_WIDTH = 0.55

# What each view of it tells, in metres.
FRONT_LENGTHS = ("height", "torso_width", "arm_span", "arm_thickness", "head_width", "thigh_width", "leg_width")
SIDE_LENGTHS = ("height", "torso_depth", "head_depth")


def body_from_lengths(anatomy: Anatomy, lengths: Mapping[str, float]) -> Bdp:
    """One body from the lengths of `viewer.body_definition` in metres, all in one scale.

    Raises ValueError for a body no person has.
    """
    height = lengths["height"]
    hip, shoulder = HIP_HEIGHT * height, SHOULDER_HEIGHT * height
    torso = shoulder - hip
    arm_radius = lengths["arm_thickness"] / 2
    shoulder_half = SHOULDER_HALF_BREADTH * height
    arm = lengths["arm_span"] / 2 - shoulder_half
    upper_leg, lower_leg = hip - KNEE_HEIGHT * height, KNEE_HEIGHT * height
    thigh_radius, shin_radius = lengths["thigh_width"] / 2, lengths["leg_width"] / 2
    sizes = {
        "torso": (torso, lengths["torso_width"] / 2, lengths["torso_depth"] / 2),
        "head": (height - shoulder, lengths["head_width"] / 2, lengths["head_depth"] / 2),
        "upper_arm": (UPPER_ARM_SHARE * arm, arm_radius, arm_radius),
        "lower_arm": ((1 - UPPER_ARM_SHARE) * arm, arm_radius, arm_radius),
        "upper_leg": (upper_leg, thigh_radius, thigh_radius),
        "lower_leg": (lower_leg, shin_radius, shin_radius),
    }
    for part, size in sizes.items():
        if min(size) < 0.02 or max(size) > 1.2:
            raise ValueError(f"{part}: size {tuple(round(float(s), 3) for s in size)} m is not a person's (0.02 to 1.2)")
    offsets = {
        "neck": (0.0, torso, 0.0),
        "shoulder": (shoulder_half, torso, 0.0),
        "elbow": (0.0, sizes["upper_arm"][0], 0.0),
        "hip": (HIP_HALF_BREADTH * height, 0.0, 0.0),
        "knee": (0.0, upper_leg, 0.0),
    }
    return _by_anatomy(anatomy, sizes, offsets)


def lengths_of_height(height: float) -> Mapping[str, float]:
    """Every length of `body_from_lengths` for a person of whom only the height is known, metres.

    The shares of body height are rough estimates of an average adult, taken from no table.
    """
    shares = {
        "height": 1.0, "torso_width": 0.200, "torso_depth": 0.135, "arm_span": 1.015, "arm_thickness": 0.050,
        "head_width": 0.085, "head_depth": 0.105, "thigh_width": 0.090, "leg_width": 0.062,
    }  # fmt: skip
    return {name: share * height for name, share in shares.items()}


def stretched_angles(anatomy: Anatomy) -> Floats:
    """(angles,) of the initial posture: upright, arms stretched sideways."""
    angles = anatomy.neutral.copy()
    angles[anatomy.index["right_shoulder.z"]] = np.pi / 2
    angles[anatomy.index["left_shoulder.z"]] = 3 * np.pi / 2
    return angles


def _by_anatomy(
    anatomy: Anatomy,
    sizes: Mapping[str, tuple[float, float, float]],
    offsets: Mapping[str, tuple[float, float, float]],
) -> Bdp:
    rows, origins = [], []
    for joint in anatomy.joints:
        rows.append(sizes[joint.part.removeprefix("right_").removeprefix("left_")])
        x, y, z = offsets.get(joint.name.removeprefix("right_").removeprefix("left_"), (0.0, 0.0, 0.0))
        origins.append((-x if joint.name.startswith("right_") else x, y, z))
    return Bdp(np.array(rows), np.array(origins))
