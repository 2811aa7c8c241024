"""One person followed through instants of silhouettes: found, measured, tracked, lost and found again.  [Hybrid V]"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from common.body.anatomy import Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Bdp, Pose
from common.body.kinematics import part_frames
from common.body.proportions import HIP_HEIGHT, KNEE_HEIGHT
from services.tracker.agreement import agreement, untrusted, watch
from services.tracker.closest import Singles, rays_of
from services.tracker.filtering import HOLD, LEAST_RAYS, advanced, begin, nothing, weights_of
from services.tracker.finding import everyday, explained, found_in, misfit, turned_round
from services.tracker.hull import outlines, scene_of, without
from services.tracker.initial import Stretched, measured_from, near_to, stretched_in
from services.tracker.knowledge import EFFECTIVE, beginning, learnt
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
SEARCH_ROUNDS = 4
USUAL_SHARE = 0.5  # of a scene on the body, before it is known
FOUND_SHARE = 0.8  # of what is usual: found
DOUBTS = (1, 3)  # bad instants in a row after which to look elsewhere
LOOK_BACK = 15  # instants between two looks at whether the person faces the other way
BETTER = 0.75  # the mean squared misfit of another pose, of the one followed, for it to be taken instead
HUMBLER, LEAST_SHARE = 0.9, 0.25  # less is taken for usual after every search in vain, but no less than this
REMEMBERED_NS = 2_000_000_000  # so long somebody who was lost still faces about the same way


def initial_state(setup: Setup) -> TrackState:
    views = agreement(list(setup.cameras))
    if setup.person_height is None:
        return TrackState(Waiting(), views)
    average = average_body(setup.anatomy, setup.person_height)
    person = Person(
        average, model_of(setup.anatomy, average), setup.person_height, beginning(average, np.zeros(COUNT)), USUAL_SHARE
    )
    return TrackState(Lost(person, None), views)


def resumed(setup: Setup, state: TrackState, body: Bdp, pose: Pose, captured_ns: int) -> TrackState:
    """Somebody whose body is known and who was in this pose then: to be found again."""
    knee = next(k for k, joint in enumerate(setup.anatomy.joints) if joint.name == "right_knee")
    stature = abs(float(body.offsets[knee][1])) / (HIP_HEIGHT - KNEE_HEIGHT)
    person = Person(body, model_of(setup.anatomy, body), stature, beginning(body, np.zeros(COUNT)), USUAL_SHARE)
    rotation = np.ascontiguousarray(part_frames(setup.anatomy, body, pose)[0, :, :3])
    last = Posed(pose.position.copy(), rotation, coordinates_of(setup.anatomy).of_pose(pose))
    return replace(state, phase=Lost(person, last, seen_ns=captured_ns))


def follow(setup: Setup, state: TrackState, captured_ns: int, masks: Mapping[str, Mask]) -> tuple[TrackState, Outcome]:
    """One instant.  masks: by viewer, (height, width) not 0 on the person; of two or more views."""
    seen_by = [masks.get(viewer) for viewer in setup.cameras]
    contours, seen = outlines(seen_by, list(setup.cameras.values()), setup.options.points)
    views, findings = watch(state.agreement, contours, seen)
    doubted = untrusted(findings)
    contours, seen = without(contours, seen, doubted)
    scene = scene_of(contours, seen)
    rays, room = rays_of(scene), room_of(seen)
    phase, outcome = _act(setup, state.phase, captured_ns, rays, room, state.count)
    used = tuple(viewer for n, viewer in enumerate(setup.cameras) if viewer in masks and n not in doubted)
    said = tuple(finding.text for finding in findings)
    return TrackState(phase, views, state.count + 1), replace(outcome, views=used, findings=said, points=scene.points)


def knows_nobody(state: TrackState) -> bool:
    """Whether no body is known yet."""
    return isinstance(state.phase, Waiting)


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
    setup: Setup, phase: Waiting | Tracking | Lost, captured_ns: int, rays: Singles, room: Room, count: int
) -> tuple[Waiting | Tracking | Lost, Outcome]:
    match phase:
        case Waiting():
            return _wait(setup, phase, captured_ns, rays, room)
        case Lost():
            return _search(setup, phase, captured_ns, rays, room)
        case Tracking():
            rng = np.random.default_rng([setup.options.seed, count])
            after, outcome = advanced(setup, phase, captured_ns, rays, room, rng)
            if not isinstance(after, Tracking) or outcome.pose is None:
                return after, outcome
            if after.bad in DOUBTS:
                return _looked_around(setup, after, outcome, captured_ns, rays, room)
            if count % LOOK_BACK == 0 and not after.person.faces:
                return _looked_back(setup, after, outcome, captured_ns, rays, room)
            return after, outcome


def _wait(setup: Setup, phase: Waiting, captured_ns: int, rays: Singles, room: Room) -> tuple[Waiting | Tracking, Outcome]:
    """Until the initial posture was seen for SAMPLES instants, and a body fits it."""
    nobody = nothing(setup, lost=False)
    if phase.rest:
        return replace(phase, rest=phase.rest - 1), nobody
    seen = stretched_in(rays)
    if isinstance(seen, str):
        return Waiting(seen), nobody
    if phase.seen and not _still(phase.seen[-1], seen):
        phase = Waiting()
    scenes, rooms, all_seen = (*phase.scenes, rays), (*phase.rooms, room), (*phase.seen, seen)
    if len(scenes) < SAMPLES:
        return Waiting(f"measuring the body ({len(scenes)} of {SAMPLES})", scenes, rooms, all_seen), nobody
    found = measured_from(setup.anatomy, scenes, rooms, all_seen)
    if isinstance(found, str):
        return Waiting(found, rest=REST), nobody
    measured = found.measured
    stature = float(np.median([one.stature for one in all_seen]))
    knowledge = beginning(average_body(setup.anatomy, stature), measured.logs)
    for rays_then, pose in zip(scenes, measured.poses, strict=True):
        knowledge = learnt(setup.anatomy, knowledge, rays_then, pose, found.trust * EFFECTIVE)
    model = model_of(setup.anatomy, measured.body)
    typical = explained(model, near_to(rays, seen), measured.poses[-1])
    person = Person(measured.body, model, stature, knowledge, typical, found.faces)
    tracking, outcome = begin(setup, person, measured.poses[-1], captured_ns, measured.gap**2)
    return tracking, replace(outcome, body=measured.body)


def _still(before: Stretched, now: Stretched) -> bool:
    moved = float(np.linalg.norm(now.centre - before.centre))
    return moved < STILL_M and abs(float(now.across @ before.across)) > STILL_DOT


def _looked_around(
    setup: Setup, phase: Tracking, outcome: Outcome, captured_ns: int, rays: Singles, room: Room
) -> tuple[Tracking, Outcome]:
    """Whether the person is rather elsewhere, or in another posture, when the body does not fit the scene."""
    person, weights = phase.person, weights_of(setup, HOLD)
    facing = phase.estimate.rotation if person.faces else None
    pose = _found(setup, person, phase.estimate, facing, rays, room)
    if pose is None:
        return phase, outcome
    error = misfit(person.model, rays, room, pose, weights)
    if error > BETTER * misfit(person.model, rays, room, phase.estimate, weights):
        return phase, outcome
    return begin(setup, person, pose, captured_ns, error)


def _looked_back(
    setup: Setup, phase: Tracking, outcome: Outcome, captured_ns: int, rays: Singles, room: Room
) -> tuple[Tracking, Outcome]:
    """Whether the person rather faces the other way, as long as that is not clear: who moves shows it sooner or later."""
    person, weights = phase.person, weights_of(setup, HOLD)
    pose = turned_round(person.model, rays, room, phase.estimate, everyday(setup.anatomy), weights, SEARCH_ROUNDS)
    error = misfit(person.model, rays, room, pose, weights)
    now = misfit(person.model, rays, room, phase.estimate, weights)
    if error < BETTER * now:
        return begin(setup, replace(person, faces=True), pose, captured_ns, error)
    return replace(phase, person=replace(person, faces=now < BETTER * error)), outcome


def _found(
    setup: Setup, person: Person, last: Posed | None, facing: Floats | None, rays: Singles, room: Room
) -> Posed | None:
    """The best pose of a person anywhere in a scene, from everyday postures and the last one."""
    postures = everyday(setup.anatomy)
    if last is not None:
        postures = (*postures, replace(last, rotation=np.eye(3)))
    weights = weights_of(setup, HOLD)
    return found_in(person.model, rays, room, postures, person.stature, weights, SEARCH_ROUNDS, facing)


def _search(setup: Setup, phase: Lost, captured_ns: int, rays: Singles, room: Room) -> tuple[Tracking | Lost, Outcome]:
    """Look for a known body everywhere, in a few postures."""
    if phase.rest or rays.shape[1] < LEAST_RAYS:
        return replace(phase, rest=max(0, phase.rest - 1)), nothing(setup, lost=True)
    model, weights = phase.person.model, weights_of(setup, HOLD)
    recent = phase.person.faces and captured_ns - phase.seen_ns < REMEMBERED_NS
    facing = phase.last.rotation if phase.last is not None and recent else None
    pose = _found(setup, phase.person, phase.last, facing, rays, room)
    if pose is None or explained(model, rays, pose) < FOUND_SHARE * phase.person.typical:
        person = replace(phase.person, typical=max(LEAST_SHARE, HUMBLER * phase.person.typical))
        return replace(phase, person=person, rest=REST), nothing(setup, lost=True)
    tracking, outcome = begin(setup, phase.person, pose, captured_ns, misfit(model, rays, room, pose, weights))
    newly = phase.person.body if phase.last is None else None
    return tracking, replace(outcome, body=newly)
