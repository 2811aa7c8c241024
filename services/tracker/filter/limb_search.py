"""Search of a single limb whose rays are gone, over tabulated placements.

The misfit of the whole body hardly changes when an arm is lost, and all particles have it in the same wrong place.  One
limb is therefore tried in many placements, scored on the rays that the other parts leave unexplained and on the
silhouettes.  The best one is refined and becomes a particle.
"""

# Paper (added): [Hybrid V] does not search limbs.

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.rotations import matrix_to_vector, vector_to_matrix
from zenocap.common.jit import kernel
from zenocap.services.tracker.body.body_model import MAX_BALL_ANGLE, BodyModel, RootedPose, forward_kinematics, frames_of
from zenocap.services.tracker.evidence.evidence import Evidence, misfit, support_fraction
from zenocap.services.tracker.evidence.field import square_outside
from zenocap.services.tracker.evidence.rays import nearest_of, nearest_parts
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.filter.particles import Cloud, RefinementScene
from zenocap.services.tracker.parameters import (
    AXIS_SAMPLES,
    LIKELIHOOD_INFORMATION,
    LIMB_BENDS,
    LIMB_BODY_SUPPORT_RATIO,
    LIMB_DIRECTIONS,
    LIMB_MAX_SWING,
    LIMB_MAX_TWIST,
    LIMB_MISFIT_RATIO,
    LIMB_SUPPORT_DECAY,
    LIMB_SUPPORT_RATIO,
    LIMB_TRIALS,
    LIMB_TWISTS,
    ON_BODY_M,
    OUTSIDE_WEIGHT,
    PREDICTION_DEVIATION,
    SUPPORT_RATE,
    UNEXPLAINED_M,
)


class SearchedLimb(NamedTuple):
    """parts: (k,) from the ball joint to the free end.  ball, hinge: first coordinate of the ball joint, and of the hinge.

    placements: (n, 4) rotation vector of the ball joint and angle of the hinge, radians.
    """

    parts: Ints
    ball: int
    hinge: int
    placements: Floats


@lru_cache
def limbs_of(anatomy: Anatomy) -> tuple[SearchedLimb, ...]:
    """Right arm, left arm, right leg, left leg."""
    coordinates, found = coordinates_of(anatomy), []
    names = [joint.name for joint in anatomy.joints]
    for ball, hinge in (("shoulder", "elbow"), ("hip", "knee")):
        for side in ("right", "left"):
            upper, lower = names.index(f"{side}_{ball}"), names.index(f"{side}_{hinge}")
            ends = [k for k, joint in enumerate(anatomy.joints) if joint.parent == anatomy.parts[lower]]
            rows = placements(coordinates.reference[upper], LIMB_BENDS[hinge], LIMB_MAX_SWING[ball], LIMB_MAX_TWIST[ball])
            first, second = int(coordinates.first[upper]), int(coordinates.first[lower])
            found.append(SearchedLimb(np.array([upper, lower, *ends]), first, second, rows))
    return tuple(found)


def placements(reference: Floats, bends: tuple[float, ...], max_swing: float, max_twist: float) -> Floats:
    """(n, 4) placements: directions evenly spread over a sphere, with bends of the hinge in several planes.

    reference: (3, 3) part to parent at zero coordinates.  max_swing: radians from there.  max_twist: about the part.
    """
    rows, turn, swing, vector = [], np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for k in range(LIMB_DIRECTIONS):  # Fibonacci sphere
        height = 1.0 - 2.0 * (k + 0.5) / LIMB_DIRECTIONS
        across, angle = np.sqrt(1.0 - height * height), np.pi * (3.0 - np.sqrt(5.0)) * k
        direction = np.array([across * np.cos(angle), height, across * np.sin(angle)])
        axis = np.cross(reference[:, 1], direction)
        swung = float(np.arctan2(np.linalg.norm(axis), reference[:, 1] @ direction))
        if swung > max_swing:
            continue
        vector_to_matrix(axis * (swung / max(float(np.linalg.norm(axis)), 1e-9)), swing)
        for bend in bends:
            twists = LIMB_TWISTS if abs(bend) > 0.2 else 1
            for n in range(twists):
                twist = (n + 0.5) / twists * 2.0 * np.pi - np.pi if twists > 1 else 0.0
                if abs(twist) > max_twist:
                    continue
                vector_to_matrix(np.array([0.0, twist, 0.0]), turn)
                matrix_to_vector(reference.T @ swing @ reference @ turn, vector)
                if np.abs(vector).max() < MAX_BALL_ANGLE:
                    rows.append([*vector, bend])
    return np.array(rows)


def limb_support(anatomy: Anatomy, model: BodyModel, evidence: Evidence, pose: RootedPose) -> Floats:
    """(4,) share of the rays that are on each limb beyond its ball joint's part."""
    distances, parts = nearest_of(model, frames_of(model, pose), evidence.rays)
    near = parts[distances < ON_BODY_M]
    return np.array([np.isin(near, limb.parts[1:]).sum() / max(len(parts), 1) for limb in limbs_of(anatomy)])


