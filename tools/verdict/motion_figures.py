"""Figures of poses: speed, shaking, difference of both passes, joints at limits."""

from collections.abc import Sequence

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.tools.verdict.evidence import Evidence, PoseRow, TakeBody
from zenocap.tools.verdict.parameters import (
    FAST_LIMB,
    FAST_TRUNK,
    LIMIT_RAD,
    LONGEST_STEP_S,
    MOST_DISAGREEMENT_M,
    MOST_SHAKING,
)

MOTION = ("jump", "shaking", "passes", "limits")


def motion_figures(evidence: Evidence, body: TakeBody, times: Ints, rows: Sequence[PoseRow]) -> Floats:
    """(n, MOTION) of every pose: whether the step to it is too fast, change of speed m/s, distance of passes m, angles at
    the ends of their ranges; NaN where unknown."""
    out = np.full((len(rows), len(MOTION)), np.nan)
    ends = np.full((len(rows), len(body.anatomy.parts), 3), np.nan)
    limits = body.anatomy.limits[body.order]
    single = np.array([len(joint.axes) == 1 for joint in body.anatomy.joints for _ in joint.axes])[body.order]
    for k, row in enumerate(rows):
        if row.lost:
            continue
        ends[k] = _ends(body, body.pose(row))
        beyond = (row.angles > limits[:, 1] - LIMIT_RAD) | (~single & (row.angles < limits[:, 0] + LIMIT_RAD))
        out[k, 3] = np.mean(beyond)
        ahead = evidence.forward.get(int(times[k]))
        if evidence.both and ahead is not None and not ahead.lost:
            apart = np.linalg.norm(_ends(body, body.pose(ahead)) - ends[k], axis=1)
            out[k, 2] = min(MOST_DISAGREEMENT_M, float(np.mean(apart)))
    steps_s = np.diff(times) / 1e9
    if len(rows) > 1:
        velocity = np.diff(ends, axis=0) / np.maximum(steps_s, 1e-3)[:, None, None]
        velocity[steps_s > LONGEST_STEP_S] = np.nan
        speed = np.linalg.norm(velocity, axis=2)
        known = np.isfinite(speed).all(axis=1)
        fast: Bools = (speed[:, 0] > FAST_TRUNK) | (speed.max(axis=1) > FAST_LIMB)
        out[1:, 0] = np.where(known, fast, np.nan)
        change = np.linalg.norm(np.diff(velocity, axis=0), axis=2).mean(axis=1)
        out[2:, 1] = np.minimum(change, MOST_SHAKING)
    return out


def _ends(body: TakeBody, pose: Pose) -> Floats:
    """(parts, 3) far ends of the parts, metres."""
    frames = part_frames(body.anatomy, body.bdp, pose)
    ends: Floats = frames[:, :, 3] + body.bdp.sizes[:, :1] * frames[:, :, 1]
    return ends
