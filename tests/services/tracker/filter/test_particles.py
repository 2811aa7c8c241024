"""Particle filter: selection, proposals, weights; random numbers as arguments."""

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.prior_cases import known_prior
from tests.support.tracker_scenes import DOF, MODEL, moved, rays_alone, tangent_rays, turn, upright
from zenocap.common.arrays import Floats
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import misfit
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.filter.particles import (  # fmt: skip
    DYNAMIC,
    NO_PRIOR,
    PRIOR,
    Cloud,
    Refinement,
    RefinementScene,
    Samples,
    assign_regions,
    draw_samples,
    propose_particles,
    refine_particles,
    resized_cloud,
    uniform_cloud,
)
from zenocap.services.tracker.prior.sampling import assign, propose

D = len(MODEL.low)
WEIGHTS = Weights(0.01, 0.15, np.full(DOF, 5.0), 0.25)
TRUE = upright(seed=0, spread=0.2)
RAYS = tangent_rays(MODEL, TRUE, 200, 0)
VELOCITY = np.random.default_rng(5).normal(scale=0.02, size=DOF)
DEVIATIONS = np.concatenate([np.full(3, 0.02), np.full(3, 0.05), np.full(D, 0.1)])
PRIOR_TABLES = known_prior().compiled
seeds = st.integers(0, 10_000)


def cloud_around(pose: RootedPose, n: int, seed: int = 0) -> Cloud:
    rng = np.random.default_rng(seed)
    poses = [moved(pose, rng, 0.01, 0.05) for _ in range(n)]
    weights = rng.dirichlet(np.ones(n))
    return Cloud(*map(np.array, zip(*poses, strict=True)), rng.integers(0, len(PRIOR_TABLES.centres), n), weights)


def advanced(
    cloud: Cloud, draws: Samples, iterations: int, *, prior: bool, refinement: Refinement = "gauss-newton"
) -> tuple[Cloud, Floats]:
    n = len(cloud.weights)
    out = Cloud(np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, D)), np.zeros(n, np.int64), np.empty(n))
    errors = np.empty(n)
    propose_particles(MODEL, PRIOR_TABLES if prior else NO_PRIOR, prior, cloud, draws, VELOCITY, DEVIATIONS, out)
    refine_particles(RefinementScene(MODEL, rays_alone(RAYS), WEIGHTS), refinement, iterations, out, errors)
    if prior and iterations:
        assign_regions(PRIOR_TABLES, out)
    return out, errors


def plainly_advanced(
    cloud: Cloud, draws: Samples, k: int, iterations: int, *, prior: bool
) -> tuple[RootedPose, int, float]:
    """Oracle: one particle, step by step.  [Hybrid V-A]"""
    source = int(draws.chosen[k])
    position = cloud.positions[source] + VELOCITY[:3] + DEVIATIONS[:3] * draws.noise[k, :3]
    rotation = turn(VELOCITY[3:6] + DEVIATIONS[3:6] * draws.noise[k, 3:6]) @ cloud.rotations[source]
    values = cloud.values[source] + VELOCITY[6:] + DEVIATIONS[6:] * draws.noise[k, 6:]
    region = int(cloud.regions[source])
    if prior and draws.kinds[k] == PRIOR:
        region = propose(PRIOR_TABLES, region, cloud.values[source], float(draws.uniforms[k]), draws.normals[k], values)
    pose = RootedPose(position, rotation, np.clip(values, MODEL.low, MODEL.high))
    target = pose.copy()
    if iterations:
        refine(MODEL, rays_alone(RAYS), WEIGHTS, iterations, pose, target)
        region = assign(PRIOR_TABLES, pose.values) if prior else region
    return pose, region, misfit(MODEL, rays_alone(RAYS), WEIGHTS.limit, pose)


@given(seeds, st.integers(2, 60))
def test_selection_counts_follow_the_weights(seed: int, n: int) -> None:
    """Systematic: counts are n times the weights, rounded up or down; the first is the heaviest."""
    cloud = cloud_around(TRUE, n, seed)
    draws = draw_samples(cloud, 0.5, 3, np.random.default_rng(seed))
    times = np.bincount(draws.chosen[1:], minlength=n)
    assert draws.chosen[0] == np.argmax(cloud.weights)
    assert np.all(times <= np.ceil(n * cloud.weights + 1e-9))
    assert np.all(times >= np.floor(n * cloud.weights - 1e-9) - 1)  # the first one's own slot goes to another
    assert np.all(np.diff(draws.chosen[1:]) >= 0)