@kernel
def _parts_of(model: BodyModel, parts: Ints) -> BodyModel:
    """The model's arrays for some of its parts; for distances only."""
    return BodyModel(
        model.parent[parts], model.first[parts], model.kind[parts], model.axis[parts], model.reference[parts],
        model.offsets[parts], model.bases[parts], model.lengths[parts], model.free[parts], model.radii[parts],
        model.low, model.high,
    )  # fmt: skip


@kernel
def place_limb(
    model: BodyModel,
    limb: SearchedLimb,
    chosen: Ints,
    change_cost: float,
    evidence: Evidence,
    limit: float,
    pose: RootedPose,
) -> float:
    """Move a limb of the pose, in place, to the best of the chosen placements; returns its cost in m^2.

    change_cost: m^2 per rad^2 of change of its coordinates.  limit: metres, of the truncated residuals.
    """
    count, n, parts = model.parent.shape[0], evidence.rays.shape[1], limb.parts
    frames, others = frames_of(model, pose), _others(count, parts)
    rest, nearest = nearest_of(_parts_of(model, others), frames[others], evidence.rays)
    near = np.empty(n, dtype=np.float32)
    unexplained = np.flatnonzero(rest > UNEXPLAINED_M)
    few = np.ascontiguousarray(evidence.rays[:, unexplained])
    own_model, own = _parts_of(model, parts), np.empty((parts.shape[0], 3, 4))
    trial, samples = pose.values.copy(), count * len(AXIS_SAMPLES) * max(evidence.field.at.shape[0], 1)
    best, least = -1, np.inf
    for c in chosen:
        cost = 0.0
        for k in range(3):
            trial[limb.ball + k] = limb.placements[c, k]
            cost += change_cost * (limb.placements[c, k] - pose.values[limb.ball + k]) ** 2
        trial[limb.hinge] = limb.placements[c, 3]
        cost += change_cost * (limb.placements[c, 3] - pose.values[limb.hinge]) ** 2
        forward_kinematics(model, RootedPose(pose.position, pose.rotation, trial), frames)
        for k in range(parts.shape[0]):
            own[k] = frames[parts[k]]
        cost += OUTSIDE_WEIGHT * square_outside(own_model, own, evidence.field, limit) / samples
        if cost >= least:
            continue
        nearest_parts(own_model, own, few, near, nearest)
        total = 0.0
        for i in range(unexplained.shape[0]):
            distance = min(min(rest[unexplained[i]], near[i]), np.float32(limit))
            total += distance * distance
        cost += total / max(n, 1)
        if cost < least:
            best, least = c, cost
    if best >= 0:
        for k in range(3):
            pose.values[limb.ball + k] = limb.placements[best, k]
        pose.values[limb.hinge] = limb.placements[best, 3]
    return float(least)


class UsualSupport(NamedTuple):
    """Usual support of a tracked person by contour rays.

    limbs: (4,) share of all rays on each limb, None in the first frame.  body: share on the body.
    misfits: whether the body misfitted the last scene; a limb alone is at fault only while the rest of the body fits.
    """

    limbs: Floats | None
    body: float
    misfits: bool


def search_limbs(
    anatomy: Anatomy,
    scene: RefinementScene,
    iterations: int,
    usual: UsualSupport,
    out: Cloud,
    errors: Floats,
    rng: np.random.Generator,
) -> Floats:
    """Search one limb that lost its support; its best placement replaces the worst particle in `out` and `errors` (n,).

    Returns the usual support (4,) of the limbs after this frame.
    """
    best = int(np.argmin(errors))
    pose = RootedPose(out.positions[best].copy(), out.rotations[best].copy(), out.values[best].copy())
    support = limb_support(anatomy, scene.model, scene.evidence, pose)
    if usual.limbs is None:
        return support
    rising, decayed = usual.limbs + SUPPORT_RATE * (support - usual.limbs), usual.limbs * (1.0 - LIMB_SUPPORT_DECAY)
    after: Floats = np.where(support > usual.limbs, rising, decayed)
    bare = np.flatnonzero(support < LIMB_SUPPORT_RATIO * after)
    fits = support_fraction(scene.model, scene.evidence, pose) >= LIMB_BODY_SUPPORT_RATIO * usual.body
    worst = int(np.argmax(errors))
    if not len(bare) or usual.misfits or not fits or worst == best:
        return after
    limb = limbs_of(anatomy)[int(rng.choice(bare))]
    chosen = rng.permutation(len(limb.placements))[:LIMB_TRIALS]
    change_cost = 1.0 / (2.0 * LIKELIHOOD_INFORMATION * PREDICTION_DEVIATION[1] ** 2)
    place_limb(scene.model, limb, chosen, change_cost, scene.evidence, scene.weights.limit, pose)
    refine(scene.model, scene.evidence, scene.weights, iterations, pose, pose.copy())
    error = float(misfit(scene.model, scene.evidence, scene.weights.limit, pose))
    if error < LIMB_MISFIT_RATIO * errors[best]:
        out.positions[worst], out.rotations[worst], out.values[worst], errors[worst] = *pose, error
    return after


@kernel
def _others(count: int, parts: Ints) -> Ints:
    chosen: Bools = np.ones(count, dtype=np.bool_)
    for part in parts:
        chosen[part] = False
    return np.flatnonzero(chosen)
