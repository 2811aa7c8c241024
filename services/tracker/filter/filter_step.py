"""One step of the filter: proposals, refinement, weights, estimate, body shape.  [Hybrid V-A]"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, model_of, pose_difference
from zenocap.services.tracker.evidence.evidence import Evidence, support_fraction, thinned
from zenocap.services.tracker.evidence.field import no_distance_field
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.filter.limb_search import UsualSupport, search_limbs
from zenocap.services.tracker.filter.particles import (
    NO_PRIOR,
    Cloud,
    RefinementScene,
    assign_regions,
    draw_samples,
    likelihood_weights,
    propose_particles,
    refine_particles,
    resized_cloud,
    uniform_cloud,
)
from zenocap.services.tracker.initialization.online_shape import improved_body, is_new_posture, updated_shape
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.prior.resampling import at_rate
from zenocap.services.tracker.prior.sampling import prior_distances
from zenocap.services.tracker.states import HEADING_KINDS, Lost, Outcome, TrackedPerson, TrackerSetup, Tracking, refuted


def start_tracking(
    setup: TrackerSetup, person: TrackedPerson, pose: RootedPose, captured_ns: int, error: float
) -> tuple[Tracking, Outcome]:
    """Particles at a pose, from which tracking starts.  error: D of the pose, m^2."""
    n = setup.options.particles
    cloud = uniform_cloud(np.tile(pose.position, (n, 1)), np.tile(pose.rotation, (n, 1, 1)), np.tile(pose.values, (n, 1)))
    still = np.zeros(6 + len(pose.values))
    rivals = refuted(*HEADING_KINDS) if person.heading_known else ()
    tracking = Tracking(person, cloud, pose, still, captured_ns, p.PRIOR_FRACTION, corrected_ns=captured_ns, rivals=rivals)
    return tracking, _outcome(setup, pose, cloud, error)


def filter_step(
    setup: TrackerSetup, phase: Tracking, captured_ns: int, evidence: Evidence, rng: np.random.Generator
) -> tuple[Tracking | Lost, Outcome]:
    """Track the person in one scene; the track is lost after LOST_FRAMES misfits in a row."""
    if evidence.rays.shape[1] < p.MIN_TRACKING_RAYS:
        return _empty_frame(setup, phase)
    options, person = setup.options, phase.person
    if len(phase.cloud.weights) != options.particles:
        phase = replace(phase, cloud=resized_cloud(phase.cloud, options.particles))
    if not options.filter.cost_terms:
        evidence = evidence._replace(field=no_distance_field())
    periods = max(1.0, (captured_ns - phase.captured_ns) / setup.frame_ns)
    velocity = _velocity(setup, phase, periods)
    found = _find_particles(setup, phase, periods, velocity, evidence, rng)
    expected = _predict(person.model, phase.estimate, velocity)
    prior_distance, costs = _costs(setup, phase, found, expected)
    # Paper (open): sigma^2 of Eq. 29 has no value; 1 / LIKELIHOOD_INFORMATION.
    cloud = found.cloud._replace(weights=likelihood_weights(costs, p.LIKELIHOOD_INFORMATION))
    estimate = _estimate(setup, phase, cloud, evidence, expected)
    best = int(np.argmin(costs))
    error = float(found.errors[best])
    support = support_fraction(person.model, evidence, estimate)
    unlike = error > p.LOST_MISFIT_RATIO * p.RESIDUAL_LIMIT_M**2
    misfits = support < p.LOST_SUPPORT_RATIO * person.expected_support or unlike
    misfits_in_row = phase.misfits_in_row + 1 if misfits else 0
    # Paper (added): [Hybrid] does not detect a lost track.
    if misfits_in_row >= p.LOST_FRAMES and options.filter.relocalization:
        return Lost(person, phase.estimate, seen_ns=phase.captured_ns), no_pose(setup, lost=True)
    moved, jumped = _motion(setup, phase, estimate, captured_ns)
    corrected_ns = captured_ns if jumped else phase.corrected_ns
    body = None
    settled = captured_ns - corrected_ns >= p.SHAPE_PAUSE_NS
    if options.filter.shape_estimation and settled and support >= p.SHAPE_SUPPORT_RATIO * person.expected_support:
        person, body = _update_shape(setup, person, evidence.rays, estimate)
    if not misfits_in_row:
        expected_support = person.expected_support + p.SUPPORT_RATE * (support - person.expected_support)
        person = replace(person, expected_support=expected_support)
    from_prior = float(cloud.weights[found.kinds == 1].sum())
    prior_fraction = phase.prior_fraction + p.PRIOR_FRACTION_RATE * (from_prior - phase.prior_fraction)
    tracking = replace(
        phase, person=person, cloud=cloud, estimate=estimate, velocity=moved, captured_ns=captured_ns,
        prior_fraction=float(np.clip(prior_fraction, p.MIN_PRIOR_FRACTION, p.MAX_PRIOR_FRACTION)),
        prior_distance=phase.prior_distance + p.SUPPORT_RATE * (float(prior_distance[best]) - phase.prior_distance),
        misfits_in_row=misfits_in_row, limb_support=found.limb_support, corrected_ns=corrected_ns,
    )  # fmt: skip
    return tracking, replace(_outcome(setup, estimate, cloud, error), body=body)


class _Found(NamedTuple):
    """Refined particles, not weighted yet.  errors: (n,) D, m^2.  kinds: (n,) of `Samples`."""

    cloud: Cloud
    errors: Floats
    kinds: Ints
    limb_support: Floats | None


def _velocity(setup: TrackerSetup, phase: Tracking, periods: float) -> Floats:
    """(6 + d,) predicted change of the pose since the last frame, `periods` frame periods ago."""
    # Paper (added): V-A does not predict by the velocity.
    if not setup.options.filter.velocity_prediction:
        return np.zeros(len(phase.velocity))
    velocity: Floats = p.VELOCITY_DAMPING * phase.velocity * setup.frame_ns / 1e9 * periods
    if _searches_limbs(setup):
        velocity[3:6] = p.TURN_DAMPING * phase.velocity[3:6] * setup.frame_ns / 1e9 * min(periods, 1.0 / p.TURN_RATE)
    return velocity


def _prior(setup: TrackerSetup) -> Prior | None:
    """The prior that the method uses, at the rig's frame rate."""
    return None if setup.prior is None or setup.options.method != "hybrid" else at_rate(setup.prior, 1e9 / setup.frame_ns)


