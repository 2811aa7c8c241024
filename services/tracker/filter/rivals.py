"""Rivals: other explanations of the silhouettes, tracked beside the estimate until evidence decides.

Two views show a step nearly the same with the other leg ahead, and a person from behind as from the front.  No noise of
the particles is so large that one of them changes that, and a frame that fits better proves little: errors of the body
model favour one of both for as long as the pose is held.  A rival therefore gathers log odds against the estimate from
scenes that differ.
"""

# Paper (added): [Hybrid V] has no explanations beside the particles, which have one heading and the legs on the same sides.

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, misfit
from zenocap.services.tracker.filter.confidence import LEGS, MAX_DISTANCE_M, MIN_MISFIT, limb_distances, limb_points
from zenocap.services.tracker.filter.filter_step import residual_weights, start_tracking
from zenocap.services.tracker.initialization.heading import foot_reach
from zenocap.services.tracker.initialization.relocalization import refined, turn_between
from zenocap.services.tracker.initialization.twins import exchanged, leg_columns, mirror_turn
from zenocap.services.tracker.states import (
    HEADING_KINDS,
    LEG_KINDS,
    MIRROR_KINDS,
    RIVAL_KINDS,
    Outcome,
    Rival,
    RivalKind,
    TrackedPerson,
    TrackerSetup,
    Tracking,
)


class _Step(NamedTuple):
    """A step of the track, see `follow_rivals`."""

    setup: TrackerSetup
    before: Tracking
    after: Tracking
    captured_ns: int
    evidence: Evidence


def follow_rivals(
    setup: TrackerSetup, before: Tracking, after: Tracking, outcome: Outcome, captured_ns: int, evidence: Evidence,
    sought: Collection[RivalKind],
) -> tuple[Tracking, Outcome]:  # fmt: skip
    """The track with its rivals in the next scene; the estimate is exchanged with one that has become more probable.

    before, after: the track without the scene, and with it.  sought: kinds that are sought also where they are refuted;
    without any, none is sought.  For DECIDED_NS after the user's decision on the heading nothing turns the trunk.
    """
    step = _Step(setup, before, after, captured_ns, evidence)
    known, rivals = {rival.kind: rival for rival in after.rivals}, list[Rival]()
    corrected = after.corrected_ns == captured_ns
    decided = after.decided_ns is not None and captured_ns - after.decided_ns < p.DECIDED_NS
    for kind in RIVAL_KINDS:
        rival = known.get(kind, Rival(kind))
        if kind != "legs" and corrected:  # its limbs are those before the correction
            rival = replace(rival, pose=None)
        if kind != "legs" and decided:
            pass
        elif rival.pose is not None:
            rival = _advanced(step, rival, rival.pose)
        elif kind in sought or (sought and rival.nats > -p.RIVAL_MOST):
            rival = _sought(step, rival)
        rivals.append(rival)
    after = replace(after, rivals=tuple(rivals))
    heading_known = heading_nats(after) < -(p.RIVAL_DOUBT if before.person.heading_known else p.RIVAL_SWITCH)
    after = replace(after, person=replace(after.person, heading_known=heading_known))
    for rival in rivals:
        if rival.pose is not None and rival.nats > p.RIVAL_SWITCH:
            return _switched(step._replace(after=after), outcome, rival, rival.pose)
    return after, outcome


def nats_against(errors: Floats, reaches: Sequence[float | None]) -> Floats:
    """(n,) nats against each of several poses in one scene, by misfits (n,), m^2, and reaches of the feet, see `reach_of`.

    Feet that are not seen, or lie, show nothing.
    """
    short = np.array([0.0 if one is None else p.REACH_MOST - one for one in reaches])
    nats: Floats = (errors / max(float(errors.min()), MIN_MISFIT) - 1.0) / p.AMBIGUITY_SCALE + p.REACH_NATS * short
    return nats


def reach_of(anatomy: Anatomy, person: TrackedPerson, evidence: Evidence, pose: RootedPose) -> float | None:
    """Statures that the feet reach forward in a pose, at most REACH_MOST; None where they do not show it."""
    metres = foot_reach(anatomy, person.model, evidence.rays, pose, person.stature)
    return None if metres is None else min(metres / person.stature, p.REACH_MOST)


def with_rivals(anatomy: Anatomy, phase: Tracking, poses: Sequence[RootedPose], nats: Floats) -> Tracking:
    """The track with the most probable of other poses of each kind as its rivals.  nats: (n,) log odds of the poses."""
    found = dict[RivalKind, Rival]()
    for k in np.argsort(-nats, kind="stable"):
        turn = np.degrees(turn_between(poses[k], phase.estimate))
        kind = MIRROR_KINDS[int(poses[k].rotation[:, 2] @ phase.estimate.rotation[:, 0] > 0.0)]
        kind = "legs" if turn <= p.RIVAL_TURN_DEG else kind if turn < p.MIRROR_TURNS_DEG[1] else "back"
        if kind not in found and _differs(anatomy, phase, kind, poses[k]):
            found[kind] = Rival(kind, max(-p.RIVAL_MOST, float(nats[k])), poses[k])
    return replace(phase, rivals=tuple(found.values()))


