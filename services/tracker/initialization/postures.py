"""Postures from which a search starts."""

from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Pose
from zenocap.common.body.proportions import t_pose_angles
from zenocap.services.tracker.body.body_model import RootedPose

STRIDE = {"hip.x": (50, -15), "knee.x": (-50, -70), "shoulder.x": (-40, 35), "elbow.x": (80, 80)}  # degrees
GUARD = {"shoulder.x": (30, 30), "elbow.x": (100, 100)}  # degrees: fists before the chest


@lru_cache
def search_postures(anatomy: Anatomy) -> tuple[RootedPose, ...]:
    """Postures to start a search from: standing, T-pose, fists up, two strides."""
    relaxed: dict[str, tuple[int, int]] = {}
    mirrored = {name: (left, right) for name, (right, left) in STRIDE.items()}
    found = [t_pose_angles(anatomy)]
    for changes in (relaxed, GUARD, STRIDE, mirrored):
        angles = anatomy.neutral.copy()
        for name, sides in changes.items():
            for side, degrees in zip(("right", "left"), sides, strict=True):
                angles[anatomy.index[f"{side}_{name}"]] += np.radians(degrees)
        found.append(angles)
    coordinates = coordinates_of(anatomy)
    return tuple(RootedPose(np.zeros(3), np.eye(3), coordinates.of_pose(Pose(np.zeros(3), angles))) for angles in found)


def turned_start(posture: RootedPose, position: Floats, yaw: float) -> RootedPose:
    """A posture at a position (3,), turned by yaw radians about the vertical."""
    c, s = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ posture.rotation
    return RootedPose(position.copy(), rotation, posture.values.copy())
