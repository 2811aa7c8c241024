"""Finding the pose of a body that is known, wherever it is in a scene, from a few everyday postures."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Pose
from common.body.proportions import HIP_HEIGHT, stretched_angles
from services.tracker.closest import Singles
from services.tracker.model import Model
from services.tracker.places import BELOW_M, column_in
from services.tracker.posed import Posed
from services.tracker.refine import Weights, distances_of, misfit_of, refine
from services.tracker.room import Room

ON_BODY_M = 0.04  # a ray so near belongs to the body
TURNS = 8  # facings that are tried
FAR_M = 0.30  # from so far away a body is pulled at first
FIRST = 4  # rounds of that
KEPT = 8  # of those that then fit best, refined
TURNED = 0.3  # how much larger the misfit of a body that faces the wrong way may be taken
PASSES = 3  # times, each held near where the one before ended
STRIDE = {"hip.x": (50, -15), "knee.x": (-50, -70), "shoulder.x": (-40, 35), "elbow.x": (80, 80)}  # degrees
GUARD = {"shoulder.x": (30, 30), "elbow.x": (100, 100)}  # degrees: fists before the chest


@lru_cache
def everyday(anatomy: Anatomy) -> tuple[Posed, ...]:
    """Postures to begin a search from: at ease, arms stretched, fists up, and two strides."""
    at_ease: dict[str, tuple[int, int]] = {}
    mirrored = {name: (left, right) for name, (right, left) in STRIDE.items()}
    found = [stretched_angles(anatomy)]
    for changes in (at_ease, GUARD, STRIDE, mirrored):
        angles = anatomy.neutral.copy()
        for name, sides in changes.items():
            for side, degrees in zip(("right", "left"), sides, strict=True):
                angles[anatomy.index[f"{side}_{name}"]] += np.radians(degrees)
        found.append(angles)
    coordinates = coordinates_of(anatomy)
    return tuple(Posed(np.zeros(3), np.eye(3), coordinates.of_pose(Pose(np.zeros(3), angles))) for angles in found)


def found_in(
    model: Model,
    rays: Singles,
    room: Room,
    postures: Sequence[Posed],
    stature: float,
    weights: Weights,
    rounds: int,
    facing: Floats | None = None,
) -> Posed | None:
    """The best pose of a known body in a scene of rays (11, n); None when nobody stands there.

    postures: to begin from, each facing everywhere.  stature: metres, where the hips are looked for.  rounds: of a pass.
    facing: (3, 3) orientation of the root that is preferred, if any is.
    """
    column = column_in(rays)
    if column is None:
        return None
    low = max(column.low, -BELOW_M)
    centre = np.array([column.centre[0], low + HIP_HEIGHT * stature, column.centre[1]])
    begun = []
    for posture in postures:
        for turn in range(TURNS):
            yaw = 2 * np.pi * turn / TURNS
            c, s = np.cos(yaw), np.sin(yaw)
            rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ posture.rotation
            start = Posed(centre.copy(), rotation, posture.values.copy())
            begun.append(_refined(model, rays, room, start, weights._replace(limit=FAR_M), FIRST))
    begun.sort(key=lambda pose: misfit(model, rays, room, pose, weights))
    ended = []
    for pose in begun[:KEPT]:
        for _ in range(PASSES):
            pose = _refined(model, rays, room, pose, weights, rounds)
        ended.append(pose)
    return min(ended, key=lambda pose: misfit(model, rays, room, pose, weights) * _reluctance(pose, facing))


def turned_round(
    model: Model, rays: Singles, room: Room, pose: Posed, postures: Sequence[Posed], weights: Weights, rounds: int
) -> Posed:
    """The best pose about where one is, but facing the other way; postures: to begin from."""
    back = pose.rotation @ np.diag([-1.0, 1.0, -1.0])
    begun = [
        _refined(model, rays, room, Posed(pose.position.copy(), back, posture.values.copy()), weights, FIRST)
        for posture in postures
    ]
    best = min(begun, key=lambda one: misfit(model, rays, room, one, weights))
    for _ in range(PASSES):
        best = _refined(model, rays, room, best, weights, rounds)
    return best


def _reluctance(pose: Posed, facing: Floats | None) -> float:
    """1 for a root that faces as it should, more for one that does not."""
    if facing is None:
        return 1.0
    return 1.0 + TURNED * 0.5 * (1.0 - float(pose.rotation[:, 2] @ facing[:, 2]))


def _refined(model: Model, rays: Singles, room: Room, start: Posed, weights: Weights, rounds: int) -> Posed:
    moved = start.copy()
    refine(
        model, rays, room, weights, rounds, moved.position, moved.rotation, moved.values,
        start.position, start.rotation, start.values,
    )  # fmt: skip
    return moved


def misfit(model: Model, rays: Singles, room: Room, pose: Posed, weights: Weights) -> float:
    """D of a pose in m^2.  [Hybrid Eq. 30], and what of the body is outside of the silhouettes."""
    return float(misfit_of(model, rays, room, weights.limit, pose.position, pose.rotation, pose.values))


def explained(model: Model, rays: Singles, pose: Posed) -> float:
    """The share of a scene that lies on the body."""
    if not rays.shape[1]:
        return 0.0
    return float(np.mean(distances_of(model, rays, pose.position, pose.rotation, pose.values) < ON_BODY_M))
