"""One step of the filter: particles sampled, refined and weighted, an estimate, and what it teaches of the body."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Bdp
from common.body.rotation_vectors import rotation_of
from services.tracker.closest import Singles
from services.tracker.finding import explained
from services.tracker.knowledge import improved, is_new, learnt
from services.tracker.model import Model, model_of
from services.tracker.particles import NO_TABLES, Cloud, advance, draw, everywhere, weighted
from services.tracker.phases import Lost, Outcome, Person, Setup, Tracking
from services.tracker.posed import Posed, change
from services.tracker.prior.model import Prior, at_rate
from services.tracker.prior.sampling import all_distances
from services.tracker.refine import Weights, refine
from services.tracker.refinements import REFINEMENTS
from services.tracker.room import Room

SPREAD_M, LIMIT_M = 0.01, 0.15  # of a gap; beyond the limit nothing pulls
THIN = 2  # particles are refined on every second ray, the estimate on all
RAYS = 100.0  # independent ones in a scene: neighbours on a contour err together
CONTRAST = 30.0 / (2.0 * 0.01**2)  # 1 / sigma^2 of the likelihood, 1 / m^2: fewer still, the body is never quite right
HOLD = (0.10, 0.20, 0.40)  # m, rad, rad: how far refinement may go from where a particle was put, standard deviations
KEEP = (0.05, 0.10, 0.20)  # the same of the estimate about what was expected
APART = (0.10, 0.30)  # m, rad: of a particle from what was expected
DAMPING = 0.8  # of the velocity from one instant to the next
NOISE = (0.02, 0.05, 0.10)  # m, rad, rad: of dynamic proposals from one instant to the next
PRIOR_SHARE, LEAST_SHARE, MOST_SHARE = 0.5, 0.2, 0.8  # of the proposals that come from the prior
ADAPTING = 0.05
LOST_SHARE, LOST_AFTER = 0.6, 6  # of what usually lies on the body, for so many instants: it is somewhere else
GONE = 0.5  # of a scene is out of reach: the person is somewhere else, whatever is usual
WELL_SHARE = 0.9  # of what usually lies on the body: good enough to learn from
FORGETTING = 0.03  # of what is usual, with every instant
LEAST_RAYS = 60  # of a scene in which anybody can be seen


def begin(setup: Setup, person: Person, pose: Posed, captured_ns: int, error: float) -> tuple[Tracking, Outcome]:
    """Start to track from a pose."""
    n = setup.options.particles
    cloud = everywhere(np.tile(pose.position, (n, 1)), np.tile(pose.rotation, (n, 1, 1)), np.tile(pose.values, (n, 1)))
    tracking = Tracking(person, cloud, pose, np.zeros(6 + len(pose.values)), captured_ns, PRIOR_SHARE)
    return tracking, _outcome(setup, pose, cloud, error)


def advanced(
    setup: Setup, phase: Tracking, captured_ns: int, rays: Singles, room: Room, rng: np.random.Generator
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
    thinned = np.ascontiguousarray(rays[:, ::THIN])
    advance(
        person.model, tables, prior is not None, thinned, room, weights_of(setup, HOLD, THIN),
        REFINEMENTS.index(options.refinement), iterations,
        phase.cloud, draws, velocity, deviations, out, errors,
    )  # fmt: skip
    expected = _expected(person.model, phase.estimate, velocity)
    strange = np.zeros(n)
    if prior is not None:
        all_distances(tables, out.values, strange)
    usual = max(phase.strange, 0.0 if prior is None else prior.training.distances[1], 1e-3)
    costs = errors + (_departures(out, expected) + (strange / usual) ** 2) / (2.0 * CONTRAST)
    cloud = out._replace(weights=weighted(costs, CONTRAST))
    estimate = _estimate(setup, phase, cloud, rays, room, expected)
    best = float(errors[np.argmin(costs)])
    strangest = float(strange[np.argmin(costs)])
    share_on = explained(person.model, rays, estimate)
    away = share_on < LOST_SHARE * person.typical or best > GONE * LIMIT_M**2
    bad = phase.bad + 1 if away else 0
    if bad >= LOST_AFTER:
        return Lost(person, phase.estimate, seen_ns=phase.captured_ns), nothing(setup, lost=True)
    moved = change(phase.estimate, estimate) * 1e9 / max(captured_ns - phase.captured_ns, 1)
    from_prior = float(cloud.weights[draws.kinds == 1].sum())
    familiar = phase.strange + FORGETTING * (strangest - phase.strange)
    adapted = phase.prior_share + ADAPTING * (from_prior - phase.prior_share)
    body = None
    if share_on >= WELL_SHARE * person.typical:
        person, body = _learn(setup, person, rays, estimate)
    if not bad:
        person = replace(person, typical=person.typical + FORGETTING * (share_on - person.typical))
    tracking = Tracking(
        person, cloud, estimate, moved, captured_ns, float(np.clip(adapted, LEAST_SHARE, MOST_SHARE)), familiar, bad
    )
    return tracking, replace(_outcome(setup, estimate, cloud, best), body=body)


def _learn(setup: Setup, person: Person, rays: Singles, pose: Posed) -> tuple[Person, Bdp | None]:
    """A new posture teaches something of the body; the body when it was changed by that."""
    if not is_new(person.knowledge, pose):
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


def _estimate(setup: Setup, phase: Tracking, cloud: Cloud, rays: Singles, room: Room, expected: Posed) -> Posed:
    """The heaviest particle; after Gauss-Newton refined once more and held near what was expected."""
    k = int(np.argmax(cloud.weights))
    best = Posed(cloud.positions[k].copy(), cloud.rotations[k].copy(), cloud.values[k].copy())
    if setup.options.method != "hybrid" or setup.options.refinement != "gauss-newton":
        return best
    refine(
        phase.person.model, rays, room, weights_of(setup, KEEP), 2, best.position, best.rotation, best.values,
        expected.position, expected.rotation, expected.values,
    )  # fmt: skip
    return best


def _expected(model: Model, last: Posed, velocity: Floats) -> Posed:
    """The last estimate, moved on by the velocity (6 + d,) of one step."""
    turn = np.empty((3, 3))
    rotation_of(velocity[3:6], turn)
    values = np.clip(last.values + velocity[6:], model.low, model.high)
    return Posed(last.position + velocity[:3], turn @ last.rotation, values)


def _departures(cloud: Cloud, expected: Posed) -> Floats:
    """(n,) squares of how far particles are from what was expected, in standard deviations: what no view shows stays."""
    position: Floats = np.sum((cloud.positions - expected.position) ** 2, axis=1) / APART[0] ** 2
    values: Floats = np.sum((cloud.values - expected.values) ** 2, axis=1) / APART[1] ** 2
    departures: Floats = position + values
    return departures


def _miss(setup: Setup, phase: Tracking) -> tuple[Tracking | Lost, Outcome]:
    """Nobody is seen: the particles wait."""
    bad = phase.bad + 1
    if bad >= 10 * LOST_AFTER:
        return Lost(phase.person, phase.estimate, seen_ns=phase.captured_ns), nothing(setup, lost=True)
    return replace(phase, bad=bad), nothing(setup, lost=True)


def weights_of(setup: Setup, levels: Sequence[float], thin: int = 1) -> Weights:
    """levels: how freely position, orientation and coordinates may leave their target.  thin: one of so many rays."""
    d = coordinates_of(setup.anatomy).dimension
    return Weights(SPREAD_M, LIMIT_M, 1.0 / _levels(d, levels) ** 2, RAYS * thin / setup.options.points)


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


def nothing(setup: Setup, *, lost: bool) -> Outcome:
    return Outcome(None, None, np.zeros(len(setup.anatomy.angles) + 3), 0.0, 0.0, lost, ())
