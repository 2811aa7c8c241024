"""The particle filter's steps: selection, sampling, weighting; and that chance is an argument."""

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from prior_cases import known_prior

from common.body.anatomy import FOURTEEN_PARTS, Floats
from common.body.rotation_vectors import rotation_of
from services.tracker.closest import Singles
from services.tracker.linkage import ROOT
from services.tracker.model import model_of
from services.tracker.particles import (
    DYNAMIC,
    NO_TABLES,
    PRIOR,
    Cloud,
    Draws,
    advance,
    draw,
    everywhere,
    weighted,
)  # fmt: skip
from services.tracker.posed import Posed
from services.tracker.prior.sampling import assign, propose
from services.tracker.refine import Weights, misfit_of, refine
from services.tracker.refinements import FORCE, GAUSS_NEWTON
from services.tracker.room import no_room
from services.tracker.stature import average_body
from tests.tracker_scenes import moved, tangent_rays, turn, upright

MODEL = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
D = len(MODEL.low)
WEIGHTS = Weights(0.01, 0.15, np.full(ROOT + D, 5.0), 0.25)
TRUE = upright(seed=0, spread=0.2)
RAYS = tangent_rays(MODEL, TRUE, 200, 0)
VELOCITY = np.random.default_rng(5).normal(scale=0.02, size=ROOT + D)
DEVIATIONS = np.concatenate([np.full(3, 0.02), np.full(3, 0.05), np.full(D, 0.1)])
PRIOR_TABLES = known_prior().tables
seeds = st.integers(0, 10_000)


def cloud_around(pose: Posed, n: int, seed: int = 0) -> Cloud:
    rng = np.random.default_rng(seed)
    poses = [moved(pose, rng, 0.01, 0.05) for _ in range(n)]
    weights = rng.dirichlet(np.ones(n))
    return Cloud(
        np.array([p.position for p in poses]), np.array([p.rotation for p in poses]), np.array([p.values for p in poses]),
        rng.integers(0, len(PRIOR_TABLES.centres), n), weights,
    )  # fmt: skip


def advanced(
    cloud: Cloud, draws: Draws, iterations: int, *, prior: bool, refinement: int = GAUSS_NEWTON, rays: Singles = RAYS
) -> tuple[Cloud, Floats]:
    n = len(cloud.weights)
    out = Cloud(np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, D)), np.zeros(n, np.int64), np.empty(n))
    errors = np.empty(n)
    advance(
        MODEL, PRIOR_TABLES if prior else NO_TABLES, prior, rays, no_room(), WEIGHTS, refinement, iterations,
        cloud, draws, VELOCITY, DEVIATIONS, out, errors,
    )  # fmt: skip
    return out, errors


def plainly_advanced(cloud: Cloud, draws: Draws, k: int, iterations: int, *, prior: bool) -> tuple[Posed, int, float]:
    """The oracle: one particle, step by step.  [Hybrid V-A]"""
    source = int(draws.chosen[k])
    position = cloud.positions[source] + VELOCITY[:3] + DEVIATIONS[:3] * draws.noise[k, :3]
    rotation = turn(VELOCITY[3:6] + DEVIATIONS[3:6] * draws.noise[k, 3:6]) @ cloud.rotations[source]
    values = cloud.values[source] + VELOCITY[6:] + DEVIATIONS[6:] * draws.noise[k, 6:]
    region = int(cloud.regions[source])
    if prior and draws.kinds[k] == PRIOR:
        region = propose(
            PRIOR_TABLES, region, cloud.values[source], float(draws.uniforms[k]), draws.normals[k], 1.0, values
        )  # fmt: skip
    pose = Posed(position, rotation, np.clip(values, MODEL.low, MODEL.high))
    target = pose.copy()
    if iterations:
        refine(
            MODEL, RAYS, no_room(), WEIGHTS, iterations, pose.position, pose.rotation, pose.values,
            target.position, target.rotation, target.values,
        )  # fmt: skip
        region = assign(PRIOR_TABLES, pose.values) if prior else region
    return pose, region, misfit_of(MODEL, RAYS, no_room(), WEIGHTS.limit, pose.position, pose.rotation, pose.values)


@given(seeds, st.integers(2, 60))
def test_selection_takes_every_particle_as_often_as_its_weight_says(seed: int, n: int) -> None:
    """Systematic: the number of times is the weight's share, rounded up or down; the first is the heaviest."""
    cloud = cloud_around(TRUE, n, seed)
    draws = draw(cloud, 0.5, 3, np.random.default_rng(seed))
    times = np.bincount(draws.chosen[1:], minlength=n)
    assert draws.chosen[0] == np.argmax(cloud.weights)
    assert np.all(times <= np.ceil(n * cloud.weights + 1e-9))
    assert np.all(times >= np.floor(n * cloud.weights - 1e-9) - 1)  # the first one's own place is given away
    assert np.all(np.diff(draws.chosen[1:]) >= 0)


