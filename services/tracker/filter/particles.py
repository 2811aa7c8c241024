"""Particle filter with refinement: selection, proposals, refinement, weights.  [Hybrid V-A]

Random numbers are arguments: `draw_samples` draws all of them from one generator.
"""

from functools import partial
from typing import Literal, NamedTuple, get_args

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.common.jit import kernel
from zenocap.common.rig.tracker import DEFAULT_FILTER, FilterOptions
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, misfit
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.closest_points import Correspondence, modulated_misfit
from zenocap.services.tracker.filter.force import refine_by_force
from zenocap.services.tracker.filter.force_printed import refine_as_printed
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.prior.sampling import CompiledPrior, assign, propose
from zenocap.services.tracker.threads import in_threads

NO_PRIOR = CompiledPrior(np.zeros((1, 1)), np.zeros((1, 1, 1)), np.ones((1, 1)), np.ones((1, 1)))
DYNAMIC, PRIOR = 0, 1
Refinement = Literal["gauss-newton", "force", "force-printed"]
REFINEMENTS: tuple[Refinement, ...] = get_args(Refinement)


class Cloud(NamedTuple):
    """n particles: positions (n, 3), rotations (n, 3, 3), values (n, d), regions (n,), weights (n,) that sum to 1."""

    positions: Floats
    rotations: Floats
    values: Floats
    regions: Ints
    weights: Floats


class RefinementScene(NamedTuple):
    """Data that poses are refined against."""

    model: BodyModel
    evidence: Evidence
    weights: Weights


class Samples(NamedTuple):
    """Random numbers of one step.  chosen: (n,) source of each particle.  kinds: (n,) DYNAMIC or PRIOR.

    noise: (n, 6 + d) standard normal.  uniforms: (n,) in [0, 1).  normals: (n, m) standard normal, in the subspace.
    """

    chosen: Ints
    kinds: Ints
    noise: Floats
    uniforms: Floats
    normals: Floats


def draw_samples(cloud: Cloud, prior_fraction: float, subspace: int, rng: np.random.Generator) -> Samples:
    """Systematic resampling by weight, and the random numbers of all proposals; a fraction of them comes from the prior.

    The first particle is the heaviest one, propagated without noise.
    """
    n, d = cloud.values.shape
    # Paper (replaced): V-A step 2 draws independently; systematic resampling has less variance.
    # Paper (replaced): V-A draws every particle from the prior; here a fraction, the others by dynamics.
    steps = (np.arange(n) + rng.uniform()) / n
    chosen = np.minimum(np.searchsorted(np.cumsum(cloud.weights), steps), n - 1).astype(np.int64)
    kinds = np.where(rng.permutation(n) < round(prior_fraction * n), PRIOR, DYNAMIC).astype(np.int64)
    noise = rng.standard_normal((n, 6 + d))
    # Paper (added): the first particle is the heaviest one without noise, in both presets.
    chosen[0], kinds[0], noise[0] = int(np.argmax(cloud.weights)), DYNAMIC, 0.0
    return Samples(chosen, kinds, noise, np.asarray(rng.uniform(size=n)), rng.standard_normal((n, subspace)))


def uniform_cloud(positions: Floats, rotations: Floats, values: Floats) -> Cloud:
    """Particles of equal weight."""
    n = len(positions)
    return Cloud(positions, rotations, values, np.zeros(n, dtype=np.int64), np.full(n, 1.0 / n))


def resized_cloud(cloud: Cloud, n: int) -> Cloud:
    """The cloud with n particles of equal weight: each in proportion to its weight, the heaviest one first."""
    chosen = np.searchsorted(np.cumsum(cloud.weights), (np.arange(n) + 0.5) / n).clip(max=len(cloud.weights) - 1)
    chosen[0] = int(np.argmax(cloud.weights))
    resized = uniform_cloud(cloud.positions[chosen], cloud.rotations[chosen], cloud.values[chosen])
    return resized._replace(regions=cloud.regions[chosen])


def likelihood_weights(errors: Floats, information: float) -> Floats:
    """(n,) weights exp(-D / sigma^2) that sum to 1, from errors D in m^2; information: 1 / sigma^2.  [Hybrid Eq. 29]"""
    weights = np.exp(-(errors - errors.min()) * information)
    result: Floats = weights / weights.sum()
    return result


