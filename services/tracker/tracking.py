"""Tracking of one person: initialization, filter, loss, relocalization.  [Hybrid V]"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from zenocap.common.arrays import Mask
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.messages import Phase
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.average_body import stature_of
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, evidence_of
from zenocap.services.tracker.filter.confidence import limb_confidence, limb_features
from zenocap.services.tracker.filter.filter_step import filter_step
from zenocap.services.tracker.filter.rivals import follow_rivals, heading_nats, rival_ambiguity
from zenocap.services.tracker.hull.contour_rays import extract_outlines
from zenocap.services.tracker.initialization import decisions
from zenocap.services.tracker.initialization.any_posture import average_person, start_in_any_posture
from zenocap.services.tracker.initialization.heading import with_toes
from zenocap.services.tracker.initialization.relocalization import check_elsewhere, check_other_postures, search
from zenocap.services.tracker.initialization.t_pose import await_person
from zenocap.services.tracker.states import (
    RIVAL_KINDS,
    AwaitingPerson,
    Lost,
    Outcome,
    RivalKind,
    TrackedPerson,
    TrackerSetup,
    Tracking,
    TrackState,
)
from zenocap.services.tracker.view_check.view_consistency import check_views, initial_consistency, untested_lags, untrusted


def initial_state(setup: TrackerSetup) -> TrackState:
    """Initial state: wait for a T-pose; with a known height, search at once for an average body, until the T-pose."""
    views = initial_consistency(list(setup.cameras))
    if setup.person_height is None:
        return TrackState(AwaitingPerson(), views)
    return TrackState(Lost(average_person(setup, setup.person_height), None), views)


def remeasure(setup: TrackerSetup) -> TrackState:
    """Initial state after a user's request to measure the body: wait for the T-pose."""
    state = initial_state(setup)
    return replace(state, phase=AwaitingPerson(t_pose_only=True)) if awaiting_person(state) else state


def resume(
    setup: TrackerSetup, state: TrackState, body: Bdp, pose: Pose, captured_ns: int, *, measured: bool = True
) -> TrackState:
    """State after a restart: search for a person with known body and last pose.  measured: see `Outcome`.

    The next T-pose is measured: with the body of another program the person might never be found.
    """
    person = replace(known_person(setup, body), measured=measured, measuring=AwaitingPerson())
    return replace(state, phase=Lost(person, RootedPose.of(setup.anatomy, body, pose), seen_ns=captured_ns))


def known_person(setup: TrackerSetup, body: Bdp) -> TrackedPerson:
    """A person with a measured body."""
    return TrackedPerson.of(setup.anatomy, body, stature_of(setup.anatomy, body))


def with_other_times(state: TrackState) -> TrackState:
    """The state after the times of the views have been corrected: what was found out of step may no longer be."""
    return replace(state, consistency=untested_lags(state.consistency))


def track(
    setup: TrackerSetup, state: TrackState, captured_ns: int, masks: Mapping[str, Mask]
) -> tuple[TrackState, Outcome]:
    """Track the person in one frame set; returns the next state and the result.

    masks: by viewer, (height, width), not 0 on the person; of two or more views.
    """
    view_masks = [masks.get(viewer) for viewer in setup.cameras]
    contours, silhouettes = extract_outlines(view_masks, list(setup.cameras.values()), setup.options.points)
    views, findings = check_views(state.consistency, captured_ns, contours, silhouettes)
    excluded = untrusted(findings)
    evidence, points = evidence_of(contours, silhouettes, excluded)
    phase, outcome = advance_phase(setup, state.phase, captured_ns, evidence, state.count)
    if isinstance(phase, Tracking) and outcome.pose is not None:
        phase, outcome = decisions.turned_as_decided(setup, phase, outcome, captured_ns, evidence)
        phase, outcome = with_features(setup, phase, outcome, evidence)
    if not isinstance(phase, AwaitingPerson):
        outcome = replace(outcome, measured=phase.person.measured)
    used = tuple(viewer for n, viewer in enumerate(setup.cameras) if viewer in masks and n not in excluded)
    texts = tuple(finding.text for finding in findings)
    return TrackState(phase, views, state.count + 1), replace(outcome, views=used, findings=texts, points=points)


def with_features(setup: TrackerSetup, phase: Tracking, outcome: Outcome, evidence: Evidence) -> tuple[Tracking, Outcome]:
    """The track and its result with what the confidence of the limbs and of the heading follows from."""
    if _tries_other_postures(setup):  # else the ambiguity of a limb is unknown
        person, before = phase.person, phase.limb_features
        features = limb_features(
            setup.anatomy, person.model, evidence, phase.estimate, phase.limb_support, person.expected_support,
            rival_ambiguity(setup.anatomy, phase), before,
        )  # fmt: skip
        phase, outcome = replace(phase, limb_features=features), replace(outcome, against=heading_nats(phase))
    toes = phase.toes if setup.options.filter.relocalization else None  # else the feet are not looked at
    return phase, replace(outcome, limb_features=phase.limb_features, toes=toes)