def _find_particles(
    setup: TrackerSetup, phase: Tracking, periods: float, velocity: Floats, evidence: Evidence, rng: np.random.Generator
) -> _Found:
    """Propose particles, refine them on the scene, and search a limb that has lost its rays."""
    options, person, prior = setup.options, phase.person, _prior(setup)
    compiled = NO_PRIOR if prior is None else prior.compiled
    subspace = 1 if prior is None else prior.dimensions
    share = options.filter.prior_share
    prior_fraction = 0.0 if prior is None else phase.prior_fraction if share == "adaptive" else share
    draws = draw_samples(phase.cloud, prior_fraction, subspace, rng)
    n, d = phase.cloud.values.shape
    out = Cloud(np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, d)), np.zeros(n, np.int64), np.empty(n))
    errors = np.empty(n)
    iterations = 0 if options.method == "particle-filter" else options.iterations
    deviations = _per_coordinate(d, p.DYNAMIC_NOISE) * np.sqrt(periods)
    propose_particles(person.model, compiled, prior is not None, phase.cloud, draws, velocity, deviations, out)
    # Paper (added): particles are refined on every second ray, to save time.
    weights = residual_weights(setup, p.PARTICLE_HOLD, p.PARTICLE_RAY_STRIDE)
    scene = RefinementScene(person.model, thinned(evidence, p.PARTICLE_RAY_STRIDE), weights)
    refine_particles(scene, options.refinement, iterations, out, errors, options.filter)
    limb_support = phase.limb_support
    if _searches_limbs(setup):
        usual = UsualSupport(limb_support, person.expected_support, phase.misfits_in_row > 0)
        limb_support = search_limbs(setup.anatomy, scene, iterations, usual, out, errors, rng)
    if prior is not None and iterations > 0:
        assign_regions(compiled, out)
    return _Found(out, errors, draws.kinds, limb_support)


def _searches_limbs(setup: TrackerSetup) -> bool:
    """The baselines have one way to find a pose."""
    return setup.options.filter.limb_search and setup.options.method == "hybrid"


def _costs(setup: TrackerSetup, phase: Tracking, found: _Found, expected: RootedPose) -> tuple[Floats, Floats]:
    """(n,) distances of the particles from the prior, radians, and their costs, m^2."""
    prior, distances = _prior(setup), np.zeros(len(found.errors))
    if prior is not None:
        prior_distances(prior.compiled, found.cloud.values, distances)
    if not setup.options.filter.cost_terms:
        return distances, found.errors
    # Paper (added): Eq. 29 has D alone; here also the distances from the prediction and from the prior.
    scale = max(phase.prior_distance, 0.0 if prior is None else prior.training.distances[1], p.MIN_PRIOR_DISTANCE)
    departures = _squared_mahalanobis(found.cloud, expected) + (distances / scale) ** 2
    return distances, found.errors + departures / (2.0 * p.LIKELIHOOD_INFORMATION)


def _motion(setup: TrackerSetup, phase: Tracking, estimate: RootedPose, captured_ns: int) -> tuple[Floats, bool]:
    """(6 + d,) velocity of the pose per second, and whether a part jumped: a corrected limb has not moved.

    The root's turn is a running mean: it goes on where views show it and the mirrored one with equal silhouettes.
    """
    moved = pose_difference(phase.estimate, estimate) * 1e9 / max(captured_ns - phase.captured_ns, 1)
    if not _searches_limbs(setup):
        return moved, False
    too_fast = np.abs(moved) > np.concatenate([np.full(3, p.MAX_SPEED), np.full(len(moved) - 3, p.MAX_TURN_RATE)])
    moved[3:6] = phase.velocity[3:6] + p.TURN_RATE * (moved[3:6] - phase.velocity[3:6])
    return np.where(too_fast, 0.0, moved), bool(too_fast.any())


