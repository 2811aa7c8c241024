"""Relocalization: search of a scene for a measured body, from a few common postures and all headings."""

# Paper (added): [Hybrid V] does not search for a lost person.

from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.proportions import HIP_HEIGHT
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, misfit, support_fraction
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.confidence import LEGS, ambiguity, limb_distances
from zenocap.services.tracker.filter.filter_step import no_pose, residual_weights, start_tracking
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.initialization.localization import find_column, middle_and_span
from zenocap.services.tracker.initialization.postures import floor_postures, floor_start, search_postures, turned_start
from zenocap.services.tracker.states import LEG_KINDS, Lost, Outcome, TrackedPerson, TrackerSetup, Tracking
from zenocap.services.tracker.threads import each_in_threads

ALL_TURNS = tuple(360.0 * np.arange(p.SEARCH_HEADINGS) / p.SEARCH_HEADINGS)  # degrees


def poses_anywhere(
    setup: TrackerSetup, person: TrackedPerson, last: RootedPose | None, facing: Floats | None, evidence: Evidence,
    allowed: Callable[[RootedPose], bool] = lambda _: True, *, on_floor: bool = False,
) -> list[RootedPose]:  # fmt: skip
    """Poses found in a scene from common postures and the last one, in every heading, the best one first.

    facing: (3, 3) preferred orientation of the root.  allowed: of the starts, and of what they lead to.  on_floor: from
    postures on the floor instead, where nothing is as high as a person who stands.  None are found without a column.
    """
    column = find_column(evidence.rays)
    if column is None:
        return []
    low, weights = max(column.low, -p.GROUND_TOLERANCE_M), residual_weights(setup, p.PARTICLE_HOLD)
    height, yaws = column.top - low, 2.0 * np.pi * np.arange(p.SEARCH_HEADINGS) / p.SEARCH_HEADINGS
    if on_floor and column.low < p.FLOOR_LOW_M and height < p.FLOOR_HEIGHT * person.stature:
        (x, z), _ = middle_and_span(evidence.rays, column)
        place, effort = np.array([x, low, z]), (p.FLOOR_KEPT, p.FLOOR_PASSES)
        lying = floor_postures(setup.anatomy, person.model, height, p.FLOOR_POSTURES)
        starts = [floor_start(posture, place, float(yaw)) for posture in lying for yaw in yaws]
    else:
        postures = search_postures(setup.anatomy)
        if last is not None:
            postures = (*postures, last._replace(rotation=np.eye(3)))
        centre = np.array([column.centre[0], low + HIP_HEIGHT * person.stature, column.centre[1]])
        starts = [turned_start(posture, centre, float(yaw)) for posture in postures for yaw in yaws]
        effort = (p.SEARCH_KEPT, p.SEARCH_PASSES)
    found = filter(allowed, searched(person.model, evidence, list(filter(allowed, starts)), weights, effort))
    return sorted(found, key=lambda one: error_of(person.model, evidence, weights, one) * _heading_penalty(one, facing))


def searched(
    model: BodyModel, evidence: Evidence, starts: Sequence[RootedPose], weights: Weights, effort: tuple[int, int]
) -> list[RootedPose]:
    """Poses that the best starts lead to.  effort: how many of them, and their passes of SEARCH_ITERATIONS iterations."""
    kept, passes = effort
    wide = weights._replace(limit=p.SEARCH_RESIDUAL_LIMIT_M)

    def first(start: RootedPose) -> tuple[float, RootedPose]:
        pose = refined(model, evidence, start, wide, p.SEARCH_FIRST_ITERATIONS)
        return error_of(model, evidence, weights, pose), pose

    def further(pose: RootedPose) -> RootedPose:
        for _ in range(passes):
            pose = refined(model, evidence, pose, weights, p.SEARCH_ITERATIONS)
        return pose

    candidates = sorted(each_in_threads(starts, first), key=itemgetter(0))
    return each_in_threads([pose for _, pose in candidates[:kept]], further)


def _heading_penalty(pose: RootedPose, facing: Floats | None, opposite: float = p.HEADING_PENALTY) -> float:
    """Factor of the misfit: 1 for the preferred heading, more for another.  opposite: the increase for the opposite one."""
    if facing is None:
        return 1.0
    return 1.0 + opposite * 0.5 * (1.0 - float(pose.rotation[:, 2] @ facing[:, 2]))


def turn_between(one: RootedPose, other: RootedPose) -> float:
    """Angle between the headings of two poses, radians."""
    return float(np.arccos(np.clip(one.rotation[:, 2] @ other.rotation[:, 2], -1.0, 1.0)))


def refined(model: BodyModel, evidence: Evidence, start: RootedPose, weights: Weights, rounds: int) -> RootedPose:
    moved = start.copy()
    refine(model, evidence, weights, rounds, moved, start)
    return moved


def check_elsewhere(
    setup: TrackerSetup, phase: Tracking, outcome: Outcome, captured_ns: int, evidence: Evidence
) -> tuple[Tracking, Outcome]:
    """Replace the pose when a search of the whole scene finds a better one."""
    person, weights = phase.person, residual_weights(setup, p.PARTICLE_HOLD)
    facing = phase.estimate.rotation if person.heading_known else None
    on_floor = phase.misfits_in_row == p.RELOCALIZE_AFTER[-1]
    found = poses_anywhere(setup, person, phase.estimate, facing, evidence, on_floor=on_floor)
    if not found:
        return phase, outcome
    pose, error = found[0], error_of(person.model, evidence, weights, found[0])
    if error > p.REPLACE_MISFIT_RATIO * error_of(person.model, evidence, weights, phase.estimate):
        return phase, outcome
    return start_tracking(setup, _as_faced(person, pose, facing), pose, captured_ns, error)


