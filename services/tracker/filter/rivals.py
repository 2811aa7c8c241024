"""Rivals: other explanations of the silhouettes, tracked beside the estimate until evidence decides.

Two views show a step nearly the same with the other leg ahead.  No noise of the particles is so large that one of them
changes the legs, and a frame that fits better proves little: errors of the body model favour one of both for as long as
the step is held.  A rival therefore gathers log odds against the estimate from scenes that differ.
"""

# Paper (added): [Hybrid V] has no explanations beside the particles, which have the legs on the same sides.

from dataclasses import replace
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.body.kinematics import joint_centres
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, misfit
from zenocap.services.tracker.filter.confidence import LEGS, MAX_DISTANCE_M, MIN_MISFIT, limb_distances, limb_points
from zenocap.services.tracker.filter.filter_step import residual_weights
from zenocap.services.tracker.initialization.relocalization import refined, searched
from zenocap.services.tracker.states import RIVAL_KINDS, Outcome, Rival, TrackerSetup, Tracking

OPPOSITE = {"R": "L", "L": "R"}
UPPER = ("Hip", "Shoulder", "Elbow", "Wrist")  # joint centres that stay where knees and ankles are exchanged


def follow_rivals(
    setup: TrackerSetup, before: Tracking, after: Tracking, outcome: Outcome, captured_ns: int, evidence: Evidence, *,
    seeking: bool,
) -> tuple[Tracking, Outcome]:  # fmt: skip
    """The track with its rivals in the next scene; the estimate is exchanged with one that has become more probable.

    before, after: the track before the scene and with it.  seeking: whether rivals are sought that there are not.
    """
    known, rivals = {rival.kind: rival for rival in after.rivals}, list[Rival]()
    for kind in RIVAL_KINDS:
        rival = known.get(kind, Rival(kind))
        if rival.pose is not None:
            rival = _advanced(setup, before, after, captured_ns, evidence, rival, rival.pose)
        elif seeking:
            rival = _sought(setup, after, evidence, rival)
        rivals.append(rival)
    after = replace(after, rivals=tuple(rivals))
    for rival in rivals:
        if rival.pose is not None and rival.nats > p.RIVAL_SWITCH:
            return _exchanged(setup, after, outcome, captured_ns, rival, rival.pose)
    return after, outcome


def rival_ambiguity(anatomy: Anatomy, phase: Tracking) -> Floats:
    """(4,) `Tracking.ambiguity` of the limbs, more where rivals have them elsewhere: distance times probability, metres."""
    found = phase.ambiguity
    for rival in phase.rivals:
        if rival.pose is not None:
            (apart,) = limb_distances(anatomy, phase.person.model, [rival.pose], phase.estimate)
            found = np.maximum(found, np.minimum(apart, MAX_DISTANCE_M) / (1.0 + np.exp(-rival.nats)))
    return found


def exchanged_limbs(anatomy: Anatomy, body: Bdp, pose: RootedPose, kept: tuple[str, ...] = ()) -> RootedPose:
    """The pose whose left joint centres are where the right ones were, as far as the limits of the joints allow.

    kept: joints that stay, without their sides.
    """
    centres = joint_centres(anatomy, body, pose.pose(anatomy))
    names = [one.name for one in anatomy.markers]
    names = [name if name[1:] in kept else OPPOSITE.get(name[0], name[0]) + name[1:] for name in names]
    other = {name: at[None] for name, at in zip(names, centres, strict=True)}
    (found,) = poses_from_centres(anatomy, other, body)
    return RootedPose.of(anatomy, body, found)


def exchanged_legs(anatomy: Anatomy, body: Bdp, pose: RootedPose) -> tuple[RootedPose, RootedPose]:
    """The pose with the other leg ahead, and with knees and ankles in each other's places."""
    right, left, signs = _legs(anatomy)
    ahead, crossed = pose.copy(), pose.copy()
    ahead.values[right], ahead.values[left] = signs * pose.values[left], signs * pose.values[right]
    legs = np.concatenate([right, left])
    crossed.values[legs] = exchanged_limbs(anatomy, body, pose, UPPER).values[legs]
    return ahead, crossed


@lru_cache
def _legs(anatomy: Anatomy) -> tuple[Ints, Ints, Floats]:
    """Joint coordinates of the right and of the left leg, and the factors between those of mirrored legs."""
    names = coordinates_of(anatomy).names
    own = [name for name in names if name.startswith(("right_hip", "right_knee", "right_ankle"))]
    right, left = (np.array([names.index(name.replace("right", side)) for name in own]) for side in ("right", "left"))
    return right, left, np.array([-1.0 if name.endswith((".2", ".3")) else 1.0 for name in own])