@pytest.mark.slow
@given(seeds, st.integers(1, 60), st.integers(1, 60))
def test_a_resized_cloud_has_each_particle_in_proportion_to_its_weight(seed: int, n: int, resized: int) -> None:
    """The heaviest one is first, whatever the number."""
    cloud = cloud_around(TRUE, n, seed)
    found = resized_cloud(cloud, resized)
    assert found.weights.tolist() == [1.0 / resized] * resized
    np.testing.assert_array_equal(found.values[0], cloud.values[np.argmax(cloud.weights)])
    for k, weight in enumerate(cloud.weights):
        copies = sum(np.array_equal(found.values[i], cloud.values[k]) for i in range(1, resized))
        assert copies <= np.ceil(resized * weight + 1e-9)


@given(seeds, st.integers(1, 60), st.floats(0.0, 1.0))
def test_prior_fraction_is_kept_and_first_particle_has_no_noise(seed: int, n: int, share: float) -> None:
    draws = draw_samples(cloud_around(TRUE, n, seed), share, 4, np.random.default_rng(seed))
    assert draws.kinds[0] == DYNAMIC
    assert not draws.noise[0].any()
    assert round(share * n) - 1 <= np.sum(draws.kinds == PRIOR) <= round(share * n)
    assert draws.normals.shape == (n, 4)
    assert np.all((draws.uniforms >= 0.0) & (draws.uniforms < 1.0))


def test_uniform_cloud_has_equal_weights() -> None:
    cloud = uniform_cloud(np.zeros((8, 3)), np.tile(np.eye(3), (8, 1, 1)), np.zeros((8, D)))
    assert cloud.weights == pytest.approx(np.full(8, 1 / 8))
    assert not cloud.regions.any()


@pytest.mark.parametrize("prior", [False, True], ids=["dynamics", "prior"])
@pytest.mark.parametrize("iterations", [0, 2])
def test_particles_equal_the_plain_oracle(prior: bool, iterations: int) -> None:
    cloud = cloud_around(TRUE, 12)
    draws = draw_samples(cloud, 0.5, 3, np.random.default_rng(1))
    out, errors = advanced(cloud, draws, iterations, prior=prior)
    for k in range(12):
        pose, region, error = plainly_advanced(cloud, draws, k, iterations, prior=prior)
        assert out.positions[k] == pytest.approx(pose.position, abs=1e-9)
        assert out.rotations[k] == pytest.approx(pose.rotation, abs=1e-9)
        assert out.values[k] == pytest.approx(pose.values, abs=1e-9)
        assert out.regions[k] == region
        assert errors[k] == pytest.approx(error, rel=1e-6)


@pytest.mark.parametrize("refinement", ["gauss-newton", "force"])
def test_refinement_reduces_every_error(refinement: Refinement) -> None:
    cloud = cloud_around(TRUE, 8)
    draws = draw_samples(cloud, 0.0, 3, np.random.default_rng(3))
    _, before = advanced(cloud, draws, 0, prior=False)
    _, after = advanced(cloud, draws, 8, prior=False, refinement=refinement)
    assert np.all(after < 0.7 * before)


@pytest.mark.parametrize("refinement", ["gauss-newton", "force"])
def test_result_is_independent_of_the_number_of_threads(refinement: Refinement) -> None:
    cloud = cloud_around(TRUE, 10)
    results = []
    threads = numba.get_num_threads()
    try:
        for many in (1, threads, threads):
            numba.set_num_threads(many)
            draws = draw_samples(cloud, 0.5, 3, np.random.default_rng(4))
            results.append(advanced(cloud, draws, 3, prior=True, refinement=refinement))
    finally:
        numba.set_num_threads(threads)
    for out, errors in results[1:]:
        assert np.array_equal(errors, results[0][1])
        for name in ("positions", "rotations", "values", "regions"):
            assert np.array_equal(getattr(out, name), getattr(results[0][0], name))
    other = draw_samples(cloud, 0.5, 3, np.random.default_rng(5))
    assert not np.array_equal(advanced(cloud, other, 3, prior=True)[1], results[0][1])