def with_heading(phase: Tracking, probability: float) -> Tracking:
    """The track with rivals of the heading that leave it a probability."""
    least = 1.0 / (1.0 + np.exp(p.RIVAL_MOST))
    nats = float(np.log(1.0 / np.clip(probability, least, 1.0 - least) - 1.0))
    rivals = [one for one in phase.rivals if one.kind not in HEADING_KINDS] + [Rival(kind, nats) for kind in HEADING_KINDS]
    return replace(phase, person=replace(phase.person, heading_known=nats < -p.RIVAL_DOUBT), rivals=tuple(rivals))


def heading_nats(phase: Tracking) -> float:
    """The greatest log odds of a rival of the heading against the estimate."""
    known = {rival.kind: rival.nats for rival in phase.rivals}
    return max(known.get(kind, 0.0) for kind in HEADING_KINDS)


def rival_ambiguity(anatomy: Anatomy, phase: Tracking) -> Floats:
    """(4,) `Tracking.ambiguity` of the limbs, more where rivals have them elsewhere: distance times probability, metres."""
    found = phase.ambiguity
    for rival in phase.rivals:
        if rival.pose is not None:
            (apart,) = limb_distances(anatomy, phase.person.model, [rival.pose], phase.estimate)
            found = np.maximum(found, np.minimum(apart, MAX_DISTANCE_M) / (1.0 + np.exp(-rival.nats)))
    return found


def _sought(step: _Step, rival: Rival) -> Rival:
    """A rival without a pose, with one that differs and fits about as well; less probable where there is none.

    Legs that do not differ, as those of a person who stands, show nothing.
    """
    setup, before, phase, captured_ns, evidence = step
    anatomy, model = setup.anatomy, phase.person.model
    pose = exchanged(setup, phase.person, evidence, phase.estimate, rival.kind, p.RIVAL_PASSES)
    own_error, error = _misfits(model, evidence, phase.estimate, pose)
    differs = _differs(anatomy, phase, rival.kind, pose)
    if differs and error <= p.RIVAL_FITS * own_error:
        return replace(rival, pose=pose)
    if rival.kind in LEG_KINDS and not differs:
        return rival
    if not differs and _mirror_meets(setup, phase.estimate, rival.kind):
        return replace(rival, nats=-p.MIRROR_MET)
    gained = _shown(step, rival.kind, pose, error / own_error) if differs else -p.RIVAL_MOST
    against = min(max(0.0, -gained), p.RIVAL_MOST)
    moved = np.linalg.norm(np.subtract(*(limb_points(anatomy, model, one.estimate) for one in (before, phase))), axis=2)
    fresh = _freshness(moved[:, _limbs(rival.kind)], captured_ns - before.captured_ns)
    # A first look is an observation, further ones of a held pose are not.
    return replace(rival, nats=max(-p.RIVAL_MOST, min(-against, rival.nats - fresh * against)))


def _advanced(step: _Step, rival: Rival, last: RootedPose) -> Rival:
    """A rival, whose pose was `last`, in the next scene, with its log odds."""
    setup, before, after, captured_ns, evidence = step
    anatomy, person, own, legs = setup.anatomy, after.person, after.estimate, leg_columns(setup.anatomy)
    if rival.kind == "legs":  # on the estimate's trunk
        start = own.copy()
        start.values[legs] = last.values[legs]
    else:
        turn = own.rotation @ before.estimate.rotation.T
        turn = turn.T if rival.kind in MIRROR_KINDS else turn
        start = RootedPose(last.position + own.position - before.estimate.position, turn @ last.rotation, last.values)
    pose = refined(person.model, evidence, start, residual_weights(setup, p.ESTIMATE_HOLD), p.ESTIMATE_ITERATIONS)
    if not _differs(anatomy, after, rival.kind, pose):  # those that meet may be exchanged
        met = -p.MIRROR_MET if rival.kind in MIRROR_KINDS else rival.nats
        return replace(rival, nats=p.RIVAL_MET * rival.nats if rival.kind in LEG_KINDS else met, pose=None)
    moves = ((before.estimate, own), (last, pose))
    points = [[limb_points(anatomy, person.model, one)[:, _limbs(rival.kind)] for one in move] for move in moves]
    lengths = np.array([np.linalg.norm(now - then, axis=2) for then, now in points])  # (2 poses, 2 points, limbs), metres
    own_error, error = _misfits(person.model, evidence, own, pose)
    passed_ns = captured_ns - before.captured_ns
    gained = _shown(step, rival.kind, pose, error / own_error)
    if rival.kind in LEG_KINDS and lengths[:, 1].max() < p.STANDING_SPEED * 1e-9 * passed_ns:
        gained += _unevenness(points[0][1]) - _unevenness(points[1][1])
    gained *= min(_freshness(one, passed_ns) for one in lengths)
    if rival.kind in LEG_KINDS and after.corrected_ns != captured_ns:  # else the estimate was corrected, and has not moved
        own_turns, turns = (now.values[legs] - then.values[legs] for then, now in moves)
        gained += _roughness(own_turns, passed_ns) - _roughness(turns, passed_ns)
    most = p.RIVAL_SPEED * 1e-9 * passed_ns
    nats = rival.nats + float(np.clip(gained, -most, most))
    nats = float(np.clip(nats, -p.RIVAL_MOST, p.RIVAL_MOST))
    refuted = nats <= -p.RIVAL_MOST and error > p.RIVAL_FITS * own_error
    return replace(rival, nats=nats, pose=None if refuted else pose)