def _sought(setup: TrackerSetup, phase: Tracking, evidence: Evidence, rival: Rival) -> Rival:
    """A rival without a pose, with one that differs and fits about as well; less probable where none fits."""
    person, own, weights = phase.person, phase.estimate, residual_weights(setup, p.PARTICLE_HOLD)
    starts = exchanged_legs(setup.anatomy, person.body, own)
    (pose,) = searched(person.model, evidence, starts, weights, (1, p.RIVAL_PASSES))
    own_error, error = _misfits(person.model, evidence, own, pose)
    if error > p.RIVAL_FITS * own_error:
        return replace(rival, nats=max(rival.nats - p.RIVAL_FRAME, -p.RIVAL_MOST))
    return replace(rival, pose=pose) if _differs(setup.anatomy, person.model, pose, own) else rival


def _advanced(
    setup: TrackerSetup, before: Tracking, after: Tracking, captured_ns: int, evidence: Evidence, rival: Rival,
    last: RootedPose,
) -> Rival:  # fmt: skip
    """A rival, whose pose was `last`, in the next scene: the estimate with its legs, refined; and its log odds."""
    anatomy, model, own = setup.anatomy, after.person.model, after.estimate
    start, legs = own.copy(), np.concatenate(_legs(anatomy)[:2])
    start.values[legs] = last.values[legs]
    pose = refined(model, evidence, start, residual_weights(setup, p.ESTIMATE_HOLD), p.ESTIMATE_ITERATIONS)
    if not _differs(anatomy, model, pose, own):
        return replace(rival, pose=None)
    own_error, error = _misfits(model, evidence, own, pose)
    paths = [[limb_points(anatomy, model, one)[:, LEGS] for one in path] for path in ((before.estimate, own), (last, pose))]
    seconds = 1e-9 * (captured_ns - before.captured_ns)
    steps = np.array([np.linalg.norm(now - then, axis=2) for then, now in paths])  # (2 poses, 2 ends, 2 legs)
    gained = float(np.log(own_error / error)) / p.AMBIGUITY_SCALE
    if steps[:, 1].max() < p.STANDING_SPEED * seconds:  # all feet stand
        gained += _unevenness(paths[0][1]) - _unevenness(paths[1][1])
    gained *= min(1.0, max(float(steps.mean(axis=(1, 2)).min()) / p.RIVAL_FRESH_M, seconds))
    if after.corrected_ns != captured_ns:  # else the estimate was corrected, and has not moved
        gained += _roughness(before.estimate, own, legs) - _roughness(last, pose, legs)
    nats = rival.nats + float(np.clip(gained, -p.RIVAL_FRAME, p.RIVAL_FRAME))
    nats = float(np.clip(nats, -p.RIVAL_MOST, p.RIVAL_MOST))
    refuted = nats <= -p.RIVAL_MOST and error > p.RIVAL_FITS * own_error
    return replace(rival, nats=nats, pose=None if refuted else pose)


def _exchanged(
    setup: TrackerSetup, phase: Tracking, outcome: Outcome, captured_ns: int, rival: Rival, pose: RootedPose
) -> tuple[Tracking, Outcome]:
    """The track with the legs of a rival, whose pose is `pose`; all else stays, and the estimate becomes the rival."""
    legs = np.concatenate(_legs(setup.anatomy)[:2])
    estimate, particles, velocity = phase.estimate.copy(), phase.cloud.values.copy(), phase.velocity.copy()
    estimate.values[legs] = particles[:, legs] = pose.values[legs]
    velocity[6 + legs] = 0.0
    own = replace(rival, nats=-rival.nats, pose=phase.estimate)
    phase = replace(
        phase, cloud=phase.cloud._replace(values=particles), estimate=estimate, velocity=velocity, corrected_ns=captured_ns,
        rivals=tuple(own if one is rival else one for one in phase.rivals),
    )  # fmt: skip
    return phase, replace(outcome, pose=estimate.pose(setup.anatomy))


def _misfits(model: BodyModel, evidence: Evidence, *poses: RootedPose) -> list[float]:
    """D of poses, m^2."""
    return [max(float(misfit(model, evidence, p.RESIDUAL_LIMIT_M, pose)), MIN_MISFIT) for pose in poses]


def _differs(anatomy: Anatomy, model: BodyModel, pose: RootedPose, own: RootedPose) -> bool:
    """Whether a leg of a pose is not where it is in the estimate."""
    return bool(limb_distances(anatomy, model, [pose], own)[0, LEGS].max() > p.RIVAL_APART_M)


def _unevenness(ends: Floats) -> float:
    """Nats against a pose whose feet stand.  ends: (2, 2, 3) middle and end of both legs, metres."""
    return min(p.STANDING_MOST, float(np.ptp(ends[1, :, 1]) ** 2) / (4.0 * p.STANDING_DEVIATION_M**2))


def _roughness(then: RootedPose, now: RootedPose, columns: Ints) -> float:
    """Nats against a motion: of its coordinates about the last ones."""
    return 0.5 * float(np.sum((now.values[columns] - then.values[columns]) ** 2)) / p.PREDICTION_DEVIATION[1] ** 2
