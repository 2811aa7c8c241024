"""Papers recomputed: each equation on random cases, each preset against its table of options."""

import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import pairwise, product
from math import dist, exp, hypot
from unittest.mock import patch

import msgspec
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.spatial.distance import cdist
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from tests.support.places import ROOT
from tests.support.prior_cases import COORDINATES, D, known_prior
from tests.support.simulated_cameras import paper_cameras
from tests.support.tracker_scenes import average_model, carried_by, frames_of, moved, tangent_rays, turn, upright
from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.rig.tracker import ITERATIONS, PARTICLES, PRESETS
from zenocap.common.rig.two_view import ADDITIONS, PAPER, additions_of
from zenocap.common.vision.model_image import score_of_counts
from zenocap.services.integrator.two_view.arbitrator import Claim, View, arbitrate
from zenocap.services.integrator.two_view.perspective import Ray, position_of, scaling_factor
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.body.jacobian import ROOT as ROOT_COORDINATES
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.closest_points import (
    CLOSEST_LENGTH,
    Correspondence,
    closest_point,
    mean_modulated_square,
)
from zenocap.services.tracker.filter.force_printed import refine_as_printed
from zenocap.services.tracker.filter.particles import (
    Cloud,
    draw_samples,
    likelihood_weights,
    propose_particles,
    uniform_cloud,
)
from zenocap.services.tracker.hull.contour_rays import midpoints
from zenocap.services.tracker.parameters import (
    FORCE_GAIN,
    FORCE_TRUNCATION_M,
    LINEAR_FORCE_GAIN,
    LINEAR_MOMENT_GAIN,
    MOMENT_GAIN,
    NORMAL_MODULATION,
    PRIOR_CENTRE_WEIGHT,
    PRIOR_CLAMP,
    PRIOR_DEVIATION_FLOOR_DEG,
)
from zenocap.services.tracker.prior import model as prior_model
from zenocap.services.tracker.prior import sampling
from zenocap.services.tracker.prior.forward_backward import Expectation, expectation
from zenocap.services.tracker.prior.learning import reestimate_transitions
from zenocap.services.tracker.prior.regions import PriorRegions, fit_regions
from zenocap.services.tracker.prior.training import TrainingMotion, TrainingPlan, train
from zenocap.services.viewer.parameters import ARM_REGION, LEG_REGION, STOP
from zenocap.services.viewer.two_view import limb_search
from zenocap.services.viewer.two_view.limb_search import BOTH, tri_tree

seeds = st.integers(0, 2**32 - 1)
MODEL = average_model(TEN_PARTS)
PARTS = len(TEN_PARTS.parts)
LIMIT_M = 0.15
FREE = Weights(0.01, LIMIT_M, np.full(ROOT_COORDINATES + len(MODEL.low), 1.0), 0.25)


# [Two-view]


@given(seeds)
def test_equation_1(seed: int) -> None:
    rng = np.random.default_rng(seed)
    silhouette, model = (rng.integers(0, 2, (6, 8), dtype=np.uint8) for _ in range(2))
    both, either = set(pixels(silhouette)) & set(pixels(model)), set(pixels(silhouette)) | set(pixels(model))
    assume(either)
    p = len(set(pixels(silhouette)) - both) / len(either)
    n = len(set(pixels(model)) - both) / len(either)
    expected = exp(-p - n) * (1 - p)
    assert score_of_counts(int(silhouette.sum()), int(model.sum()), len(both)) == pytest.approx(expected)


def pixels(mask: Mask) -> list[tuple[int, int]]:
    return [(row, column) for row, line in enumerate(mask) for column, value in enumerate(line) if value]


Score = Callable[[int], float]


