"""Start without a T-pose: an average body, found in any posture and refined later.

The T-pose is still looked for, and replaces the body by a measured one when it is seen.
"""

# Paper (open): [Hybrid] does not define how the track starts.

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, support_fraction
from zenocap.services.tracker.filter.filter_step import no_pose, residual_weights, start_tracking
from zenocap.services.tracker.filter.rivals import nats_against, reach_of, with_rivals
from zenocap.services.tracker.initialization.decisions import allowed, started
from zenocap.services.tracker.initialization.localization import find_column, middle_and_span
from zenocap.services.tracker.initialization.relocalization import error_of, poses_anywhere
from zenocap.services.tracker.initialization.t_pose import detail_at
from zenocap.services.tracker.initialization.twins import exchanged
from zenocap.services.tracker.states import AwaitingPerson, Outcome, TrackedPerson, TrackerSetup, Tracking


def start_in_any_posture(
    setup: TrackerSetup, phase: AwaitingPerson, captured_ns: int, evidence: Evidence
) -> tuple[AwaitingPerson | Tracking, Outcome]:
    """Start tracking an average body once a person is in view for START_AFTER_NS; tried again every START_RETRY_NS.

    One on the floor is tried in other frame sets than one who stands, and not before it has moved or come into view.
    """
    no_result = no_pose(setup, lost=False)
    column = find_column(evidence.rays)
    if column is None:
        return replace(phase, heights=(), places=(), appeared=True), no_result
    height = column.top - max(column.low, -p.GROUND_TOLERANCE_M)
    middle, span = middle_and_span(evidence.rays, column)
    on_ground = column.low < p.FLOOR_LOW_M and span > p.FLOOR_SPAN_M
    lying = [one for one in p.FLOOR_STATURES_M if on_ground and height < p.FLOOR_HEIGHT * one]
    heights = _longer(phase.heights, captured_ns, height) if p.MIN_STATURE_M <= height <= p.MAX_STATURE_M else ()
    places = _longer(phase.places, captured_ns, np.array([height, *middle])) if lying else ()
    phase = replace(phase, heights=heights, places=places, appeared=phase.appeared and bool(lying))
    if heights and captured_ns - heights[0][0] >= p.START_AFTER_NS:
        on_floor, phase = False, replace(phase, heights=_recent(heights))
        statures = [float(np.percentile([one for _, one in heights], p.START_STATURE_PERCENTILE))]
    elif places and captured_ns - places[0][0] >= p.START_AFTER_NS + p.START_RETRY_NS // 2:
        on_floor, phase = True, replace(phase, places=_recent(places))
        statures = lying if phase.appeared or _moved(places) else []
    else:
        return phase, no_result
    began: tuple[Tracking, Outcome] | None = None
    for stature in statures:
        person = replace(average_person(setup, stature), heading_known=False, detail=detail_at(setup, column.centre))
        found = poses_anywhere(setup, person, None, None, evidence, partial(allowed, setup), on_floor=on_floor)
        one = _with_rivals(setup, person, found, captured_ns, evidence) if found else None
        if began is None or (one is not None and one[1].likelihood > began[1].likelihood):
            began = one
    return began or (phase, no_result)


Seen = TypeVar("Seen")


def _longer(before: tuple[tuple[int, Seen], ...], captured_ns: int, seen: Seen) -> tuple[tuple[int, Seen], ...]:
    later = bool(before) and captured_ns > before[-1][0]  # a clock may have been set back
    return (*(before if later else ()), (captured_ns, seen))


def _recent(seen: tuple[tuple[int, Seen], ...]) -> tuple[tuple[int, Seen], ...]:
    """What was seen lately, so that it is tried again after START_RETRY_NS."""
    return tuple(one for one in seen if seen[-1][0] - one[0] <= p.START_AFTER_NS - p.START_RETRY_NS)


def _moved(places: tuple[tuple[int, Floats], ...]) -> bool:
    """Whether the mean place of the first half is another one than that of the second half."""
    points, half = np.array([one for _, one in places]), len(places) // 2
    return float(np.linalg.norm(points[:half].mean(axis=0) - points[half:].mean(axis=0))) > p.FLOOR_MOTION_M


def average_person(setup: TrackerSetup, stature: float) -> TrackedPerson:
    """Person of average proportions, until the T-pose is seen.  stature: metres."""
    person = TrackedPerson.of(setup.anatomy, average_body(setup.anatomy, stature), stature)
    return replace(person, measured=False, measuring=AwaitingPerson())


def _with_rivals(
    setup: TrackerSetup, person: TrackedPerson, poses: Sequence[RootedPose], captured_ns: int, evidence: Evidence
) -> tuple[Tracking, Outcome] | None:
    """A track of the most probable of poses and the opposite of the first, by misfit and feet; others that fit are rivals.

    poses: the one that fits best first.  None where none fits as a person does: furniture.
    """
    anatomy, model = setup.anatomy, person.model
    error = partial(error_of, model, evidence, residual_weights(setup, p.PARTICLE_HOLD))
    opposite = exchanged(setup, person, evidence, poses[0], "back", p.SEARCH_PASSES)
    poses = [one for one in (*poses, opposite) if allowed(setup, one) and error(one) <= p.START_MISFIT_M2]
    if not poses:
        return None
    errors = np.array([error(one) for one in poses])
    against = nats_against(errors, [reach_of(anatomy, person, evidence, one) for one in poses])
    best = int(np.argmin(against))
    support = support_fraction(model, evidence, poses[best])
    if support < p.START_SUPPORT:
        return None
    person = replace(person, expected_support=support)
    tracking, outcome = start_tracking(setup, person, poses[best], captured_ns, float(errors[best]))
    rest = [k for k in range(len(poses)) if k != best and errors[k] <= p.RIVAL_FITS * errors[best]]
    tracking = with_rivals(anatomy, tracking, [poses[k] for k in rest], against[best] - against[rest])
    return started(setup, tracking, captured_ns), replace(outcome, body=person.body)