@given(seeds, st.integers(1, 60), st.floats(0.0, 1.0))
def test_the_share_of_the_prior_is_kept_and_the_first_particle_has_no_noise(seed: int, n: int, share: float) -> None:
    draws = draw(cloud_around(TRUE, n, seed), share, 4, np.random.default_rng(seed))
    assert draws.kinds[0] == DYNAMIC
    assert not draws.noise[0].any()
    assert round(share * n) - 1 <= np.sum(draws.kinds == PRIOR) <= round(share * n)
    assert draws.normals.shape == (n, 4)
    assert np.all((draws.uniforms >= 0.0) & (draws.uniforms < 1.0))


@given(st.lists(st.floats(0.0, 0.02), min_size=1, max_size=50), st.floats(1.0, 1e6))
def test_weights_follow_the_likelihood_and_sum_to_one(errors: list[float], contrast: float) -> None:
    """[Hybrid Eq. 29]"""
    weights = weighted(np.array(errors), contrast)
    assert weights.sum() == pytest.approx(1.0)
    assert np.all(weights >= 0.0)
    best = int(np.argmin(errors))
    expected = np.exp(-(np.array(errors) - errors[best]) * contrast)
    assert weights == pytest.approx(expected * weights[best])


def test_a_cloud_everywhere_weighs_the_same() -> None:
    cloud = everywhere(np.zeros((8, 3)), np.tile(np.eye(3), (8, 1, 1)), np.zeros((8, D)))
    assert cloud.weights == pytest.approx(np.full(8, 1 / 8))
    assert not cloud.regions.any()


@pytest.mark.parametrize("prior", [False, True], ids=["dynamics", "prior"])
@pytest.mark.parametrize("iterations", [0, 2])
def test_particles_are_advanced_as_the_plain_steps_do(prior: bool, iterations: int) -> None:
    cloud = cloud_around(TRUE, 12)
    draws = draw(cloud, 0.5, 3, np.random.default_rng(1))
    out, errors = advanced(cloud, draws, iterations, prior=prior)
    for k in range(12):
        pose, region, error = plainly_advanced(cloud, draws, k, iterations, prior=prior)
        assert out.positions[k] == pytest.approx(pose.position, abs=1e-9)
        assert out.rotations[k] == pytest.approx(pose.rotation, abs=1e-9)
        assert out.values[k] == pytest.approx(pose.values, abs=1e-9)
        assert out.regions[k] == region
        assert errors[k] == pytest.approx(error, rel=1e-6)


def test_the_first_particle_goes_on_as_it_moved() -> None:
    cloud = cloud_around(TRUE, 6)
    out, _ = advanced(cloud, draw(cloud, 1.0, 3, np.random.default_rng(2)), 0, prior=True)
    best, rotation = int(np.argmax(cloud.weights)), np.empty((3, 3))
    rotation_of(VELOCITY[3:6], rotation)
    assert out.positions[0] == pytest.approx(cloud.positions[best] + VELOCITY[:3])
    assert out.rotations[0] == pytest.approx(rotation @ cloud.rotations[best])
    assert out.values[0] == pytest.approx(np.clip(cloud.values[best] + VELOCITY[6:], MODEL.low, MODEL.high))


@pytest.mark.parametrize("refinement", [GAUSS_NEWTON, FORCE])
def test_refinement_brings_every_particle_nearer(refinement: int) -> None:
    cloud = cloud_around(TRUE, 8)
    draws = draw(cloud, 0.0, 3, np.random.default_rng(3))
    _, before = advanced(cloud, draws, 0, prior=False)
    _, after = advanced(cloud, draws, 8, prior=False, refinement=refinement)
    assert np.all(after < 0.7 * before)


@pytest.mark.parametrize("refinement", [GAUSS_NEWTON, FORCE])
def test_the_seed_alone_decides_whatever_the_number_of_threads(refinement: int) -> None:
    cloud = cloud_around(TRUE, 10)
    results = []
    threads = numba.get_num_threads()
    try:
        for many in (1, threads, threads):
            numba.set_num_threads(many)
            draws = draw(cloud, 0.5, 3, np.random.default_rng(4))
            results.append(advanced(cloud, draws, 3, prior=True, refinement=refinement))
    finally:
        numba.set_num_threads(threads)
    for out, errors in results[1:]:
        assert np.array_equal(errors, results[0][1])
        assert np.array_equal(out.positions, results[0][0].positions)
        assert np.array_equal(out.rotations, results[0][0].rotations)
        assert np.array_equal(out.values, results[0][0].values)
        assert np.array_equal(out.regions, results[0][0].regions)
    other = draw(cloud, 0.5, 3, np.random.default_rng(5))
    assert not np.array_equal(advanced(cloud, other, 3, prior=True)[1], results[0][1])
