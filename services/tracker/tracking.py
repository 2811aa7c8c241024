"""One person followed through instants of silhouettes: found, measured, tracked, lost and found again.  [Hybrid V]"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from common.body.definition import Pose
from common.body.proportions import stretched_angles
from services.tracker.agreement import agreement, untrusted, watch
from services.tracker.closest import Singles, points_of, rays_of
from services.tracker.coordinates import coordinates_of
from services.tracker.filtering import HOLD, LEAST_RAYS, advanced, begin, nothing, weights_of
from services.tracker.finding import Stretched, explained, found_in, measured_from, stretched_in
from services.tracker.hull import outlines, scene_of, without
from services.tracker.knowledge import beginning, learnt
from services.tracker.model import model_of
from services.tracker.phases import Lost, Mask, Options, Outcome, Person, Setup, Tracking, TrackState, Waiting
from services.tracker.posed import Posed
from services.tracker.room import Room, room_of
from services.tracker.sizes import COUNT
from services.tracker.stature import average_body

__all__ = ["Mask", "Options", "Outcome", "Setup", "TrackState", "describe", "follow", "initial_state"]

SAMPLES = 4  # instants of the initial posture that the body is measured in
STILL_M, STILL_DOT = 0.05, 0.985  # how far the person may move between them, and turn
REST = 15  # instants before another try, after one that failed
SEARCH_ROUNDS = 10
USUAL_SHARE = 0.6  # of a scene on the body, before it is known
FOUND_SHARE = 0.8  # of what is usual: found


def initial_state(setup: Setup) -> TrackState:
    views = agreement(list(setup.cameras))
    if setup.person_height is None:
        return TrackState(Waiting(), views)
    average = average_body(setup.anatomy, setup.person_height)
    person = Person(
        average, model_of(setup.anatomy, average), setup.person_height, beginning(average, np.zeros(COUNT)), USUAL_SHARE
    )
    return TrackState(Lost(person, None), views)


def follow(setup: Setup, state: TrackState, captured_ns: int, masks: Mapping[str, Mask]) -> tuple[TrackState, Outcome]:
    """One instant.  masks: by viewer, (height, width) not 0 on the person; of two or more views."""
    seen_by = [masks.get(viewer) for viewer in setup.cameras]
    contours, seen = outlines(seen_by, list(setup.cameras.values()), setup.options.points)
    views, findings = watch(state.agreement, contours, seen)
    doubted = untrusted(findings)
    contours, seen = without(contours, seen, doubted)
    rays, room = rays_of(scene_of(contours, seen)), room_of(seen)
    rng = np.random.default_rng([setup.options.seed, state.count])
    phase, outcome = _act(setup, state.phase, captured_ns, rays, room, rng)
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
    setup: Setup, phase: Waiting | Tracking | Lost, captured_ns: int, rays: Singles, room: Room, rng: np.random.Generator
) -> tuple[Waiting | Tracking | Lost, Outcome]:
    match phase:
        case Waiting():
            return _wait(setup, phase, captured_ns, rays)
        case Lost():
            return _search(setup, phase, captured_ns, rays, room)
        case Tracking():
            return advanced(setup, phase, captured_ns, rays, room, rng)


def _wait(setup: Setup, phase: Waiting, captured_ns: int, rays: Singles) -> tuple[Waiting | Tracking, Outcome]:
    """Until the initial posture was seen for SAMPLES instants, and a body fits it."""
    nobody = nothing(setup, lost=False)
    if phase.rest:
        return replace(phase, rest=phase.rest - 1), nobody
    seen = stretched_in(points_of(rays))
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
    model = model_of(setup.anatomy, measured.body)
    person = Person(measured.body, model, stature, knowledge, explained(model, rays, measured.poses[-1]))
    tracking, outcome = begin(setup, person, measured.poses[-1], captured_ns, measured.gap**2)
    return tracking, replace(outcome, body=measured.body)


def _still(before: Stretched, now: Stretched) -> bool:
    moved = float(np.linalg.norm(now.centre - before.centre))
    return moved < STILL_M and abs(float(now.across @ before.across)) > STILL_DOT


def _search(setup: Setup, phase: Lost, captured_ns: int, rays: Singles, room: Room) -> tuple[Tracking | Lost, Outcome]:
    """Look for a known body everywhere, in a few postures."""
    if phase.rest or rays.shape[1] < LEAST_RAYS:
        return replace(phase, rest=max(0, phase.rest - 1)), nothing(setup, lost=True)
    coordinates = coordinates_of(setup.anatomy)
    upright = np.eye(3)
    postures = [
        Posed(np.zeros(3), upright, coordinates.of_pose(Pose(np.zeros(3), angles)))
        for angles in (setup.anatomy.neutral, stretched_angles(setup.anatomy))
    ]
    if phase.last is not None:
        postures.append(replace(phase.last, rotation=upright))
    model = phase.person.model
    pose = found_in(model, rays, room, postures, phase.person.stature, weights_of(setup, HOLD), SEARCH_ROUNDS)
    if explained(model, rays, pose) < FOUND_SHARE * phase.person.typical:
        return replace(phase, rest=REST), nothing(setup, lost=True)
    tracking, outcome = begin(setup, phase.person, pose, captured_ns, 0.0)
    newly = phase.person.body if phase.last is None else None
    return tracking, replace(outcome, body=newly)
