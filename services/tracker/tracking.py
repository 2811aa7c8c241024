"""One person followed through instants of silhouettes: found, measured, tracked, lost and found again.  [Hybrid V]"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from services.tracker.agreement import agreement, untrusted, watch
from services.tracker.closest import Singles, rays_of
from services.tracker.filtering import HOLD, LEAST_RAYS, LOST_AFTER, advanced, begin, nothing, weights_of
from services.tracker.finding import everyday, explained, found_in, misfit
from services.tracker.hull import outlines, scene_of, without
from services.tracker.initial import Stretched, measured_from, stretched_in
from services.tracker.knowledge import beginning, learnt
from services.tracker.model import model_of
from services.tracker.phases import Lost, Mask, Options, Outcome, Person, Setup, Tracking, TrackState, Waiting
from services.tracker.posed import Posed
from services.tracker.sizes import COUNT
from services.tracker.stature import average_body

__all__ = ["Mask", "Options", "Outcome", "Setup", "TrackState", "describe", "follow", "initial_state"]

SAMPLES = 4  # instants of the initial posture that the body is measured in
STILL_M, STILL_DOT = 0.05, 0.985  # how far the person may move between them, and turn
REST = 15  # instants before another try, after one that failed
SEARCH_ROUNDS = 4
SOMEBODY_SHARE = 0.4  # of the scene is on the body: somebody is there, in this posture or another
BETTER = 0.8  # the mean squared gap of a pose elsewhere that is preferred to the one followed, of that one's
AGAIN = 30  # instants between two looks elsewhere, then twice as many, and so on


def initial_state(setup: Setup) -> TrackState:
    views = agreement(list(setup.cameras))
    if setup.person_height is None:
        return TrackState(Waiting(), views)
    average = average_body(setup.anatomy, setup.person_height)
    person = Person(average, model_of(setup.anatomy, average), setup.person_height, beginning(average, np.zeros(COUNT)))
    return TrackState(Lost(person, None), views)


def follow(setup: Setup, state: TrackState, captured_ns: int, masks: Mapping[str, Mask]) -> tuple[TrackState, Outcome]:
    """One instant.  masks: by viewer, (height, width) not 0 on the person; of two or more views."""
    seen_by = [masks.get(viewer) for viewer in setup.cameras]
    contours, seen = outlines(seen_by, list(setup.cameras.values()), setup.options.points)
    views, findings = watch(state.agreement, contours, seen)
    doubted = untrusted(findings)
    rays = rays_of(scene_of(*without(contours, seen, doubted)))
    rng = np.random.default_rng([setup.options.seed, state.count])
    phase, outcome = _act(setup, state.phase, captured_ns, rays, rng)
    used = tuple(viewer for n, viewer in enumerate(setup.cameras) if viewer in masks and n not in doubted)
    said = tuple(finding.text for finding in findings)
    return TrackState(phase, views, state.count + 1), replace(outcome, views=used, findings=said)


def describe(state: TrackState) -> str:
    """What is being done, for people."""
    match state.phase:
        case Waiting(advice=advice):
            return advice
        case Tracking(bad=0):
            return "tracking"
        case Tracking():
            return "tracking, the body does not fit the scene"
        case Lost():
            return "searching for the person"


def _act(
    setup: Setup, phase: Waiting | Tracking | Lost, captured_ns: int, rays: Singles, rng: np.random.Generator
) -> tuple[Waiting | Tracking | Lost, Outcome]:
    match phase:
        case Waiting():
            return _wait(setup, phase, captured_ns, rays)
        case Lost():
            return _search(setup, phase, captured_ns, rays)
        case Tracking():
            after, outcome = advanced(setup, phase, captured_ns, rays, rng)
            if isinstance(after, Tracking) and rays.shape[1] >= LEAST_RAYS and _is_doubted(after.bad):
                return _challenged(setup, after, outcome, captured_ns, rays)
            return after, outcome


def _wait(setup: Setup, phase: Waiting, captured_ns: int, rays: Singles) -> tuple[Waiting | Tracking, Outcome]:
    """Until the initial posture was seen for SAMPLES instants, and a body fits it."""
    nobody = nothing(setup, lost=False)
    if phase.rest:
        return replace(phase, rest=phase.rest - 1), nobody
    seen = stretched_in(rays)
    if isinstance(seen, str):
        return Waiting(seen), nobody
    if phase.seen and not _still(phase.seen[-1], seen):
        phase = Waiting()
    scenes, all_seen = (*phase.scenes, rays), (*phase.seen, seen)
    if len(scenes) < SAMPLES:
        return Waiting(f"measuring the body ({len(scenes)} of {SAMPLES})", scenes, all_seen), nobody
    measured = measured_from(setup.anatomy, scenes, all_seen)
    if isinstance(measured, str):
        return Waiting(measured, rest=REST), nobody
    stature = float(np.median([one.stature for one in all_seen]))
    knowledge = beginning(average_body(setup.anatomy, stature), measured.logs)
    for rays_then, pose in zip(scenes, measured.poses, strict=True):
        knowledge = learnt(setup.anatomy, knowledge, rays_then, pose)
    person = Person(measured.body, model_of(setup.anatomy, measured.body), stature, knowledge)
    tracking, outcome = begin(setup, person, measured.poses[-1], captured_ns, measured.gap**2)
    return tracking, replace(outcome, body=measured.body)


def _still(before: Stretched, now: Stretched) -> bool:
    moved = float(np.linalg.norm(now.centre - before.centre))
    return moved < STILL_M and abs(float(now.across @ before.across)) > STILL_DOT


def _is_doubted(bad: int) -> bool:
    """Whether to look for the person elsewhere after so many bad instants; more and more seldom."""
    tries, rest = divmod(bad - LOST_AFTER, AGAIN)
    return bad >= LOST_AFTER and rest == 0 and tries & (tries + 1) == 0


def _challenged(
    setup: Setup, phase: Tracking, outcome: Outcome, captured_ns: int, rays: Singles
) -> tuple[Tracking | Lost, Outcome]:
    """The body does not fit the scene: go on from another pose that fits it better, if there is one."""
    weights, person = weights_of(setup, HOLD), phase.person
    pose = _found(setup, person, phase.estimate, rays)
    if pose is not None and misfit(person.model, rays, pose, weights) < BETTER * misfit(
        person.model, rays, phase.estimate, weights
    ):
        return begin(setup, person, pose, captured_ns, misfit(person.model, rays, pose, weights))
    if explained(person.model, rays, phase.estimate) < SOMEBODY_SHARE:
        return Lost(person, phase.estimate), nothing(setup, lost=True)
    return phase, outcome


def _found(setup: Setup, person: Person, last: Posed | None, rays: Singles) -> Posed | None:
    """The best pose of the person anywhere in a scene, from everyday postures and the last one."""
    postures = everyday(setup.anatomy)
    if last is not None:
        postures = (*postures, replace(last, rotation=np.eye(3)))
    return found_in(person.model, rays, postures, person.stature, weights_of(setup, HOLD), SEARCH_ROUNDS)


def _search(setup: Setup, phase: Lost, captured_ns: int, rays: Singles) -> tuple[Tracking | Lost, Outcome]:
    """Look for a known body everywhere, in a few postures."""
    if phase.rest or rays.shape[1] < LEAST_RAYS:
        return replace(phase, rest=max(0, phase.rest - 1)), nothing(setup, lost=True)
    model = phase.person.model
    pose = _found(setup, phase.person, phase.last, rays)
    if pose is None or explained(model, rays, pose) < SOMEBODY_SHARE:
        return replace(phase, rest=REST), nothing(setup, lost=True)
    error = misfit(model, rays, pose, weights_of(setup, HOLD))
    tracking, outcome = begin(setup, phase.person, pose, captured_ns, error)
    newly = phase.person.body if phase.last is None else None
    return tracking, replace(outcome, body=newly)
