"""One person followed through instants of silhouettes: found, measured, tracked, lost and found again.  [Hybrid V]"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.proportions import stretched_angles
from common.camera.pinhole import Camera
from services.tracker.agreement import Agreement, agreement, untrusted, watch
from services.tracker.closest import Singles, points_of, rays_of
from services.tracker.coordinates import coordinates_of
from services.tracker.finding import Stretched, explained, found_in, measured_from, stretched_in
from services.tracker.hull import outlines, scene_of, without
from services.tracker.knowledge import Knowledge, beginning, improved, is_new, learnt
from services.tracker.model import Model, model_of
from services.tracker.particles import NO_TABLES, Cloud, advance, draw, everywhere, weighted
from services.tracker.posed import Posed, change
from services.tracker.prior.model import Prior, at_rate
from services.tracker.refine import Weights, refine
from services.tracker.sizes import COUNT
from services.tracker.stature import average_body

Mask = NDArray[np.uint8]
Method = Literal["hybrid", "image-force", "particle-filter"]
Refinement = Literal["gauss-newton", "force", "force-printed"]

SAMPLES = 4  # instants of the initial posture that the body is measured in
STILL_M, STILL_DOT = 0.05, 0.985  # how far the person may move between them, and turn
REST = 15  # instants before another try, after one that failed
SPREAD_M, LIMIT_M = 0.01, 0.15  # of a gap; beyond the limit nothing pulls
RAYS = 100.0  # independent ones in a scene: neighbours on a contour err together
CONTRAST = RAYS / (2.0 * 0.01**2)  # 1 / sigma^2 of the likelihood, 1 / m^2
HOLD = (0.10, 0.20, 0.40)  # m, rad, rad: how far refinement may go from where a particle was put, standard deviations
KEEP = (0.05, 0.10, 0.20)  # the same of the estimate about what was expected
DAMPING = 0.8  # of the velocity from one instant to the next
NOISE = (0.02, 0.05, 0.10)  # m, rad, rad: of dynamic proposals from one instant to the next
PRIOR_SHARE, LEAST_SHARE, MOST_SHARE = 0.5, 0.2, 0.8  # of the proposals that come from the prior
ADAPTING = 0.05
LOST_SHARE, LOST_AFTER = 0.55, 6  # of the scene is on the body, for so many instants: it is somewhere else
FOUND_SHARE = 0.75
LEAST_RAYS = 60  # of a scene in which anybody can be seen
SEARCH_ROUNDS = 10


@dataclass(frozen=True)
class Options:
    """points: of the visual hull.  iterations: of the refinement.  seed: of everything that is drawn."""

    method: Method = "hybrid"
    particles: int = 40
    points: int = 400
    iterations: int = 4
    seed: int = 0
    refinement: Refinement = "gauss-newton"


@dataclass(frozen=True)
class Setup:
    """cameras: by viewer, at the working size, in the rig's order.  frame_ns: frame period.  person_height: metres."""

    anatomy: Anatomy
    cameras: Mapping[str, Camera]
    frame_ns: int
    prior: Prior | None
    options: Options
    person_height: float | None = None


@dataclass(frozen=True)
class Waiting:
    """Nobody is known yet.  scenes: rays of the initial posture so far, with what they show.  rest: instants to wait."""

    advice: str = "waiting for a person"
    scenes: tuple[Singles, ...] = ()
    seen: tuple[Stretched, ...] = ()
    rest: int = 0


@dataclass(frozen=True)
class Person:
    """body: as measured.  model: the same for compiled code.  stature: metres."""

    body: Bdp
    model: Model
    stature: float
    knowledge: Knowledge


@dataclass(frozen=True)
class Tracking:
    """cloud: the particles.  estimate: the last pose, with the change (6 + d,) a second before it.

    prior_share: of the proposals.  bad: instants in a row in which the body was not where the scene is.
    """

    person: Person
    cloud: Cloud
    estimate: Posed
    velocity: Floats
    captured_ns: int
    prior_share: float = PRIOR_SHARE
    bad: int = 0


@dataclass(frozen=True)
class Lost:
    """The body is known, but not where it is.  last: the pose before.  rest: instants before it is searched for again."""

    person: Person
    last: Posed | None
    rest: int = 0


@dataclass(frozen=True)
class TrackState:
    """phase: what is known of the person.  agreement: of the views with one another.  count: instants so far."""

    phase: Waiting | Tracking | Lost
    agreement: Agreement
    count: int = 0