def printed_tri_tree(score: Score, region: int) -> tuple[int, float, int]:
    """Best angle, its score and the number of matchings; degrees.  [Two-view 3.5], left and right as in Fig. 13."""
    known: dict[int, float] = {}
    centre, width = 0, region
    while width > round(np.degrees(STOP)):
        places = [centre, centre - width // 2, centre + width // 2]  # the first of equal scores wins
        for place in places:
            known.setdefault(place, score(place))
        best = max(places, key=known.__getitem__)
        centre += int(np.sign(best - centre)) * width // 4
        width //= 2
    found = max(known, key=known.__getitem__)
    return found, known[found], len(known)


@given(seeds, st.sampled_from([ARM_REGION, LEG_REGION]))
def test_the_tri_tree_is_the_printed_one(seed: int, region: float) -> None:
    scores = np.random.default_rng(seed).permutation(181)

    def score(angle: int) -> float:
        return float(scores[angle + 90])

    assert searched(score, region) == printed_tri_tree(score, round(np.degrees(region)))


def searched(score: Score, region: float) -> tuple[int, float, int]:
    """Result of `tri_tree` over scores by whole degrees."""
    with patch.object(limb_search, "limb_score", lambda _d, _a, _s, angle, _l, _i: score(round(np.degrees(angle)))):
        best, best_score, matchings = tri_tree.py_func(None, None, BOTH, region, None, None)
    return round(np.degrees(best)), best_score, matchings


@pytest.mark.parametrize(("region", "mean", "most"), [(ARM_REGION, 7.0, 9), (LEG_REGION, 17 / 3, 7)])
def test_equation_2(region: float, mean: float, most: int) -> None:
    """Mean and most matchings of the search, over equally probable winners of all stages but the last.

    After an end, the other end has a known, lower score, so that the same end wins again; the matchings are as many.
    """
    counts = []
    for winners in product((-1, 0, 1), repeat=round(np.log2(region / STOP)) - 1):
        scores: dict[int, float] = {}
        centre, width, last = 0, round(np.degrees(region)), 0
        for stage, winner in enumerate(winners, 1):
            last = last if winner == -last else winner
            scores[centre + last * width // 2] = stage
            centre, width = centre + last * width // 4, width // 2
        _, score, matchings = searched(lambda angle, scores=scores: scores.get(angle, 0), region)
        assert score == len(winners)
        counts.append(matchings)
    assert np.mean(counts) == pytest.approx(mean)
    assert max(counts) == most


@given(seeds)
def test_equations_3_and_4(seed: int) -> None:
    """As printed, for cameras on the axes: Eq. 4 with slant distances holds for a start on both axes."""
    rng = np.random.default_rng(seed)
    one, two = paper_cameras()
    person = np.array([rng.uniform(-2, 2), rng.uniform(0.3, 1.5), rng.uniform(-2, 2)])
    zc1, xc2 = float(one.centre[2]), float(two.centre[0])
    slopes = []
    for camera in (one, two):
        x, y, depth = camera.rotation @ person + camera.translation
        slopes.append((float(x / depth), float(y / depth)))
    rays = [Ray(camera, *slope) for camera, slope in zip((one, two), slopes, strict=True)]
    found = position_of(*rays)
    assert found == pytest.approx(person, abs=1e-6)
    focal1, focal2 = float(one.matrix[0, 0]), float(two.matrix[0, 0])
    x1, z2 = focal1 * slopes[0][0], focal2 * slopes[1][0] * float(np.sign(two.rotation[0, 2]))
    assume(min(abs(x1), abs(z2)) > 1e-2)
    printed_x = (zc1 * focal2 + z2 * xc2) / (focal1 * focal2 / x1 + z2)
    printed_z = (x1 * zc1 - xc2 * focal1) / (focal1 * focal2 / z2 + x1)
    assert found[[0, 2]] == pytest.approx([printed_x, printed_z], abs=1e-6)
    r1 = zc1 * hypot(focal1, x1) / (focal1 * hypot(zc1 - person[2], person[0]))
    r2 = -xc2 * hypot(focal2, z2) / (focal2 * hypot(person[0] - xc2, person[2]))
    assert [scaling_factor(camera, person) for camera in (one, two)] == pytest.approx([r1, r2])


def printed_views(before: View, widths: tuple[float, float], low: Floats, high: Floats) -> tuple[View, View]:
    """Views after cases 1 to 4 as printed, viewer 1 first; low, high: thresholds of both viewers.  [Two-view 4.3]"""
    w, (old1, old2) = widths, (before, other_than(before))
    own1, own2 = (decided(old, *rest) for old, *rest in ((old1, w[0], low[0], high[0]), (old2, w[1], low[1], high[1])))
    match (old1, own1), (old2, own2):
        case ("flank", "facade"), ("facade", "facade"):  # (1)
            return ("facade", "flank") if abs(w[0] - high[0]) > abs(w[1] - low[1]) else ("flank", "facade")
        case ("facade", "flank"), ("flank", "flank"):  # (2)
            return ("flank", "facade") if abs(w[0] - low[0]) > abs(w[1] - high[1]) else ("facade", "flank")
        case ("facade", "facade"), ("flank", "facade"):  # (3)
            return ("facade", "flank") if abs(w[0] - low[0]) >= abs(w[1] - high[1]) else ("flank", "facade")
        case ("flank", "flank"), ("facade", "flank"):  # (4)
            return ("flank", "facade") if abs(w[0] - high[0]) >= abs(w[1] - low[1]) else ("facade", "flank")
        case _:  # none changes, or both exchange
            return own1, own2


def decided(before: View, width: float, low: float, high: float) -> View:
    return "flank" if width < low else "facade" if width > high else before  # 3.1


def other_than(view: View) -> View:
    return "flank" if view == "facade" else "facade"


@given(seeds)
def test_the_arbitrator(seed: int) -> None:
    """Whole numbers, so that ties occur."""
    views: tuple[View, View] = ("facade", "flank")
    for case in np.random.default_rng(seed).integers(0, 10, (100, 7)):
        before, numbers = views[case[0] % 2], case[1:].tolist()
        w = float(numbers[0]), float(numbers[1])
        low, high = np.sort(np.array(numbers[2:], dtype=np.float64).reshape(2, 2), axis=0)
        own = [decided(b, *c) for b, *c in zip((before, other_than(before)), w, low, high, strict=True)]
        claims = [Claim(b, *c) for b, *c in zip((before, other_than(before)), own, w, low, high, strict=True)]
        assert arbitrate(*claims) == printed_views(before, w, low, high)


# [Hybrid IV]


def of_all_paths(transitions: Floats, log_densities: Floats) -> Expectation:
    """Every path with its probability, by definition."""
    frames, states = log_densities.shape
    paths = list(product(range(states), repeat=frames))
    logs = np.array([sum(log_densities[t, s] for t, s in enumerate(path)) for path in paths])
    logs += [sum(np.log(transitions[a, b]) for a, b in pairwise(path)) - np.log(states) for path in paths]
    total = logsumexp(logs)
    gamma, xi = np.zeros((frames, states)), np.zeros((states, states))
    for path, share in zip(paths, np.exp(logs - total), strict=True):
        for t, s in enumerate(path):
            gamma[t, s] += share
        for a, b in pairwise(path):
            xi[a, b] += share
    return Expectation(float(total), gamma, xi)


@given(seeds, st.integers(1, 3), st.integers(1, 6), st.sampled_from([3.0, 30.0, 400.0]))
@settings(max_examples=60)
def test_equations_1_to_7_15_and_16_equal_enumeration_of_all_paths(
    seed: int, states: int, frames: int, scale: float
) -> None:
    """Also where every density is far below the least number above zero."""
    rng = np.random.default_rng(seed)
    transitions = rng.dirichlet(np.ones(states), size=states)
    log_densities = rng.normal(scale=scale, size=(frames, states)) - 500.0
    found, expected = expectation(transitions, log_densities), of_all_paths(transitions, log_densities)
    assert found.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-9)
    assert np.allclose(found.gamma, expected.gamma, atol=1e-9)
    assert np.allclose(found.xi, expected.xi, atol=1e-9)


@given(seeds)
def test_equations_11_to_14(seed: int) -> None:
    """With the correction: the least variance.  Two regions have fewer poses than coordinates."""
    rng, floor = np.random.default_rng(seed), np.radians(PRIOR_DEVIATION_FLOOR_DEG) ** 2
    poses = rng.normal(size=(60, D)) * np.geomspace(0.3, 0.01, D) @ np.linalg.qr(rng.normal(size=(D, D)))[0]
    labels = rng.permutation(np.repeat([0, 1, 2], [40, 14, 6]))
    regions, m = fit_regions(poses, labels, 3, 4, np.zeros(60)), TrainingPlan().dims
    assert m == 3
    for region, (centre, vectors) in enumerate(zip(regions.centres, regions.vectors, strict=True)):
        members = [pose for pose, label in zip(poses, labels, strict=True) if label == region]
        assert centre == pytest.approx(sum(members) / len(members))
        costs = [np.sum(((members - r) @ vectors[:, m:]) ** 2) for r in (centre, *(centre + rng.normal(size=(9, D))))]
        assert min(costs) == costs[0]
        sigma = sum(np.outer(pose - centre, pose - centre) for pose in members) / len(members)
        eigenvalues = np.einsum("dj,de,ej->j", vectors, sigma, vectors)
        assert np.allclose(vectors.T @ vectors, np.eye(D))
        assert np.allclose(sigma @ vectors, vectors * eigenvalues, atol=1e-12)
        assert np.all(np.diff(eigenvalues) <= 1e-12)
        assert regions.spectrum[region] == pytest.approx(np.maximum(eigenvalues, floor))
    plan, motions = TrainingPlan(mirror=False, regions=1, candidates=(1,)), [TrainingMotion("any", 60.0, poses)]
    prior, whole = train(COORDINATES, motions, motions, plan), fit_regions(poses, 0 * labels, 1, 4, np.zeros(60))
    assert np.allclose(prior.bases[0], whole.vectors[0, :, :m])
    assert np.allclose(prior.variances[0], whole.spectrum[0, :m])


@given(seeds, st.integers(1, 3), st.lists(st.integers(1, 5), min_size=1, max_size=3))
def test_equation_17(seed: int, states: int, lengths: list[int]) -> None:
    """With the additions: a pseudo-count in each row, and several sequences."""
    rng = np.random.default_rng(seed)
    vectors = np.stack([np.linalg.qr(rng.normal(size=(2, 2)))[0] for _ in range(states)])
    regions = PriorRegions(rng.normal(size=(states, 2)), vectors, rng.uniform(0.3, 2.0, (states, 2)))
    sigmas = [v @ np.diag(spectrum) @ v.T for v, spectrum in zip(vectors, regions.spectrum, strict=True)]
    before = rng.dirichlet(np.ones(states), size=states)
    sequences = [rng.normal(size=(frames, 2)) for frames in lengths]
    likelihood, xi, gamma = 0.0, np.full((states, states), 1 / states), np.ones(states)
    for poses in sequences:
        densities = [multivariate_normal(*one).logpdf(poses) for one in zip(regions.centres, sigmas, strict=True)]
        paths = of_all_paths(before, np.reshape(densities, (states, len(poses))).T)
        likelihood, xi, gamma = likelihood + paths.log_likelihood, xi + paths.xi, gamma + paths.gamma[:-1].sum(axis=0)
    found, log_likelihood = reestimate_transitions(sequences, regions, before)
    assert found == pytest.approx(xi / gamma[:, None])
    assert log_likelihood == pytest.approx(likelihood)


@given(seeds)
@settings(max_examples=30)
def test_equations_8_to_10_18_19_and_24_to_28(seed: int) -> None:
    """With the two corrections: the clamp, and the term of the centre."""
    prior, rng = known_prior(seed % 7), np.random.default_rng(seed)
    pose, normals = rng.normal(scale=0.5, size=D), rng.normal(size=3)
    distances, means = [], []
    for centre, basis, variances in zip(prior.centres, prior.bases, prior.variances, strict=True):
        z = basis.T @ (pose - centre)
        limits = PRIOR_CLAMP * np.sqrt(variances)
        clamped = np.clip(z, -limits, limits)
        reconstructed = centre + basis @ clamped
        distances.append(float(np.sum((pose - reconstructed) ** 2) + PRIOR_CENTRE_WEIGHT * np.sum(z**2)))
        means.append(centre + basis @ np.clip(clamped + np.sqrt(variances) * normals, -limits, limits))
    assert prior_model.distances(prior, pose[None])[0] == pytest.approx(distances)
    assert sampling.assign(prior.compiled, pose) == int(np.argmin(distances))
    uniform, before, drawn = rng.uniform(), int(rng.integers(prior.regions)), np.empty(D)
    after = sampling.propose(prior.compiled, before, pose, uniform, normals, drawn)
    chances = np.cumsum(prior.transitions[before])
    assert after == int(np.flatnonzero(chances > uniform)[0])
    assert drawn == pytest.approx(means[after])


@given(seeds)
@settings(max_examples=5)
def test_equations_20_to_23(seed: int) -> None:
    """Posterior of many particles against the sum over those before, all regions, and quantiles of the samples.

    With the corrections of Eq. 25 and 27, and without the limits of the joints.
    """
    rng, prior, n = np.random.default_rng(seed), known_prior(seed % 7, dims=1, stay=0.5), 20_000
    before, seen = rng.normal(scale=0.3, size=(4, D)), rng.normal(scale=0.3, size=D)
    weights, information = rng.dirichlet(np.ones(4)), 0.5
    cloud = uniform_cloud(np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)), np.repeat(before, n // 4, axis=0))
    cloud = cloud._replace(regions=np.repeat(np.arange(4), n // 4), weights=np.repeat(weights, n // 4) * 4 / n)
    out, still, free = Cloud(*map(np.empty_like, cloud)), np.zeros(6 + D), np.full(D, np.inf)
    model, draws = MODEL._replace(low=-free, high=free), draw_samples(cloud, 1.0, 1, rng)
    propose_particles(model, prior.compiled, True, cloud, draws, still, still, out)
    found = likelihood_weights(np.sum((out.values - seen) ** 2, axis=1), information)
    posterior, mean = np.zeros(4), np.zeros(D)
    for old, new in product(range(4), repeat=2):
        axis, deviation = prior.bases[new][:, 0], np.sqrt(prior.variances[new, 0])
        limit = PRIOR_CLAMP * deviation
        z = np.clip(axis @ (before[old] - prior.centres[new]), -limit, limit)
        z = np.clip(z + deviation * norm.ppf((np.arange(500) + 0.5) / 500), -limit, limit)
        poses = prior.centres[new] + np.outer(z, axis)
        likelihoods = np.exp(-information * np.sum((poses - seen) ** 2, axis=1))
        posterior[new] += weights[old] * prior.transitions[old, new] * likelihoods.sum()
        mean += weights[old] * prior.transitions[old, new] * (likelihoods @ poses)
    assert np.bincount(out.regions, found, 4) == pytest.approx(posterior / posterior.sum(), abs=0.02)
    assert found @ out.values == pytest.approx(mean / posterior.sum(), abs=0.02)


@given(st.lists(st.floats(0, 0.02), min_size=1, max_size=9), st.sampled_from([1.0, 1e4, 1e6]))
def test_equation_29(errors: list[float], information: float) -> None:
    """Also where every density is below the least number above zero."""
    logarithms = -information * np.array(errors)
    assert likelihood_weights(np.array(errors), information) == pytest.approx(np.exp(logarithms - logsumexp(logarithms)))


# [Hybrid V-B]


Closest = tuple[int, float, float, Floats]  # part, |pp'| in metres, cos(n_p, n_p'), p' in the world


def corresponding(frames: Floats, point: Floats, normal: Floats) -> Closest:
    """Nearest part of a scene point.  [Hybrid Eq. 31]"""
    every = [closest_on(frame, part, point, normal) for part, frame in enumerate(frames)]
    return min(every, key=lambda one: one[1])


def closest_on(frame: Floats, part: int, point: Floats, normal: Floats) -> Closest:
    """On an elliptic cylinder with flat ends; a Lagrange multiplier gives the nearest point of an ellipse."""
    x, y, z = place = (frame[:, :3].T @ (point - frame[:, 3]) - MODEL.bases[part]).tolist()
    a, b = MODEL.radii[part, :2].tolist()
    length = float(MODEL.lengths[part] + 0.5 * (a + b) * MODEL.free[part])
    found = brentq(
        lambda t: (a * x / (t + a * a)) ** 2 + (b * z / (t + b * b)) ** 2 - 1, 1e-9 - min(a, b) ** 2, 9, xtol=1e-15
    )
    edge_x, edge_z, end = a * a * x / (found + a * a), b * b * z / (found + b * b), length * (2 * y > length)
    side, cap = (edge_x, min(max(y, 0.0), length), edge_z), (x, end, z)
    if found > 0 and side[1] != y:
        nearest, outwards = side, np.subtract(place, side)
    elif found > 0 or (side[1] == y and dist(side, place) < dist(cap, place)):
        nearest, outwards = side, np.array([edge_x / a**2, 0.0, edge_z / b**2])
    else:
        nearest, outwards = cap, np.array([0.0, end - 0.5 * length, 0.0])
    cosine = normal @ frame[:, :3] @ outwards / np.linalg.norm(outwards)
    return part, dist(nearest, place), float(cosine), frame[:, 3] + frame[:, :3] @ (MODEL.bases[part] + nearest)


def step_of_force(model: BodyModel, pose: RootedPose, scene: Floats, closest: list[Closest], linear: bool) -> RootedPose:
    """One iteration as printed, with the corrected directions.  [Hybrid Eq. 32-41]"""
    frames = frames_of(model, pose)
    forces, moments, numbers = np.zeros((PARTS, 3)), np.zeros((PARTS, 3)), np.zeros(PARTS)
    for point, (part, distance, cosine, on_model) in zip(scene, closest, strict=True):
        if not linear and distance >= LIMIT_M:
            continue
        rho = min(max(cosine, 0.0) * distance, FORCE_TRUNCATION_M) ** (1 if linear else 2)
        force = rho * (point - on_model) / np.linalg.norm(point - on_model)  # Eq. 32
        for carrier in carried_by(model, part):
            forces[carrier] += force  # Eq. 38
            moments[carrier] += np.cross(on_model - frames[carrier, :, 3], force)  # Eq. 33, 39, 40
            numbers[carrier] += 1
    gains = (LINEAR_FORCE_GAIN, LINEAR_MOMENT_GAIN) if linear else (FORCE_GAIN, MOMENT_GAIN)
    many = np.maximum(numbers, 1)[:, None]
    velocity, turns = gains[0] * forces / many, gains[1] * moments / many  # Eq. 34-37
    values = pose.values.copy()
    for part in range(1, PARTS):
        about, first = frames[part, :, :3].T @ turns[part], model.first[part]
        if model.kind[part] == 1:
            values[first] += about[model.axis[part]]
        elif model.kind[part] == 3:
            values[first : first + 3] += about
    rotation = pose.rotation @ turn(pose.rotation.T @ turns[0])
    return RootedPose(pose.position + velocity[0], rotation, np.clip(values, model.low, model.high))  # Eq. 41


PRINTED = Correspondence(PRESETS["paper"].filter.association == "closest", PRESETS["paper"].filter.ends == "flat")


@pytest.mark.slow
@pytest.mark.parametrize("linear", [False, True])
@settings(max_examples=10)
@given(seeds)
def test_equations_30_to_41(linear: bool, seed: int) -> None:
    pose, rng = upright(TEN_PARTS, seed), np.random.default_rng(seed)
    pose = pose._replace(values=np.clip(pose.values, MODEL.low, MODEL.high))
    rays = tangent_rays(MODEL, moved(pose, rng, 0.08, 0.3), 60, seed)
    scene, normals, frames = midpoints(rays), rays[6:9].T.astype(np.float64), frames_of(MODEL, pose)
    closest = [corresponding(frames, *one) for one in zip(scene, normals, strict=True)]
    square = np.mean([min((1 - NORMAL_MODULATION * cosine) * away, LIMIT_M) ** 2 for _, away, cosine, _ in closest])
    assert mean_modulated_square(MODEL, frames, rays, LIMIT_M, PRINTED) == pytest.approx(square, rel=1e-3)  # ELLIPSE_STEPS
    expected = step_of_force(MODEL, pose, scene, closest, linear)
    refine_as_printed(MODEL, rays, FREE, linear, PRINTED, 1, pose)
    for found, wanted in zip(pose, expected, strict=True):
        assert found == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("flat", [False, True], ids=["round", "flat"])
@pytest.mark.parametrize("name", ["torso", "head", "right_upper_arm", "right_lower_leg"])
@given(seed=seeds)
def test_equation_31(name: str, flat: bool, seed: int) -> None:
    """md = 1 - epsilon cos of both normals; p' is on the surface, and |pp'| is the least distance of many points of it.

    An elliptic part with round ends has p' on the line to its axis: |pp'| is too large, at most by the angle of this line
    and the normal outside of the part, by the ratio of the radii within it.
    """
    rng, part, (points, spacing) = np.random.default_rng(seed), TEN_PARTS.index[name], surface(name, flat)
    point = points.mean(axis=0) + 0.5 * np.ptp(points, axis=0) * rng.normal(size=3)
    normal, frame = rng.normal(size=3), FRAMES[part]
    normal /= np.linalg.norm(normal)

    def found(normal: Floats) -> Floats:
        out = np.empty(CLOSEST_LENGTH)
        closest_point(MODEL, frame, part, flat, frame[:, 3] + frame[:, :3] @ point, frame[:, :3] @ normal, out)
        return out

    distance, modulated, cosine, *in_world = found(normal)
    on_model, outwards = frame[:, :3].T @ (in_world - frame[:, 3]), np.array([found(axis)[2] for axis in np.eye(3)])
    away = point - on_model
    assert distance == pytest.approx(np.linalg.norm(away), abs=1e-8)
    assert cosine == pytest.approx(normal @ outwards)
    assert modulated == pytest.approx((1 - NORMAL_MODULATION * cosine) * distance)
    off_surface, nearest = cdist([on_model, point], points).min(axis=1)
    assert off_surface <= spacing
    short, long = sorted(MODEL.radii[part, :2])
    least = 1.0 if flat else 2 * short * long / (short**2 + long**2) if outwards @ away > 0 else short / long
    assert least * distance - 1e-5 <= nearest <= distance + spacing
    if flat and 1e-9 < abs(away[1]) < distance - 1e-9:  # on the rim
        assert distance * outwards == pytest.approx(away, abs=1e-8)
    else:  # the part is on the inner side of the plane through p', which it touches
        assert np.linalg.norm(outwards) == pytest.approx(1.0)
        assert -(spacing**2) * long / short**2 <= np.max((points - on_model) @ outwards) <= 1e-8


@lru_cache(maxsize=1)
def surface(name: str, flat: bool) -> tuple[Floats, float]:
    """Points (n, 3) of a part's surface, in its frame, and how far the surface is from the next one at most; metres."""
    part, steps, turns = TEN_PARTS.index[name], np.linspace(0, 1, 121), np.linspace(0, 2 * np.pi, 241)
    wide, deep = MODEL.radii[part, :2]
    cap, bend = 0.5 * (wide + deep), 0.5 * np.pi * steps
    length = MODEL.lengths[part] + (cap * MODEL.free[part] if flat else 0.0)
    rho, below = (steps, 0 * steps) if flat else (np.sin(bend), cap * np.cos(bend))
    across = np.concatenate([rho, np.ones(len(steps)), rho[::-1]])
    along = np.concatenate([-below, length * steps, length + below[::-1]])
    around = np.stack([wide * np.cos(turns), 0 * turns, deep * np.sin(turns)], axis=1)
    points = across[:, None, None] * around + along[:, None, None] * [0.0, 1.0, 0.0]
    cell = sum(np.linalg.norm(np.diff(points, axis=side), axis=2).max() for side in (0, 1))
    return MODEL.bases[part] + points.reshape(-1, 3), 0.5 * float(cell)


FRAMES = frames_of(MODEL, upright(TEN_PARTS, 1))


# Presets and variants


def options_on_page() -> Mapping[str, Mapping[str, str]]:
    """Values of the options of each preset, as text, from the table of docs/tracker.md."""
    text = (ROOT / "docs" / "tracker.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^\| key \|.*\n\|[-|]+\n((?:\|.*\n)+)", text, re.MULTILINE)
    rows = [[cell.strip(" `") for cell in line.split("|")[1:-1]] for line in table.splitlines()]
    return {preset: {row[0]: row[column] for row in rows} for preset, column in (("default", 2), ("paper", 3))}


@pytest.mark.parametrize("preset", PRESETS)
def test_a_preset_has_the_options_of_the_page(preset: str) -> None:
    options = msgspec.to_builtins(PRESETS[preset].filter)
    assert options_on_page()[preset] == {
        key: str(value).lower() if isinstance(value, bool) else str(value) for key, value in options.items()
    }


def test_the_preset_paper_is_the_printed_method() -> None:
    """[Hybrid II, V]: ten parts, 20 regions, 40 particles, printed forces; 1000 particles of the particle filter."""
    assert PRESETS["paper"].anatomy == TEN_PARTS.name
    assert set(PRESETS["paper"].refinements.values()) == {"force-printed"}
    assert (PARTICLES["hybrid"], PARTICLES["particle-filter"], ITERATIONS["force-printed"]) == (40, 1000, 100)
    assert Correspondence(closest=True, flat=True) == PRINTED
    assert PRESETS["paper"].filter.force_law == "quadratic"


def test_the_variant_paper_has_no_addition_and_the_page_names_each() -> None:
    page = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
    assert additions_of("paper", (), ()) == PAPER == frozenset()
    assert [name for name in ADDITIONS if f"`{name}`" not in page] == []