def _as_faced(person: TrackedPerson, pose: RootedPose, facing: Floats | None) -> TrackedPerson:
    """The person found in a pose: the heading is known where it is about that before, `facing`."""
    return replace(person, heading_known=facing is not None and float(pose.rotation[:, 2] @ facing[:, 2]) > 0.0)


def check_other_postures(
    setup: TrackerSetup, phase: Tracking, outcome: Outcome, captured_ns: int, evidence: Evidence
) -> tuple[Tracking, Outcome]:
    """Replace the pose by one found from common postures near it, when that fits better."""
    # Paper (added): [Hybrid V] has no other postures than those near its particles.
    person, weights, present = phase.person, residual_weights(setup, p.PARTICLE_HOLD), phase.estimate
    yaw = float(np.arctan2(present.rotation[0, 2], present.rotation[2, 2]))
    turns = p.OTHER_POSTURES_TURNS if person.heading_known else ALL_TURNS
    starts = [
        turned_start(posture, present.position, yaw + float(np.radians(turn)))
        for posture in search_postures(setup.anatomy)
        for turn in turns
    ]
    effort = (p.OTHER_POSTURES_KEPT, p.OTHER_POSTURES_PASSES)
    ended = searched(person.model, evidence, starts, weights, effort)
    penalties = [_heading_penalty(pose, present.rotation, p.OTHER_POSTURES_PENALTY) for pose in ended]
    errors = np.array([error_of(person.model, evidence, weights, pose) for pose in ended]) * penalties
    error = error_of(person.model, evidence, weights, present)
    errors[_are_rivals(setup.anatomy, phase, ended) & (errors > error * np.exp(-p.RIVAL_ALIKE))] = np.inf
    best = int(np.argmin(errors))
    distances = limb_distances(setup.anatomy, person.model, ended, ended[best] if errors[best] < error else present)
    phase = replace(phase, ambiguity=ambiguity(distances, errors, min(error, float(errors[best]))))
    if errors[best] > p.OTHER_POSTURES_RATIO * error:
        return phase, outcome
    after, replaced = start_tracking(setup, person, ended[best], captured_ns, float(errors[best]))
    faced = float(after.estimate.rotation[:, 2] @ present.rotation[:, 2]) > 0.0
    # The log odds of all are against the heading before, the limbs of rivals of the heading are those before.
    rivals = tuple(one if one.kind == "legs" else replace(one, pose=None) for one in phase.rivals) if faced else ()
    phase = replace(
        phase, cloud=after.cloud, estimate=after.estimate, velocity=after.velocity, corrected_ns=captured_ns, rivals=rivals
    )
    return phase, replace(replaced, body=outcome.body)


def _are_rivals(anatomy: Anatomy, phase: Tracking, poses: Sequence[RootedPose]) -> Bools:
    """(n,) whether poses have the legs or the heading of a rival, and so do not replace an estimate that fits alike."""
    found = np.zeros(len(poses), dtype=np.bool_)
    for rival in phase.rivals:
        if rival.pose is not None and rival.kind in LEG_KINDS:
            found |= limb_distances(anatomy, phase.person.model, poses, rival.pose)[:, LEGS].max(axis=1) < p.RIVAL_APART_M
        elif rival.pose is not None:
            found |= np.array([turn_between(one, rival.pose) for one in poses]) < np.radians(p.RIVAL_TURN_DEG)
    return found


def search(
    setup: TrackerSetup, phase: Lost, captured_ns: int, evidence: Evidence,
    allowed: Callable[[RootedPose], bool] = lambda _: True,
) -> tuple[Tracking | Lost, Outcome]:  # fmt: skip
    """Search the whole scene for the measured body, and start tracking when it is found.  allowed: see `poses_anywhere`."""
    if phase.rest or evidence.rays.shape[1] < p.MIN_TRACKING_RAYS:
        return replace(phase, rest=max(0, phase.rest - 1)), no_pose(setup, lost=True)
    model, weights = phase.person.model, residual_weights(setup, p.PARTICLE_HOLD)
    recent = phase.person.heading_known and captured_ns - phase.seen_ns < p.HEADING_MEMORY_NS
    facing = phase.last.rotation if phase.last is not None and recent else None
    found = poses_anywhere(setup, phase.person, phase.last, facing, evidence, allowed, on_floor=phase.on_floor)
    if not found or support_fraction(model, evidence, found[0]) < p.FOUND_SUPPORT_RATIO * phase.person.expected_support:
        expected = max(p.MIN_EXPECTED_SUPPORT, p.EXPECTED_SUPPORT_DECAY * phase.person.expected_support)
        person = replace(phase.person, expected_support=expected)
        phase = replace(phase, person=person, rest=p.RETRY_FRAMES, on_floor=not phase.on_floor)
        return phase, no_pose(setup, lost=True)
    person, pose = _as_faced(phase.person, found[0], facing), found[0]
    tracking, outcome = start_tracking(setup, person, pose, captured_ns, error_of(model, evidence, weights, pose))
    new_body = phase.person.body if phase.last is None else None
    return tracking, replace(outcome, body=new_body)


def error_of(model: BodyModel, evidence: Evidence, weights: Weights, pose: RootedPose) -> float:
    """Misfit of a pose in m^2 with residuals truncated as in a refinement.  [Hybrid Eq. 30]"""
    return float(misfit(model, evidence, weights.limit, pose))