@dataclass(frozen=True)
class Outcome:
    """body: when it was newly measured.  pose: None while there is none.  views: those that were used.

    spread: (angles + 3,) standard deviations over the particles, radians, then the position's, metres.
    """

    body: Bdp | None
    pose: Pose | None
    spread: Floats
    likelihood: float
    effective: float
    lost: bool
    views: tuple[str, ...]
    findings: tuple[str, ...] = ()


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
            return _track(setup, phase, captured_ns, rays, rng)


def _wait(setup: Setup, phase: Waiting, captured_ns: int, rays: Singles) -> tuple[Waiting | Tracking, Outcome]:
    """Until the initial posture was seen for SAMPLES instants, and a body fits it."""
    nobody = _nothing(setup, lost=False)
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
    person = Person(measured.body, model_of(setup.anatomy, measured.body), stature, knowledge)
    tracking, outcome = _begin(setup, person, measured.poses[-1], captured_ns, measured.gap**2)
    return tracking, replace(outcome, body=measured.body)


def _still(before: Stretched, now: Stretched) -> bool:
    moved = float(np.linalg.norm(now.centre - before.centre))
    return moved < STILL_M and abs(float(now.across @ before.across)) > STILL_DOT


def _begin(setup: Setup, person: Person, pose: Posed, captured_ns: int, error: float) -> tuple[Tracking, Outcome]:
    """Start to track from a pose."""
    n = setup.options.particles
    cloud = everywhere(np.tile(pose.position, (n, 1)), np.tile(pose.rotation, (n, 1, 1)), np.tile(pose.values, (n, 1)))
    tracking = Tracking(person, cloud, pose, np.zeros(6 + len(pose.values)), captured_ns)
    return tracking, _outcome(setup, pose, cloud, error)


def _search(setup: Setup, phase: Lost, captured_ns: int, rays: Singles) -> tuple[Tracking | Lost, Outcome]:
    """Look for a known body everywhere, in a few postures."""
    if phase.rest or rays.shape[1] < LEAST_RAYS:
        return replace(phase, rest=max(0, phase.rest - 1)), _nothing(setup, lost=True)
    coordinates = coordinates_of(setup.anatomy)
    upright = np.eye(3)
    postures = [
        Posed(np.zeros(3), upright, coordinates.of_pose(Pose(np.zeros(3), angles)))
        for angles in (setup.anatomy.neutral, stretched_angles(setup.anatomy))
    ]
    if phase.last is not None:
        postures.append(replace(phase.last, rotation=upright))
    model = phase.person.model
    pose = found_in(model, rays, postures, phase.person.stature, _weights(setup, HOLD), SEARCH_ROUNDS)
    if explained(model, rays, pose) < FOUND_SHARE:
        return replace(phase, rest=REST), _nothing(setup, lost=True)
    tracking, outcome = _begin(setup, phase.person, pose, captured_ns, 0.0)
    newly = phase.person.body if phase.last is None else None
    return tracking, replace(outcome, body=newly)


def _track(
    setup: Setup, phase: Tracking, captured_ns: int, rays: Singles, rng: np.random.Generator
) -> tuple[Tracking | Lost, Outcome]:
    """One step of the filter."""
    if rays.shape[1] < LEAST_RAYS:
        return _miss(setup, phase)
    options, person = setup.options, phase.person
    instants = max(1.0, (captured_ns - phase.captured_ns) / setup.frame_ns)
    velocity = DAMPING * phase.velocity * setup.frame_ns / 1e9 * instants
    prior = None if setup.prior is None or options.method != "hybrid" else _at_rate(setup.prior, setup.frame_ns)
    tables = NO_TABLES if prior is None else prior.tables
    subspace = 1 if prior is None else prior.dimensions
    share = phase.prior_share if prior is not None else 0.0
    draws = draw(phase.cloud, share, subspace, rng)
    n, d = phase.cloud.values.shape
    out = Cloud(np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, d)), np.zeros(n, np.int64), np.empty(n))
    errors = np.empty(n)
    iterations = 0 if options.method == "particle-filter" else options.iterations
    deviations = _levels(d, NOISE) * np.sqrt(instants)
    advance(
        person.model, tables, prior is not None, rays, _weights(setup, HOLD), iterations,
        phase.cloud, draws, velocity, deviations, out, errors,
    )  # fmt: skip
    cloud = out._replace(weights=weighted(errors, CONTRAST))
    estimate = _estimate(setup, phase, cloud, rays, velocity)
    best = float(errors.min())
    bad = phase.bad + 1 if explained(person.model, rays, estimate) < LOST_SHARE else 0
    if bad >= LOST_AFTER:
        return Lost(person, phase.estimate), _nothing(setup, lost=True)
    moved = change(phase.estimate, estimate) * 1e9 / max(captured_ns - phase.captured_ns, 1)
    from_prior = float(cloud.weights[draws.kinds == 1].sum())
    adapted = phase.prior_share + ADAPTING * (from_prior - phase.prior_share)
    person, body = _learn(setup, person, rays, estimate)
    tracking = Tracking(person, cloud, estimate, moved, captured_ns, float(np.clip(adapted, LEAST_SHARE, MOST_SHARE)), bad)
    return tracking, replace(_outcome(setup, estimate, cloud, best), body=body)


