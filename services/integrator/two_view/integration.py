"""Universal BAP from the partial BAPs of two viewers.  [Two-view 4.4]

A view shows the projection of a body part and not its slant along the view axis.  The direction of each viewer therefore
has full weight across its axis and little along it, times the visibility of the limb.
"""

# Paper (replaced): 4.4 takes theta_Z of the facade and theta_X of the flank; in its ideal rig the weights give the same.

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, radians

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.segments import Limb as LimbIndex
from zenocap.services.integrator import parameters


@dataclass(frozen=True)
class ViewedLimbs:
    """Limbs of one viewer, in the torso's frame: directions (4, 2, 3), visible (4,) in [0, 1], view axis (3,)."""

    directions: Floats
    visible: Floats
    axis: Floats


def integrate_limbs(views: Sequence[ViewedLimbs], resting: Floats, squatting: bool) -> Floats:
    """Directions (4, 2, 3) in the torso's frame from one or two views; resting: (2, 3) of a hanging arm."""
    merged = np.empty((4, 2, 3))
    for limb in range(4):
        leg = limb >= 2
        along = (parameters.ALONG_SQUAT if squatting else parameters.ALONG_LEG) if leg else parameters.ALONG_ARM
        for part in range(2):
            information, weighted = np.zeros((3, 3)), np.zeros(3)
            for view in views:
                weight = 1.0 if leg else view.visible[limb] + parameters.HIDDEN_ARM
                across = weight * (np.eye(3) - (1 - along) * np.outer(view.axis, view.axis))
                information += across
                weighted += across @ view.directions[limb, part]
            if not leg:
                information += parameters.RESTING_ARM * np.eye(3)
                weighted += parameters.RESTING_ARM * resting[part]
            direction = np.linalg.solve(information, weighted)
            merged[limb, part] = direction / max(float(np.linalg.norm(direction)), 1e-9)
    return merged


def select_angles(facade: Floats, flank: Floats, table: Sequence[LimbIndex], squatting: bool) -> Floats:
    """(angles,) radians: each angle of a limb from the view that determines it.  [Two-view 4.4]

    facade, flank: (angles,) of each viewer.  table: limbs, in the order of the anatomy.  squatting: the facade viewer has
    bent the knees.
    """
    angles = flank.copy()
    for limb in table:
        angles[limb.z] = facade[limb.z]
        if not limb.is_leg:
            angles[limb.y], angles[limb.flexion] = facade[limb.y], facade[limb.flexion]
            continue
        # Paper (corrected): 175 to 180 degrees in 4.4; a leg may be on either side of straight down, here 175 to 185.
        # Paper (replaced): by 4.4 theta_Z alone decides; here a leg also counts as lifted while the navel is not lowered.
        lifted = abs(float(facade[limb.z]) - pi) < parameters.STRAIGHT_LEG
        if squatting and not lifted:
            angles[limb.x], angles[limb.flexion] = facade[limb.x], facade[limb.flexion]
    return angles


def is_lowered(navel_height: float, initial_height: float) -> bool:
    """True when the navel is below its height in the T-pose, both in metres: the knees are bent.  [Two-view 3.4]"""
    return navel_height < initial_height


def is_squatting(navel_height: float, initial_height: float, hips_z: tuple[float, float]) -> bool:
    """True when a lowered navel means squatting rather than a lifted leg.  [Two-view 4.4]

    navel_height, initial_height: metres.  hips_z: theta_Z of right and left hip in the facade, radians.
    """
    # Paper (replaced): in 3.4 any lowering is a squat; here by more than a threshold, which depends on the legs.
    straight = all(abs(z - pi) < parameters.STRAIGHT_LEG for z in hips_z)
    return navel_height < initial_height - (parameters.SQUAT_LIFTED_M if straight else parameters.SQUAT_M)


def turn_of_body(profiles: Sequence[Sequence[float]], turns: Floats, off_axis: float) -> float:
    """Turn about the vertical, radians, with the largest sum of the log matching scores of the views.

    profiles: per view, scores at `turns` (n,), evenly spaced radians.  off_axis: yaw minus the axis of the facade viewer.
    """
    # Paper (replaced): in 3.1 and 4.3 the body turns by 90 degrees when facade and flank change; here continuously.
    step = float(turns[1] - turns[0])
    total = np.sum(np.array(profiles), axis=0)
    total = (
        total
        - parameters.TURN_COST * (turns / step) ** 2
        - parameters.FACING_COST * ((off_axis + turns) / radians(45)) ** 2
    )
    best = int(np.argmax(total))
    turn = float(turns[best])
    if 0 < best < len(turns) - 1:
        left, middle, right = total[best - 1 : best + 2]
        curvature = left - 2 * middle + right
        if curvature < 0:
            turn += step * 0.5 * float((left - right) / curvature)
    return float(np.clip(turn, -parameters.MOST_TURN, parameters.MOST_TURN))


def best_hypotheses(profiles: Sequence[Sequence[float]], cost: float) -> int:
    """Hypotheses i, j of both limbs of a pair with the largest sum of log matching scores of the views, as i * n + j.

    profiles: per view, scores of all n * n combinations.  cost: log matching score that each limb must gain that is
    not in its last direction (hypothesis 0).  0 when no combination does, or when the numbers of combinations differ.
    """
    if not profiles or len({len(profile) for profile in profiles}) != 1 or not profiles[0]:
        return 0
    total = np.sum(np.array(profiles), axis=0)
    count = round(len(total) ** 0.5)
    changed = (np.arange(count) > 0).astype(float)
    return int(np.argmax(total - cost * np.add.outer(changed, changed).reshape(-1)))


def exchange_evidence(before: float, gain: float) -> tuple[float, bool]:
    """(evidence, True when the legs are exchanged) after a frame with this gain in the facade."""
    # Paper (added): 4.4 does not exchange legs.
    evidence = max(parameters.EXCHANGE_FLOOR, parameters.EXCHANGE_MEMORY * before + gain + parameters.EXCHANGE_BIAS)
    return (0.0, True) if evidence > parameters.EXCHANGE_AT else (evidence, False)


def spine_after(spine: Floats, tilts: Sequence[tuple[float, Floats]]) -> Floats:
    """+Y of the torso in the world (3,) after the tilts of the views: (angle in radians, view axis (3,) in the world)."""
    moved = spine.copy()
    for angle, axis in tilts:
        moved = moved + np.sin(angle) * np.cross(axis, spine)
    unit: Floats = moved / np.linalg.norm(moved)
    return unit
