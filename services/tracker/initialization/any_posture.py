"""Start without a T-pose: an average body, found in any posture and refined later.

The T-pose is still looked for, and replaces the body by a measured one when it is seen.
"""

# Paper (open): [Hybrid] does not define how the track starts.

from dataclasses import replace

import numpy as np

from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, support_fraction
from zenocap.services.tracker.filter.filter_step import no_pose, residual_weights, start_tracking
from zenocap.services.tracker.initialization.decisions import by_decision, decided_front, faces
from zenocap.services.tracker.initialization.heading import foot_reach
from zenocap.services.tracker.initialization.localization import find_column
from zenocap.services.tracker.initialization.relocalization import best_pose_anywhere, error_of
from zenocap.services.tracker.initialization.t_pose import detail_at
from zenocap.services.tracker.initialization.twins import exchanged
from zenocap.services.tracker.states import AwaitingPerson, Outcome, TrackedPerson, TrackerSetup, Tracking


def start_in_any_posture(
    setup: TrackerSetup, phase: AwaitingPerson, captured_ns: int, evidence: Evidence
) -> tuple[AwaitingPerson | Tracking, Outcome]:
    """Start tracking an average body once a person is in view for START_AFTER_NS; tried again every START_RETRY_NS."""
    no_result = no_pose(setup, lost=False)
    column = find_column(evidence.rays)
    height = 0.0 if column is None else column.top - max(column.low, -p.GROUND_TOLERANCE_M)
    if column is None or not p.MIN_STATURE_M <= height <= p.MAX_STATURE_M:
        return replace(phase, heights=()), no_result
    later = bool(phase.heights) and captured_ns > phase.heights[-1][0]  # a clock may have been set back
    heights = (*(phase.heights if later else ()), (captured_ns, height))
    if captured_ns - heights[0][0] < p.START_AFTER_NS:
        return replace(phase, heights=heights), no_result
    stature = float(np.percentile([one for _, one in heights], p.START_STATURE_PERCENTILE))
    detail = detail_at(setup, column.centre)
    person = replace(average_person(setup, stature), heading_known=False, detail=detail)
    pose = best_pose_anywhere(setup, person, None, None, evidence)
    recent = tuple(one for one in heights if captured_ns - one[0] <= p.START_AFTER_NS - p.START_RETRY_NS)
    if pose is None:
        return replace(phase, heights=recent), no_result
    front = decided_front(setup, pose.position)
    if front is None:
        pose = _facing_where_feet_point(setup, person, pose, evidence)
    elif not faces(pose, front):
        pose = exchanged(setup, person, evidence, pose, "back", p.SEARCH_PASSES)
    support = support_fraction(person.model, evidence, pose)
    error = error_of(person.model, evidence, residual_weights(setup, p.PARTICLE_HOLD), pose)
    if support < p.START_SUPPORT or error > p.START_MISFIT_M2:  # furniture
        return replace(phase, heights=recent), no_result
    tracking, outcome = start_tracking(setup, replace(person, expected_support=support), pose, captured_ns, error)
    tracking = tracking if front is None else by_decision(tracking, captured_ns)
    return tracking, replace(outcome, body=person.body)


def average_person(setup: TrackerSetup, stature: float) -> TrackedPerson:
    """Person of average proportions, until the T-pose is seen.  stature: metres."""
    person = TrackedPerson.of(setup.anatomy, average_body(setup.anatomy, stature), stature)
    return replace(person, measured=False, measuring=AwaitingPerson())


def _facing_where_feet_point(
    setup: TrackerSetup, person: TrackedPerson, pose: RootedPose, evidence: Evidence
) -> RootedPose:
    """The pose, or one with the opposite heading whose feet reach farther forward unless it fits much worse."""
    weights, model = residual_weights(setup, p.PARTICLE_HOLD), person.model
    other = exchanged(setup, person, evidence, pose, "back", p.SEARCH_PASSES)
    reaches = [foot_reach(setup.anatomy, model, evidence.rays, one, person.stature) for one in (pose, other)]
    errors = [error_of(model, evidence, weights, one) for one in (pose, other)]
    if reaches[0] is None or reaches[1] is None or reaches[1] <= reaches[0]:
        return pose
    return other if errors[1] <= p.REVERSED_MISFIT_RATIO * errors[0] else pose