def _learn(setup: Setup, person: Person, rays: Singles, pose: Posed) -> tuple[Person, Bdp | None]:
    """A new posture teaches something of the body; the body when it was changed by that."""
    if not is_new(person.knowledge, pose) or explained(person.model, rays, pose) < FOUND_SHARE:
        return person, None
    knowledge = learnt(setup.anatomy, person.knowledge, rays, pose)
    better = improved(setup.anatomy, knowledge)
    if better is None:
        return replace(person, knowledge=knowledge), None
    knowledge, body = better
    return replace(person, body=body, model=model_of(setup.anatomy, body), knowledge=knowledge), body


@lru_cache(maxsize=8)
def _at_rate(prior: Prior, frame_ns: int) -> Prior:
    return at_rate(prior, 1e9 / frame_ns)


def _estimate(setup: Setup, phase: Tracking, cloud: Cloud, rays: Singles, velocity: Floats) -> Posed:
    """The heaviest particle, refined once more and held near what was expected."""
    k = int(np.argmax(cloud.weights))
    best = Posed(cloud.positions[k].copy(), cloud.rotations[k].copy(), cloud.values[k].copy())
    if setup.options.method == "particle-filter":
        return best
    refine(
        phase.person.model, rays, _weights(setup, KEEP), 2, best.position, best.rotation, best.values,
        best.position.copy(), best.rotation.copy(), best.values.copy(),
    )  # fmt: skip
    return best


def _miss(setup: Setup, phase: Tracking) -> tuple[Tracking | Lost, Outcome]:
    """Nobody is seen: the particles wait."""
    bad = phase.bad + 1
    if bad >= 10 * LOST_AFTER:
        return Lost(phase.person, phase.estimate), _nothing(setup, lost=True)
    return replace(phase, bad=bad), _nothing(setup, lost=True)


def _weights(setup: Setup, levels: Sequence[float]) -> Weights:
    d = coordinates_of(setup.anatomy).dimension
    return Weights(SPREAD_M, LIMIT_M, 1.0 / _levels(d, levels) ** 2, RAYS / setup.options.points)


def _levels(d: int, levels: Sequence[float]) -> Floats:
    """(6 + d,) one number for the position, one for the orientation, one for all coordinates."""
    return np.concatenate([np.full(3, levels[0]), np.full(3, levels[1]), np.full(d, levels[2])])


def _outcome(setup: Setup, pose: Posed, cloud: Cloud, error: float) -> Outcome:
    effective = float(1.0 / np.sum(cloud.weights**2))
    return Outcome(
        None,
        pose.pose(setup.anatomy),
        _spread(setup.anatomy, cloud),
        float(np.exp(-error * CONTRAST)),
        effective,
        False,
        (),
    )


def _spread(anatomy: Anatomy, cloud: Cloud) -> Floats:
    """Of a ball joint, how far its rotation varies about each of its part's own axes."""
    coordinates = coordinates_of(anatomy)
    deviations = _deviation(cloud.values, cloud.weights)
    spread = np.zeros(len(anatomy.angles) + 3)
    for k, joint in enumerate(anatomy.joints):
        start, at = int(coordinates.first[k]), int(anatomy.tree[k, 1])
        for n, axis in enumerate(joint.axes):
            if start >= 0:
                spread[at + n] = deviations[start + ("xyz".index(axis) if len(joint.axes) == 3 else 0)]
    spread[:3] = _deviation(cloud.rotations.reshape(len(cloud.weights), 9), cloud.weights).mean() * np.sqrt(1.5)
    spread[-3:] = _deviation(cloud.positions, cloud.weights)
    return spread


def _deviation(values: Floats, weights: Floats) -> Floats:
    mean = weights @ values
    deviation: Floats = np.sqrt(np.maximum(weights @ (values - mean) ** 2, 0.0))
    return deviation


def _nothing(setup: Setup, *, lost: bool) -> Outcome:
    return Outcome(None, None, np.zeros(len(setup.anatomy.angles) + 3), 0.0, 0.0, lost, ())
