"""Postures from which a search starts: common ones upright, and those on the floor."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Pose
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of

Sides = tuple[int, int]  # degrees from hanging straight, right and left
STRIDE = {"hip.x": (50, -15), "knee.x": (-50, -70), "shoulder.x": (-40, 35), "elbow.x": (80, 80)}
GUARD = {"shoulder.x": (30, 30), "elbow.x": (100, 100)}  # fists before the chest
ASIDE = {"hip.x": (30, 30), "knee.x": (-50, -50), "shoulder.x": (50, 50), "elbow.x": (40, 40)}
FLOOR: Mapping[str, tuple[tuple[int, int], Mapping[str, Sides]]] = {  # degrees: leaning to the front, and to the right
    "crouching": ((30, 0), {"hip.x": (130, 130), "knee.x": (-140, -140), "ankle.x": (35, 35), "shoulder.x": (40, 40)}),
    "kneeling": ((0, 0), {"knee.x": (-90, -90), "ankle.x": (-40, -40)}),
    "sitting": ((-10, 0), {"hip.x": (80, 80), "shoulder.x": (-35, -35)}),
    "on all fours": ((75, 0), {"hip.x": (75, 75), "knee.x": (-90, -90), "ankle.x": (-40, -40), "shoulder.x": (105, 105)}),
    "on the back": ((-90, 0), {}),
    "on the front": ((90, 0), {"ankle.x": (-40, -40)}),
    "on the right side": ((0, 90), ASIDE),
    "on the left side": ((0, -90), ASIDE),
}


@lru_cache
def search_postures(anatomy: Anatomy) -> tuple[RootedPose, ...]:
    """Postures to start a search from: standing, T-pose, fists up, two strides."""
    mirrored = {name: (left, right) for name, (right, left) in STRIDE.items()}
    found = [t_pose_angles(anatomy), *(_angles(anatomy, changes) for changes in ({}, GUARD, STRIDE, mirrored))]
    return tuple(_posture(anatomy, (0, 0), angles) for angles in found)


def floor_postures(anatomy: Anatomy, model: BodyModel, height: float, count: int) -> list[RootedPose]:
    """Of FLOOR the ones nearest to a height in metres, with the lowest point at 0 and the middle at the origin."""
    found = []
    for lean, changes in FLOOR.values():
        pose = _posture(anatomy, lean, _angles(anatomy, changes))
        low, high = corners(model, pose)
        middle = 0.5 * (low + high)
        pose = pose._replace(position=np.array([-middle[0], -low[1], -middle[2]]))
        found.append((abs(float(high[1] - low[1]) - height), pose))
    return [pose for _, pose in sorted(found, key=lambda one: one[0])[:count]]


def corners(model: BodyModel, pose: RootedPose) -> tuple[Floats, Floats]:
    """(3,) lowest and (3,) highest coordinates of a body's surface in the world, metres."""
    frames = frames_of(model, pose)
    rotation, radii = frames[:, None, :, :3], model.radii.reshape(-1, 2, 2)
    starts = frames[:, :, 3] + np.einsum("pij,pj->pi", frames[:, :, :3], model.bases)
    ends = np.stack([starts, starts + model.lengths[:, None] * frames[:, :, 1]], axis=1)  # (p, 2, 3)
    axes = np.stack([radii[..., 0], radii.mean(axis=2), radii[..., 1]], axis=2)  # as in `contact_on_part`
    reach = np.linalg.norm(rotation * axes[:, :, None, :], axis=3)
    return (ends - reach).min(axis=(0, 1)), (ends + reach).max(axis=(0, 1))


def floor_start(posture: RootedPose, place: Floats, yaw: float) -> RootedPose:
    """One of `floor_postures` at a place (3,) on the floor, turned by yaw radians about the vertical."""
    start = turned_start(posture, place, yaw)
    return start._replace(position=place + start.rotation @ posture.rotation.T @ posture.position)


def turned_start(posture: RootedPose, position: Floats, yaw: float) -> RootedPose:
    """A posture at a position (3,), turned by yaw radians about the vertical."""
    c, s = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ posture.rotation
    return RootedPose(position.copy(), rotation, posture.values.copy())


def _angles(anatomy: Anatomy, changes: Mapping[str, Sides]) -> Floats:
    """Joint angles hanging straight but for changes, of joints that the anatomy has."""
    angles = anatomy.neutral.copy()
    for name, sides in changes.items():
        for side, degrees in zip(("right", "left"), sides, strict=True):
            if f"{side}_{name}" in anatomy.index:
                angles[anatomy.index[f"{side}_{name}"]] += np.radians(degrees)
    return angles


def _posture(anatomy: Anatomy, lean: tuple[int, int], angles: Floats) -> RootedPose:
    """Joint angles at the origin.  lean: degrees to the front, and to the right."""
    rotation = np.empty((3, 3))
    vector_to_matrix(np.radians([lean[0], 0.0, lean[1]]), rotation)
    return RootedPose(np.zeros(3), rotation, coordinates_of(anatomy).of_pose(Pose(np.zeros(3), angles)))