@kernel
def propose_particles(
    model: BodyModel, prior: CompiledPrior, has_prior: bool, cloud: Cloud, draws: Samples,
    velocity: Floats, deviations: Floats, out: Cloud,
) -> None:  # fmt: skip
    """Sample every particle's pose and region from the selected one; out's poses and regions are overwritten.

    velocity: (6 + d,) predicted change of the pose.  deviations: (6 + d,) of the dynamic proposals.  Both metres, radians.
    [Hybrid Eq. 20-28]
    """
    n, d = cloud.values.shape
    vector, turn = np.empty(3), np.empty((3, 3))
    for k in range(n):
        source = draws.chosen[k]
        position, rotation, values = out.positions[k], out.rotations[k], out.values[k]
        for i in range(3):
            position[i] = cloud.positions[source, i] + velocity[i] + deviations[i] * draws.noise[k, i]
            vector[i] = velocity[3 + i] + deviations[3 + i] * draws.noise[k, 3 + i]
        vector_to_matrix(vector, turn)
        for i in range(3):
            for j in range(3):
                total = 0.0
                for m in range(3):
                    total += turn[i, m] * cloud.rotations[source, m, j]
                rotation[i, j] = total
        # Paper (corrected): V-A draws the root from the prior of a kind of motion; here it is predicted separately.
        region = cloud.regions[source]
        # Paper (corrected): the prior is of the joint angles alone; the root is proposed separately.
        if draws.kinds[k] == PRIOR and has_prior:
            region = propose(prior, region, cloud.values[source], draws.uniforms[k], draws.normals[k], values)
        else:
            for i in range(d):
                values[i] = cloud.values[source, i] + velocity[6 + i] + deviations[6 + i] * draws.noise[k, 6 + i]
        for i in range(d):
            values[i] = min(max(values[i], model.low[i]), model.high[i])
        out.regions[k] = region


def refine_particles(
    scene: RefinementScene, refinement: Refinement, iterations: int, cloud: Cloud, errors: Floats,
    options: FilterOptions = DEFAULT_FILTER,
) -> None:  # fmt: skip
    """Refine every particle in place and write its error D (n,) in m^2; 0 iterations: errors alone.  [Hybrid Eq. 30]

    Particles are independent of one another, so threads share them without an effect on the result.
    """
    many, by = len(errors), Correspondence(options.association == "closest", options.ends == "flat")
    if iterations > 0 and refinement == "force":
        in_threads(many, partial(_refine_by_force, *scene, iterations, cloud))
    if iterations > 0 and refinement == "force-printed":
        linear = options.force_law == "linear"
        in_threads(many, partial(_refine_as_printed, *scene, linear, by, iterations, cloud))
    steps = iterations if refinement == "gauss-newton" else 0
    if options.distance == "contact" or steps > 0:
        in_threads(many, partial(_refine_and_score, *scene, steps, cloud, errors))
    if options.distance == "modulated":
        in_threads(many, partial(_score_modulated, *scene, by, cloud, errors))


@kernel
def _pose_of(cloud: Cloud, k: int) -> RootedPose:
    return RootedPose(cloud.positions[k], cloud.rotations[k], cloud.values[k])


@kernel
def _copy(pose: RootedPose) -> RootedPose:
    return RootedPose(pose.position.copy(), pose.rotation.copy(), pose.values.copy())


@kernel
def _refine_and_score(
    model: BodyModel, evidence: Evidence, weights: Weights, iterations: int,
    cloud: Cloud, errors: Floats, first: int, end: int,
) -> None:  # fmt: skip
    for k in range(first, end):
        pose = _pose_of(cloud, k)
        if iterations > 0:
            refine(model, evidence, weights, iterations, pose, _copy(pose))
        errors[k] = misfit(model, evidence, weights.limit, pose)


@kernel
def _refine_by_force(
    model: BodyModel, evidence: Evidence, weights: Weights, iterations: int, cloud: Cloud, first: int, end: int
) -> None:
    for k in range(first, end):
        pose = _pose_of(cloud, k)
        refine_by_force(model, evidence.rays, weights, iterations, pose, _copy(pose))


@kernel
def _refine_as_printed(
    model: BodyModel, evidence: Evidence, weights: Weights, linear: bool, by: Correspondence, iterations: int,
    cloud: Cloud, first: int, end: int,
) -> None:  # fmt: skip
    for k in range(first, end):
        refine_as_printed(model, evidence.rays, weights, linear, by, iterations, _pose_of(cloud, k))


@kernel
def _score_modulated(
    model: BodyModel, evidence: Evidence, weights: Weights, by: Correspondence,
    cloud: Cloud, errors: Floats, first: int, end: int,
) -> None:  # fmt: skip
    for k in range(first, end):
        errors[k] = modulated_misfit(model, evidence, weights.limit, by, _pose_of(cloud, k))


@kernel
def assign_regions(prior: CompiledPrior, cloud: Cloud) -> None:
    """Write the region of every particle's pose.  [Hybrid Eq. 8]"""
    # Paper (corrected): the state is that from before refinement, although refinement moves poses to other regions.
    for k in range(cloud.values.shape[0]):
        cloud.regions[k] = assign(prior, cloud.values[k])
