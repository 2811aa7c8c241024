"""Universal BAP from the two viewers' partial ones.  [Two-view 4.4]

A view shows a part's projection and says nothing about its slant along the view's own axis.  Each viewer's direction
therefore counts fully across its axis and hardly along it, by how far it shows the limb: in the paper's ideal rig this
takes theta_Z from the facade and theta_X from the flank.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

from common.body.anatomy import Floats

ALONG_ARM, ALONG_LEG, ALONG_SQUAT = 0.1, 0.03, 0.3  # what a view's direction counts along its own axis
SEEN_AT_LEAST, RESTING = 0.02, 0.02  # weight of a hidden limb, and of the arm's rest where nothing is seen
LIFT_TOLERANCE = radians(5)  # [Two-view 4.4]: 175 to 180 degrees, here about the initial stance

# TURN_COST, FACING_COST and EXCHANGE_* were tried out on the shared clips walk2, bend2 and kick2, not on other people:
# those clips are therefore no independent test of them.
TURN_COST = 0.02  # log matching score of a turn by 8 degrees: noise must not turn the body
FACING_COST = 0.2  # the same for standing 45 degrees off the facade viewer's axis
MOST_TURN = radians(12)  # in one frame

ARM_COST, LEG_COST = 0.03, 0.03  # log matching score that another way of a limb must gain

EXCHANGE_BIAS = 0.015  # the pose that was tracked is refined frame after frame, the exchanged one was just made
EXCHANGE_KEPT, EXCHANGE_AT, EXCHANGE_FLOOR = 0.85, 0.06, -0.06  # memory and thresholds of the legs' exchange


@dataclass(frozen=True)
class ViewedLimbs:
    """One viewer's limbs.  directions: (4, 2, 3) in the torso's frame.  visible: (4,).  axis: (3,) of the view, there."""

    directions: Floats
    visible: Floats
    axis: Floats


def integrate_limbs(views: Sequence[ViewedLimbs], resting: Floats, squatting: bool) -> Floats:
    """Directions (4, 2, 3) in the torso's frame from one or two views; resting: (2, 3) a hanging arm's."""
    merged = np.empty((4, 2, 3))
    for limb in range(4):
        leg = limb >= 2
        along = (ALONG_SQUAT if squatting else ALONG_LEG) if leg else ALONG_ARM
        for part in range(2):
            normal, pull = np.zeros((3, 3)), np.zeros(3)
            for view in views:
                weight = 1.0 if leg else view.visible[limb] + SEEN_AT_LEAST
                across = weight * (np.eye(3) - (1 - along) * np.outer(view.axis, view.axis))
                normal += across
                pull += across @ view.directions[limb, part]
            if not leg:
                normal += RESTING * np.eye(3)
                pull += RESTING * resting[part]
            direction = np.linalg.solve(normal, pull)
            merged[limb, part] = direction / max(float(np.linalg.norm(direction)), 1e-9)
    return merged


def is_squatting(navel_height: float, initial_height: float, hips_z: tuple[float, float], stance: float) -> bool:
    """Whether a lowered navel means squatting rather than a lifted leg.  [Two-view 4.4]

    navel_height, initial_height: metres.  hips_z: theta_Z of right and left hip as the facade sees them; stance: how far
    they stood from straight down in the initial posture, radians.  A leg within 5 degrees of the stance is being lifted.
    """
    # Paper: within 175 to 180 degrees, which a stance wider than 5 degrees never meets.
    lifting = all(abs(abs(z - np.pi) - stance) < LIFT_TOLERANCE for z in hips_z)
    return navel_height < initial_height - (0.10 if lifting else 0.04)


def turn_of_body(profiles: Sequence[Sequence[float]], turns: Floats, off_axis: float) -> float:
    """Turn about the vertical, radians, with the best sum of the views' log matching scores.

    profiles: per view, scores at `turns` (n,), evenly spaced.  off_axis: yaw less the facade viewer's axis now.
    """
    step = float(turns[1] - turns[0])
    total = np.sum(np.array(profiles), axis=0)
    total = total - TURN_COST * (turns / step) ** 2 - FACING_COST * ((off_axis + turns) / radians(45)) ** 2
    best = int(np.argmax(total))
    turn = float(turns[best])
    if 0 < best < len(turns) - 1:
        left, middle, right = total[best - 1 : best + 2]
        curvature = left - 2 * middle + right
        if curvature < 0:
            turn += step * 0.5 * float((left - right) / curvature)
    return float(np.clip(turn, -MOST_TURN, MOST_TURN))


def best_way(profiles: Sequence[Sequence[float]], cost: float) -> int:
    """The way both limbs of a pair are, i * n + j for ways i and j: the best sum of the views' log matching scores.

    profiles: per view, scores of all n * n combinations.  cost: what each limb that is not as expected must gain.  0 when
    no combination does, or when the views do not speak of the same ones.
    """
    if not profiles or len({len(profile) for profile in profiles}) != 1 or not profiles[0]:
        return 0
    total = np.sum(np.array(profiles), axis=0)
    count = round(len(total) ** 0.5)
    changed = (np.arange(count) > 0).astype(float)
    return int(np.argmax(total - cost * np.add.outer(changed, changed).reshape(-1)))


def exchange_evidence(before: float, gain: float) -> tuple[float, bool]:
    """(evidence, whether the legs have been taken for each other) after a frame's gain in the facade."""
    evidence = max(EXCHANGE_FLOOR, EXCHANGE_KEPT * before + gain + EXCHANGE_BIAS)
    return (0.0, True) if evidence > EXCHANGE_AT else (evidence, False)


def spine_after(spine: Floats, tilts: Sequence[tuple[float, Floats]]) -> Floats:
    """The torso's +Y in the world (3,) after each view's tilt: (angle, view axis in the world)."""
    moved = spine.copy()
    for angle, axis in tilts:
        moved = moved + np.sin(angle) * np.cross(axis, spine)
    unit: Floats = moved / np.linalg.norm(moved)
    return unit