def _switched(step: _Step, outcome: Outcome, rival: Rival, pose: RootedPose) -> tuple[Tracking, Outcome]:
    """The track with the legs of a rival, whose pose is `pose`, and all else as it is; or with its heading and whole pose.

    The estimate becomes the rival.
    """
    setup, _, phase, captured_ns, evidence = step
    if rival.kind != "legs":
        (error,) = _misfits(phase.person.model, evidence, pose)
        turned, found = start_tracking(setup, phase.person, pose, captured_ns, error)
        turned = replace(
            phase, cloud=turned.cloud, estimate=pose, velocity=turned.velocity, corrected_ns=captured_ns, toes=turned.toes,
            rivals=(Rival(rival.kind, -rival.nats),),
        )  # fmt: skip
        return turned, replace(found, body=outcome.body)
    legs = leg_columns(setup.anatomy)
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


def _differs(anatomy: Anatomy, phase: Tracking, kind: RivalKind, pose: RootedPose) -> bool:
    """Whether a leg, or the heading, of a pose is not that of the estimate."""
    if kind in HEADING_KINDS:
        return bool(turn_between(pose, phase.estimate) > np.radians(p.RIVAL_TURN_DEG))
    return bool(limb_distances(anatomy, phase.person.model, [pose], phase.estimate)[0, LEGS].max() > p.RIVAL_APART_M)


def _mirror_meets(setup: TrackerSetup, pose: RootedPose, kind: RivalKind) -> bool:
    """Whether the mirrored heading is nearly that of a pose."""
    turn = mirror_turn(setup, pose, MIRROR_KINDS.index(kind)) if kind in MIRROR_KINDS else None
    return turn is not None and np.degrees(abs(turn)) <= p.MIRROR_TURNS_DEG[0]


def _shown(step: _Step, kind: RivalKind, pose: RootedPose, excess: float) -> float:
    """Nats for a pose against the estimate by a scene: of the misfit, and of how far the feet reach forward, where seen.

    excess: its misfit, of the estimate's.
    """
    phase, logs = step.after, float(np.log(excess))
    nats = -float(np.copysign(max(0.0, abs(logs) - p.RIVAL_ALIKE), logs)) / p.AMBIGUITY_SCALE
    if kind == "legs":  # on the same trunk
        return nats
    own, other = (reach_of(step.setup.anatomy, phase.person, step.evidence, one) for one in (phase.estimate, pose))
    return nats if own is None or other is None else nats + p.REACH_NATS * (other - own)


def _unevenness(ends: Floats) -> float:
    """Nats against a pose whose feet stand.  ends: (2, 2, 3) middle and end of both legs, metres."""
    return min(p.STANDING_MOST, float(np.ptp(ends[1, :, 1]) ** 2) / (4.0 * p.STANDING_DEVIATION_M**2))


def _roughness(turns: Floats, passed_ns: int) -> float:
    """Nats against turns of joints that are faster than those of legs, radians."""
    beyond = np.maximum(np.abs(turns) - p.LEG_TURN_RATE * 1e-9 * passed_ns, 0.0)
    return 0.5 * float(np.sum(beyond**2)) / p.PREDICTION_DEVIATION[1] ** 2


def _limbs(kind: RivalKind) -> slice:
    """Of LIMBS, those that a rival has elsewhere."""
    return LEGS if kind in LEG_KINDS else slice(None)


def _freshness(lengths: Floats, passed_ns: int) -> float:
    """How much of a new observation a scene is: by paths of points since the last one, metres; a held pose each second."""
    return min(1.0, max(float(lengths.mean()) / p.RIVAL_FRESH_M, 1e-9 * passed_ns))
