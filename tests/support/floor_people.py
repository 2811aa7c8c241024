"""The simulated person on the floor: lying, sitting, kneeling, crouching."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import SIDES, neutral
from zenocap.simulation.body.rotation import rx, ry, rz
from zenocap.simulation.body.skeleton import FOOT, PELVIS, SHANK, Bones, pose_bones
from zenocap.simulation.body.surface import rest_surface, skin


class Floor(NamedTuple):
    """Degrees.  lean: of the whole person to the front, and to the right.  leg: flexion of hip, knee, downward foot.

    arm: abduction, flexion, outward rotation, elbow.  spine: flexion.
    """

    lean: tuple[float, float]
    leg: tuple[float, float, float]
    arm: tuple[float, float, float, float]
    spine: float = 0.0


FLOOR: Mapping[str, Floor] = {
    "crouching": Floor((25, 0), (128, 140, -30), (15, 50, 0, 30), 25),
    "kneeling": Floor((4, 0), (0, 96, 60), (10, 5, 0, 15), 5),
    "sitting": Floor((-12, 0), (80, 12, 10), (20, -40, 0, 10), 10),
    "on all fours": Floor((70, 0), (75, 98, 60), (5, 108, 0, 5), 5),
    "on the back": Floor((-90, 0), (4, 6, 20), (25, 0, 0, 15)),
    "on the front": Floor((90, 0), (0, 4, 55), (35, -4, 0, 4)),
    "on the side": Floor((0, 90), (40, 60, 15), (10, 60, 0, 50), 10),
}


def on_floor(subject: Person, name: str, heading: float = 0.0) -> Bones:
    """A posture of FLOOR with the hips above the origin.  heading: radians from +Z towards +X, before the person leans."""
    posture, upright = FLOOR[name], neutral(subject)
    hip, knee, toes = np.radians(posture.leg)
    upright.swing[:] = hip, 0.0, knee
    spine = upright.spine + np.radians([posture.spine, 0.0, 0.0])
    bones = pose_bones(subject, replace(upright, spine=spine, arms=np.radians([posture.arm, posture.arm])))
    for side in SIDES:
        bones.rotation[FOOT[side]] = bones.rotation[SHANK[side]] @ rx(toes)
    front, right = np.radians(posture.lean)
    turn, hips = ry(heading) @ rx(front) @ rz(right), bones.origin[PELVIS]
    lying = Bones(turn @ bones.rotation, (bones.origin - hips) @ turn.T)
    low = skin(rest_surface(subject), subject, lying)[0][:, 1].min()
    return replace(lying, origin=lying.origin - [0.0, low, 0.0])