def _update_shape(
    setup: TrackerSetup, person: TrackedPerson, rays: Floats32, pose: RootedPose
) -> tuple[TrackedPerson, Bdp | None]:
    """Person with the shape estimate updated by a new posture; and the body when it changed."""
    if not is_new_posture(person.shape, pose):
        return person, None
    shape = updated_shape(setup.anatomy, person.shape, rays, pose, person.detail * p.POSTURE_INDEPENDENT_RAYS)
    better = improved_body(setup.anatomy, shape)
    if better is None:
        return replace(person, shape=shape), None
    shape, body = better
    return replace(person, body=body, model=model_of(setup.anatomy, body), shape=shape), body


def _estimate(setup: TrackerSetup, phase: Tracking, cloud: Cloud, evidence: Evidence, expected: RootedPose) -> RootedPose:
    """Pose of the heaviest particle; with Gauss-Newton refined on all rays and held near the prediction."""
    # Paper (open): how the pose of a frame follows from the particles; the heaviest, an approximation of the MAP.
    k = int(np.argmax(cloud.weights))
    best = RootedPose(cloud.positions[k].copy(), cloud.rotations[k].copy(), cloud.values[k].copy())
    if setup.options.method != "hybrid" or setup.options.refinement != "gauss-newton":
        return best
    weights = residual_weights(setup, p.ESTIMATE_HOLD)
    refine(phase.person.model, evidence, weights, p.ESTIMATE_ITERATIONS, best, expected)
    return best


def _predict(model: BodyModel, last: RootedPose, velocity: Floats) -> RootedPose:
    """Last estimate moved by the velocity (6 + d,) of one step."""
    turn = np.empty((3, 3))
    vector_to_matrix(velocity[3:6], turn)
    values = np.clip(last.values + velocity[6:], model.low, model.high)
    return RootedPose(last.position + velocity[:3], turn @ last.rotation, values)


def _squared_mahalanobis(cloud: Cloud, expected: RootedPose) -> Floats:
    """(n,) squared Mahalanobis distance of particles from the prediction: unobserved coordinates stay there."""
    position: Floats = np.sum((cloud.positions - expected.position) ** 2, axis=1) / p.PREDICTION_DEVIATION[0] ** 2
    values: Floats = np.sum((cloud.values - expected.values) ** 2, axis=1) / p.PREDICTION_DEVIATION[1] ** 2
    departures: Floats = position + values
    return departures


def _empty_frame(setup: TrackerSetup, phase: Tracking) -> tuple[Tracking | Lost, Outcome]:
    """Keep the particles through a frame without a person; the track is lost after LOST_EMPTY_FRAMES."""
    misfits_in_row = phase.misfits_in_row + 1
    if misfits_in_row >= p.LOST_EMPTY_FRAMES and setup.options.filter.relocalization:
        return Lost(phase.person, phase.estimate, seen_ns=phase.captured_ns), no_pose(setup, lost=True)
    return replace(phase, misfits_in_row=misfits_in_row), no_pose(setup, lost=True)


def residual_weights(setup: TrackerSetup, levels: Sequence[float], thin: int = 1) -> Weights:
    """Weights of residuals for the options.

    levels: standard deviations of position (m), orientation and coordinates (rad) about the target.  thin: step between
    the rays used.
    """
    d = coordinates_of(setup.anatomy).dimension
    precision, ray_weight = 1.0 / _per_coordinate(d, levels) ** 2, p.INDEPENDENT_RAYS * thin / setup.options.points
    return Weights(p.RESIDUAL_SCALE_M, p.RESIDUAL_LIMIT_M, precision, ray_weight)


def _per_coordinate(d: int, levels: Sequence[float]) -> Floats:
    """(6 + d,) vector of one value for the position, one for the orientation, one for all coordinates."""
    return np.repeat(levels, [3, 3, d])


def _outcome(setup: TrackerSetup, pose: RootedPose, cloud: Cloud, error: float) -> Outcome:
    likelihood, effective = float(np.exp(-error * p.LIKELIHOOD_INFORMATION)), float(1.0 / np.sum(cloud.weights**2))
    return Outcome(None, pose.pose(setup.anatomy), _spread(setup.anatomy, cloud), likelihood, effective, False, ())


def _spread(anatomy: Anatomy, cloud: Cloud) -> Floats:
    """Standard deviations of the joint angles, rad, then position, m; a ball joint's about each of its part's own axes."""
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
    """Weighted standard deviation of every column."""
    mean = weights @ values
    deviation: Floats = np.sqrt(np.maximum(weights @ (values - mean) ** 2, 0.0))
    return deviation


def no_pose(setup: TrackerSetup, *, lost: bool) -> Outcome:
    """Result of a frame set without a pose."""
    return Outcome(None, None, np.zeros(len(setup.anatomy.angles) + 3), 0.0, 0.0, lost, ())