def awaiting_person(state: TrackState) -> bool:
    """True before a body is measured."""
    return isinstance(state.phase, AwaitingPerson)


def phase_of(state: TrackState) -> Phase:
    """Phase of the tracker, for its health."""
    match state.phase:
        case AwaitingPerson(seen=seen):
            return Phase.MEASURING_BODY if seen else Phase.AWAITING_PERSON
        case Tracking():
            return Phase.TRACKING
        case Lost():
            return Phase.LOST


def describe(state: TrackState) -> str:
    """Health text of the phase."""
    match state.phase:
        case AwaitingPerson(advice=advice):
            return advice
        case Tracking(misfits_in_row=0, toes=toes, person=person):
            certain = person.heading_known and (toes >= p.HEADING_TOES or state.phase.decided_ns is not None)
            body = "" if person.measured else " with average proportions: hold the T-pose to measure the body"
            return f"tracking{body}" if certain else f"tracking{body}, front or back is not certain"
        case Tracking():
            return "tracking, the body does not fit the scene"
        case Lost():
            return "searching for the person"


def advance_phase(
    setup: TrackerSetup, phase: AwaitingPerson | Tracking | Lost, captured_ns: int, evidence: Evidence, count: int
) -> tuple[AwaitingPerson | Tracking | Lost, Outcome]:
    """Next phase and the result of one frame set."""
    match phase:
        case AwaitingPerson():
            awaiting, outcome = await_person(setup, phase, captured_ns, evidence, partial(decisions.decided_front, setup))
            if isinstance(awaiting, Tracking):
                return decisions.started(setup, awaiting, captured_ns), outcome
            if awaiting.seen or phase.t_pose_only or setup.options.filter.start != "any-posture":
                return awaiting, outcome
            return start_in_any_posture(setup, awaiting, captured_ns, evidence)
        case Tracking() | Lost() if phase.person.measuring is not None:
            decided_ns = phase.decided_ns if isinstance(phase, Tracking) else None
            # The decision was about the start; since then the person may have turned, and the track with him or her.
            tracked = phase.estimate.rotation[:, 2] if isinstance(phase, Tracking) and decided_ns is not None else None
            sought = isinstance(phase, Lost) and phase.last is None
            front = partial(decisions.decided_front, setup) if sought else lambda _: tracked
            measured, outcome = await_person(setup, phase.person.measuring, captured_ns, evidence, front)
            if isinstance(measured, Tracking):
                return replace(measured, decided_ns=decided_ns), outcome
            phase = replace(phase, person=replace(phase.person, measuring=measured))
            return _follow(setup, phase, captured_ns, evidence, count)
        case Tracking() | Lost():
            return _follow(setup, phase, captured_ns, evidence, count)


def _tries_other_postures(setup: TrackerSetup) -> bool:
    options = setup.options
    return options.filter.relocalization and options.filter.other_postures and options.method == "hybrid"


def other_postures_period(phase: Tracking) -> int:
    """Frames from one search of other postures and rivals to the next: seldom while nothing is doubtful."""
    features = phase.limb_features
    if features is None or not phase.person.heading_known or limb_confidence(features).min() < p.SURE_LIMB:
        return p.OTHER_POSTURES_PERIOD
    return p.SURE_PERIOD


def _follow(
    setup: TrackerSetup, phase: Tracking | Lost, captured_ns: int, evidence: Evidence, count: int
) -> tuple[Tracking | Lost, Outcome]:
    """Track a person with known sizes, or search for one."""
    if isinstance(phase, Lost):
        if phase.last is not None:
            return search(setup, phase, captured_ns, evidence)
        found, outcome = search(setup, phase, captured_ns, evidence, partial(decisions.allowed, setup))
        return decisions.started(setup, found, captured_ns) if isinstance(found, Tracking) else found, outcome
    rng = np.random.default_rng([setup.options.seed, count])
    after, outcome = filter_step(setup, phase, captured_ns, evidence, rng)
    if not isinstance(after, Tracking) or outcome.pose is None or not setup.options.filter.relocalization:
        return after, outcome
    after = with_toes(setup.anatomy, after, evidence.rays, alone=not _tries_other_postures(setup))
    if after.misfits_in_row in p.RELOCALIZE_AFTER:
        elsewhere, outcome = check_elsewhere(setup, after, outcome, captured_ns, evidence)
        if decisions.faces(elsewhere.estimate, after.estimate.rotation[:, 2]):
            elsewhere = replace(elsewhere, decided_ns=after.decided_ns)
        return elsewhere, outcome
    if _tries_other_postures(setup):
        turn, rest = divmod(count, other_postures_period(phase))
        searches = rest == 0
        sought: tuple[RivalKind, ...] = (RIVAL_KINDS[turn % len(RIVAL_KINDS)],) if searches else ()
        after, outcome = follow_rivals(setup, phase, after, outcome, captured_ns, evidence, sought)
        if searches:
            return check_other_postures(setup, after, outcome, captured_ns, evidence)
    return after, outcome
