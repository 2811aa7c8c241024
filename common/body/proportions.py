"""Bodies from measured lengths [Two-view 2.4] and anthropometric proportions."""

from collections.abc import Mapping

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy, without_side
from zenocap.common.body.definition import Bdp

# Paper (corrected): 2.4 divides torso : leg as 4 : 6, which would make it 84 mm longer; here by anthropometry.
# Paper (replaced): 2.4 takes the head from y_h and halves leg and arm; here shares of height and span.
# The sources are cited from memory; the numbers have not been checked against their tables.
# Heights over body height: Drillis and Contini (1966), as in Winter, Biomechanics, 4th ed., fig. 4.1.
HIP_HEIGHT, KNEE_HEIGHT, SHOULDER_HEIGHT = 0.530, 0.285, 0.818
# Shoulder joint centre: biacromial breadth 0.225 (Gordon et al. 1989), less 0.011 from either acromion to the joint.
# Paper (replaced): 2.4 takes the torso's edge, which in a silhouette varies between waist and deltoid.
SHOULDER_HALF_BREADTH = 0.225 / 2 - 0.011
# Joint centres, mean of both sexes (de Leva 1996): upper arm, forearm, wrist to fingertip in mm.
UPPER_ARM_SHARE = 278.4 / (278.4 + 266.6 + 180.0)
# Paper (open): 2.4 gives no position of the hips.
# Hip joint centre: 0.36 of the distance between the iliac spines from the middle (Bell et al. 1990); that distance is 0.151
# of body height (Gordon et al. 1989).
HIP_HALF_BREADTH = 0.36 * 0.151

# Silhouette of the T-pose, in body heights, chosen by hand.
FRONT_SPAN = (0.70, 1.30)  # smallest and largest width from the front
SIDE_WIDTH = 0.55  # largest width from the side

PART_SIZE_M = (0.02, 1.2)  # smallest and largest size of a part; chosen by hand, wider than any person

# Lengths measured in each view of the T-pose, metres.
FRONT_LENGTHS = ("height", "torso_width", "arm_span", "arm_thickness", "head_width", "thigh_width", "leg_width")
SIDE_LENGTHS = ("height", "torso_depth", "head_depth")

# The same as printed in the paper.
PAPER_FRONT_LENGTHS = ("height", "head", "torso_width", "arm", "arm_thickness")
PAPER_SIDE_LENGTHS = ("height", "torso_depth")
PAPER_TORSO_SHARE = 0.4  # of the shoulder's height; paper 2.4, torso : leg = 4 : 6
# Paper (corrected): 2.4 divides torso : leg as 4 : 6, which makes the torso 84 mm longer; with proportions 37 : 63.
TORSO_SHARE = 0.37  # the same by anthropometry, see above
SHOULDER_DROP = 0.45  # long radii of the torso from its top down to the shoulder joints; paper 2.4


