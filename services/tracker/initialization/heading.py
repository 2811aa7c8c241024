"""Front and back: which way the feet point.

Two views show a person from the front and from behind with almost the same silhouettes, and a body that is turned round
fits nearly as well.  Feet are the exception: they reach three times as far forward of the ankle as backward.
"""

# Paper (added): [Hybrid V] does not look at the feet.

from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats32
from zenocap.common.body.anatomy import Anatomy
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.average_body import ANKLE_HEIGHT
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of
from zenocap.services.tracker.hull.contour_rays import midpoints
from zenocap.services.tracker.states import Tracking


def foot_reach(anatomy: Anatomy, model: BodyModel, rays: Floats32, pose: RootedPose, stature: float) -> float | None:
    """Reach of the scene at the feet before the line of the shanks, metres, mean of both; None without.

    rays: (11, n).  forward: the horizontal heading of the root.  The shanks' line is that of their scene points, because
    a body that faces the wrong way has them too far behind.
    """
    frames = frames_of(model, pose)
    forward = np.array([pose.rotation[0, 2], 0.0, pose.rotation[2, 2]])
    forward /= max(float(np.linalg.norm(forward)), 1e-9)
    points, reaches = midpoints(rays), []
    for side in ("right", "left"):
        part = anatomy.index[f"{side}_lower_leg"]
        along, length = frames[part, :, 1], model.lengths[part]
        if along[1] > -p.UPRIGHT_SHANK:  # of one who kneels or lies
            continue
        ankle = frames[part, :, 3] + along * length
        from_ankle = points - ankle
        sole = ankle[1] - (ANKLE_HEIGHT * stature if f"{side}_foot" in anatomy.parts else 0.0)
        low = points[:, 1] < max(sole, -p.GROUND_TOLERANCE_M) + p.FOOT_HEIGHT * stature
        foot = low & (np.hypot(from_ankle[:, 0], from_ankle[:, 2]) < p.FOOT_RADIUS * stature)
        up = -(from_ankle @ along)
        aside = from_ankle + np.outer(up, along)
        shank = (up > p.SHANK[0] * length) & (up < p.SHANK[1] * length)
        shank &= np.linalg.norm(aside, axis=1) < p.SHANK_RADIUS * stature
        if np.count_nonzero(foot) >= p.MIN_FOOT_RAYS and np.count_nonzero(shank) >= p.MIN_FOOT_RAYS:
            reaches.append(float((from_ankle[foot] @ forward).mean() - np.median(aside[shank] @ forward)))
    return float(np.mean(reaches)) if reaches else None


def with_toes(anatomy: Anatomy, after: Tracking, rays: Floats32, *, alone: bool) -> Tracking:
    """The running mean of the feet's reach with one more frame, and whether the heading is known from it.

    alone: False where rivals of the heading decide.
    """
    person = after.person
    reach = foot_reach(anatomy, person.model, rays, after.estimate, person.stature)
    if reach is None:
        return after
    toes = after.toes + p.TOES_RATE * (reach / person.stature - after.toes)
    known = person.heading_known or (alone and toes > p.HEADING_TOES)
    return replace(after, toes=toes, person=replace(person, heading_known=known))
