"""Finding a person: the initial posture in a scene, and any pose of a body that is known."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Pose
from common.body.proportions import HIP_HEIGHT, stretched_angles
from services.tracker.closest import Singles, points_of
from services.tracker.coordinates import coordinates_of
from services.tracker.measuring import Measured, Sample, measure
from services.tracker.model import Model
from services.tracker.posed import Posed
from services.tracker.refine import Weights, distances_of, misfit_of, refine
from services.tracker.sizes import COUNT
from services.tracker.stature import average_body

SHORTEST_M, TALLEST_M = 0.8, 2.4
BESIDE_M = 0.5  # from the middle, where head and feet are
SPAN = (0.65, 1.25)  # of the outstretched arms, in statures
DEEPEST = 0.55  # front to back, in statures
ARMS = 0.30  # statures from the middle: there is nothing but arms,
AT = (0.62, 0.95)  # at this height in statures,
ALL_ARMS = 0.75  # for this share of the rays out there; a shadow may be the rest
MOST_GAP_M = 0.03  # of a body that was measured well
HELD = 0.25  # rad around the initial posture
FURTHEST = np.radians(40.0)  # of a shoulder or elbow from the initial posture
ROUNDS = 20
ON_BODY_M = 0.04  # a ray so near belongs to the body
FEET, SHANKS = 0.04, (0.10, 0.22)  # heights in statures
TURNS = 8  # facings that are tried


@dataclass(frozen=True)
class Stretched:
    """The initial posture as a scene shows it.  centre: (2,) x, z.  across: (2,) unit, along the arms.  low, stature: m."""

    centre: Floats
    across: Floats
    low: float
    stature: float


def stretched_in(points: Floats) -> Stretched | str:
    """The initial posture in scene points (n, 3), or what is missing of it, in words."""
    if len(points) < 40:
        return "waiting for a person"
    middle = np.median(points[:, [0, 2]], axis=0)
    upright = points[np.linalg.norm(points[:, [0, 2]] - middle, axis=1) < BESIDE_M, 1]
    low, top = np.percentile(upright, [0.3, 99.7])
    stature = float(top - low)
    if not SHORTEST_M <= stature <= TALLEST_M:
        return f"seeing something {stature:.2f} m tall; a person of {SHORTEST_M:g} to {TALLEST_M:g} m is waited for"
    around = points[:, [0, 2]] - middle
    out = np.linalg.norm(around, axis=1) > ARMS * stature
    height = (points[:, 1] - low) / stature
    arms = out & (height > AT[0]) & (height < AT[1])
    if arms.sum() < 10:
        return "stretch both arms sideways"
    _, axes = np.linalg.eigh(around[arms].T @ around[arms])
    across = axes[:, 1]
    along, deep = around[arms] @ across, around @ axes[:, 0]
    level = float(arms.sum() / out.sum())
    sides = float(-along.min()), float(along.max())
    if level < ALL_ARMS or min(sides) < 0.5 * SPAN[0] * stature or max(sides) > 0.5 * SPAN[1] * stature:
        return "stretch both arms sideways, at the height of the shoulders"
    if float(np.subtract(*np.percentile(deep, [95, 5]))) > DEEPEST * stature:
        return "stand straight, legs together or slightly apart, arms sideways"
    return Stretched(middle, across, float(low), stature)


def measured_from(anatomy: Anatomy, scenes: Sequence[Singles], seen: Sequence[Stretched]) -> Measured | str:
    """The body, from rays (11, n) of several scenes of the initial posture; or why it is not believed, in words.

    Who faces which way along the same line is decided by the feet: both ways are fitted.
    """
    held = coordinates_of(anatomy).of_pose(Pose(np.zeros(3), stretched_angles(anatomy)))
    stature = float(np.median([one.stature for one in seen]))
    average = average_body(anatomy, stature)
    found = []
    for side in (1.0, -1.0):
        samples = []
        for rays, one in zip(scenes, seen, strict=True):
            across = side * one.across * np.sign(one.across @ seen[0].across)
            left, up = np.array([across[0], 0.0, across[1]]), np.array([0.0, 1.0, 0.0])
            rotation = np.stack([left, up, np.cross(left, up)], axis=1)
            position = np.array([one.centre[0], one.low + HIP_HEIGHT * stature, one.centre[1]])
            samples.append(Sample(rays, Posed(position, rotation, held.copy()), held, HELD))
        found.append(measure(anatomy, average, samples, np.zeros(COUNT), ROUNDS))
    best = min(found, key=lambda measured: measured.gap)
    if "right_foot" not in anatomy.parts:  # such a body looks the same from the front and from behind
        forward = sum(_toes(points_of(rays), one, seen[0].across) for rays, one in zip(scenes, seen, strict=True))
        best = found[0] if forward > 0.0 else found[1]
    if not best.gap <= MOST_GAP_M:
        return (
            f"no body fits: gaps of {best.gap * 1000:.0f} mm (at most {MOST_GAP_M * 1000:.0f}); stand still in every view"
        )
    away = max(float(np.abs(pose.values - held).max()) for pose in best.poses)
    if away > FURTHEST:
        return f"stretch both arms straight; a joint is {np.degrees(away):.0f} degrees off"
    return best


def _toes(points: Floats, one: Stretched, across: Floats) -> float:
    """How far the feet reach forward of the shanks in scene points (n, 3), metres, when `across` (2,) is to the left."""
    height = (points[:, 1] - one.low) / one.stature
    depth = points[:, [0, 2]] @ np.array([-across[1], across[0]])
    feet, shanks = depth[height < FEET], depth[(height > SHANKS[0]) & (height < SHANKS[1])]
    if not len(feet) or not len(shanks):
        return 0.0
    middles = [0.5 * float(np.sum(np.percentile(part, [5, 95]))) for part in (feet, shanks)]
    return middles[0] - middles[1]


def found_in(model: Model, rays: Singles, poses: Sequence[Posed], stature: float, weights: Weights, rounds: int) -> Posed:
    """The best pose of a known body in a scene; poses: postures to begin from, facing everywhere.

    rays: (11, n).  stature: metres, where the hips are looked for.
    """
    points = points_of(rays)
    x, _, z = np.median(points, axis=0)
    low = float(np.percentile(points[np.hypot(points[:, 0] - x, points[:, 2] - z) < BESIDE_M, 1], 0.3))
    best: tuple[Posed, float] | None = None
    for posture in poses:
        for turn in range(TURNS):
            yaw = 2 * np.pi * turn / TURNS
            c, s = np.cos(yaw), np.sin(yaw)
            rotation = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ posture.rotation
            start = Posed(np.array([x, low + HIP_HEIGHT * stature, z]), rotation, posture.values.copy())
            moved = start.copy()
            refine(
                model, rays, weights, rounds, moved.position, moved.rotation, moved.values,
                start.position, start.rotation, start.values,
            )  # fmt: skip
            error = float(misfit_of(model, rays, weights.limit, moved.position, moved.rotation, moved.values))
            if best is None or error < best[1]:
                best = moved, error
    assert best is not None  # there is a posture to begin from
    return best[0]


def explained(model: Model, rays: Singles, pose: Posed) -> float:
    """The share of a scene that lies on the body."""
    if not rays.shape[1]:
        return 0.0
    return float(np.mean(distances_of(model, rays, pose.position, pose.rotation, pose.values) < ON_BODY_M))
