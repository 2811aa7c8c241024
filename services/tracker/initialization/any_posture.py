"""Start without a T-pose: an average body, found in any posture and refined later.

The T-pose is still looked for, and replaces the body by a measured one when it is seen.
"""

# Paper (open): [Hybrid] does not define how the track starts.

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, support_fraction
from zenocap.services.tracker.filter.filter_step import no_pose, residual_weights, start_tracking
from zenocap.services.tracker.filter.rivals import nats_against, with_rivals
from zenocap.services.tracker.initialization.decisions import allowed, started
from zenocap.services.tracker.initialization.heading import foot_reach
from zenocap.services.tracker.initialization.localization import find_column
from zenocap.services.tracker.initialization.relocalization import error_of, poses_anywhere
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
    found = poses_anywhere(setup, person, None, evidence, partial(allowed, setup))
    began = _with_rivals(setup, person, found, captured_ns, evidence) if found else None
    if began is None:
        recent = tuple(one for one in heights if captured_ns - one[0] <= p.START_AFTER_NS - p.START_RETRY_NS)
        return replace(phase, heights=recent), no_result
    return began


def average_person(setup: TrackerSetup, stature: float) -> TrackedPerson:
    """Person of average proportions, until the T-pose is seen.  stature: metres."""
    person = TrackedPerson.of(setup.anatomy, average_body(setup.anatomy, stature), stature)
    return replace(person, measured=False, measuring=AwaitingPerson())


def _with_rivals(
    setup: TrackerSetup, person: TrackedPerson, poses: Sequence[RootedPose], captured_ns: int, evidence: Evidence
) -> tuple[Tracking, Outcome] | None:
    """A track of the most probable of poses and the opposite one, by misfit and feet, with others that fit as its rivals.

    None where none fits as a person does: furniture.
    """
    anatomy, model = setup.anatomy, person.model
    error = partial(error_of, model, evidence, residual_weights(setup, p.PARTICLE_HOLD))
    opposite = exchanged(setup, person, evidence, min(poses, key=error), "back", p.SEARCH_PASSES)
    poses = [one for one in (*poses, opposite) if allowed(setup, one) and error(one) <= p.START_MISFIT_M2]
    if not poses:
        return None
    errors = np.array([error(one) for one in poses])
    reaches = [foot_reach(anatomy, model, evidence.rays, one, person.stature) for one in poses]
    against = nats_against(errors, [None if one is None else one / person.stature for one in reaches])
    best = int(np.argmin(against))
    support = support_fraction(model, evidence, poses[best])
    if support < p.START_SUPPORT:
        return None
    person = replace(person, expected_support=support)
    tracking, outcome = start_tracking(setup, person, poses[best], captured_ns, float(errors[best]))
    rest = [k for k in range(len(poses)) if k != best and errors[k] <= p.RIVAL_FITS * errors[best]]
    tracking = with_rivals(anatomy, tracking, [poses[k] for k in rest], against[best] - against[rest])
    return started(setup, tracking, captured_ns), replace(outcome, body=person.body)
