"""From measured lengths to a body: [Two-view 2.4], with anthropometric proportions where the paper is silent."""

from collections.abc import Mapping

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp

# Proportions where the paper is silent, or where its own (torso : leg = 4 : 6) would raise the hips by 84 mm.
# Segment lengths over body height: Drillis and Contini (1966), as in Winter, Biomechanics, 4th ed., fig. 4.1.
HIP_HEIGHT, KNEE_HEIGHT = 0.530, 0.285
UPPER_ARM_SHARE = 0.186 / (0.186 + 0.146 + 0.108)  # of the arm with the hand
# Hip joint centre: 0.36 of the distance between the iliac spines from the middle (Bell et al. 1990), that distance 0.151
# of body height (Gordon et al. 1989).
HIP_HALF_BREADTH = 0.36 * 0.151
LONG_RADIUS_OF_HEAD, SHORT_RADIUS_OF_HEAD, RADIUS_OF_LEG = 0.2, 0.16, 0.2  # of W_torso  [Two-view 2.4]


def body_from_lengths(anatomy: Anatomy, lengths: Mapping[str, float]) -> Bdp:
    """One body from the lengths of `viewer.body_definition` in metres, all in one scale.

    Raises ValueError for a body no person has.
    """
    height, width = lengths["height"], lengths["torso_width"]
    hip = HIP_HEIGHT * height
    torso = lengths["shoulder_line"] - hip
    arm_radius = lengths["arm_thickness"] / 2
    shoulder_half = width / 2 - arm_radius  # the torso's columns end at the deltoids, one arm's radius past the joints
    arm = lengths["arm_span"] / 2 - shoulder_half
    depth = lengths["torso_depth"] / 2
    upper_leg, lower_leg = hip - KNEE_HEIGHT * height, KNEE_HEIGHT * height
    sizes = {
        "torso": (torso, width / 2, depth),
        "head": (height - lengths["shoulder_line"], lengths["head_width"] / 2, LONG_RADIUS_OF_HEAD * width),
        "upper_arm": (UPPER_ARM_SHARE * arm, arm_radius, arm_radius),
        "lower_arm": ((1 - UPPER_ARM_SHARE) * arm, arm_radius, arm_radius),
        "upper_leg": (upper_leg, RADIUS_OF_LEG * width, RADIUS_OF_LEG * width),
        "lower_leg": (lower_leg, lengths["leg_width"] / 2, lengths["leg_width"] / 2),
    }
    for part, size in sizes.items():
        if min(size) < 0.02 or max(size) > 1.2:
            raise ValueError(f"{part}: size {tuple(round(float(s), 3) for s in size)} m is not a person's (0.02 to 1.2)")
    offsets = {
        "neck": (0.0, torso, 0.0),
        "shoulder": (shoulder_half, lengths["arm_line"] - hip, 0.0),
        "elbow": (0.0, sizes["upper_arm"][0], 0.0),
        "hip": (HIP_HALF_BREADTH * height, 0.0, 0.0),
        "knee": (0.0, upper_leg, 0.0),
    }
    return _by_anatomy(anatomy, sizes, offsets)


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