def body_from_lengths(anatomy: Anatomy, lengths: Mapping[str, float]) -> Bdp:
    """Body definition from FRONT_LENGTHS and SIDE_LENGTHS, metres, all at one scale.

    Raises ValueError when a part's size is outside PART_SIZE_M.
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
        # Paper (replaced): 2.1 has legs of elliptic cross-section; here round: the side view shows both legs in one.
        "upper_leg": (upper_leg, thigh_radius, thigh_radius),
        "lower_leg": (lower_leg, shin_radius, shin_radius),
    }
    _check_sizes(sizes)
    offsets = {
        "neck": (0.0, torso, 0.0),
        # Paper (replaced): 2.4 puts shoulders 0.45 LR below the torso's top, with y up and down mixed; here at the top.
        "shoulder": (shoulder_half, torso, 0.0),
        "elbow": (0.0, sizes["upper_arm"][0], 0.0),
        "hip": (HIP_HALF_BREADTH * height, 0.0, 0.0),
        "knee": (0.0, upper_leg, 0.0),
    }
    return _by_anatomy(anatomy, sizes, offsets)


def body_from_paper_lengths(anatomy: Anatomy, lengths: Mapping[str, float], torso_share: float) -> Bdp:
    """Body definition from PAPER_FRONT_LENGTHS and PAPER_SIDE_LENGTHS, metres, all at one scale.  [Two-view 2.4]

    torso_share: of the shoulder's height, PAPER_TORSO_SHARE or TORSO_SHARE; the legs have the rest.
    Raises ValueError when a part's size is outside PART_SIZE_M.
    """
    width, shoulder = lengths["torso_width"], lengths["height"] - lengths["head"]
    torso, leg = torso_share * shoulder, (1 - torso_share) * shoulder / 2
    arm_radius = lengths["arm_thickness"] / 2
    sizes = {
        "torso": (torso, width / 2, lengths["torso_depth"] / 2),
        "head": (lengths["head"], 0.2 * width, 0.16 * width),
        "upper_arm": (lengths["arm"] / 2, arm_radius, arm_radius),
        "lower_arm": (lengths["arm"] / 2, arm_radius, arm_radius),
        # Paper (open): of which axis the legs' radii are; 0.2 W across fits the front view.
        "upper_leg": (leg, 0.2 * width, 0.36 * width),
        "lower_leg": (leg, 0.2 * width, 0.36 * width),
    }
    _check_sizes(sizes)
    offsets = {
        "neck": (0.0, torso, 0.0),
        "shoulder": (width / 2, torso - SHOULDER_DROP * width / 2, 0.0),
        "elbow": (0.0, lengths["arm"] / 2, 0.0),
        "hip": (HIP_HALF_BREADTH * lengths["height"], 0.0, 0.0),  # Paper (open): the position of the hips is not given
        "knee": (0.0, leg, 0.0),
    }
    return _by_anatomy(anatomy, sizes, offsets)


# Paper (added): a body from the height alone, without the T-pose.
def average_lengths(height: float) -> Mapping[str, float]:
    """Lengths for `body_from_lengths` of an average person of this height, metres.

    The shares of body height are rough estimates of an average adult, chosen by hand.
    """
    shares = {
        "height": 1.0, "torso_width": 0.200, "torso_depth": 0.135, "arm_span": 1.015, "arm_thickness": 0.050,
        "head_width": 0.085, "head_depth": 0.105, "thigh_width": 0.090, "leg_width": 0.062,
    }  # fmt: skip
    return {name: share * height for name, share in shares.items()}


def t_pose_angles(anatomy: Anatomy) -> Floats:
    """Joint angles (angles,) of the T-pose (the initial posture): upright, arms stretched sideways; radians."""
    angles = anatomy.neutral.copy()
    angles[anatomy.index["right_shoulder.z"]] = np.pi / 2
    angles[anatomy.index["left_shoulder.z"]] = 3 * np.pi / 2
    return angles


def _check_sizes(sizes: Mapping[str, tuple[float, float, float]]) -> None:
    for part, size in sizes.items():
        if min(size) < PART_SIZE_M[0] or max(size) > PART_SIZE_M[1]:
            found = tuple(round(float(s), 3) for s in size)
            raise ValueError(f"{part}: size {found} m; allowed: {PART_SIZE_M[0]} to {PART_SIZE_M[1]} m")


def _by_anatomy(
    anatomy: Anatomy, sizes: Mapping[str, tuple[float, float, float]], offsets: Mapping[str, tuple[float, float, float]]
) -> Bdp:
    rows, origins = [], []
    for joint in anatomy.joints:
        rows.append(sizes[without_side(joint.part)])
        x, y, z = offsets.get(without_side(joint.name), (0.0, 0.0, 0.0))
        origins.append((-x if joint.name.startswith("right_") else x, y, z))
    return Bdp(np.array(rows), np.array(origins))
