"""Contacts of rays with the body: a plain oracle, and properties of every contact."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tracker_scenes import MODEL, PARTS, contact_of, frames_of, moved, tangent_rays, touch, upright
from zenocap.common.arrays import Floats, Floats32
from zenocap.services.tracker.evidence.rays import mean_truncated_square, nearest_of
from zenocap.services.tracker.evidence.residuals import robust_weight
from zenocap.services.tracker.hull.contour_rays import ContourRays, midpoints
from zenocap.services.tracker.parameters import LATERAL_SCALE_M

ROUND = tuple(k for k in range(PARTS) if MODEL.radii[k, 0] == MODEL.radii[k, 1] and MODEL.radii[k, 2] == MODEL.radii[k, 3])
seeds = st.integers(0, 10_000)


def missing(seed: int, count: int = 60) -> tuple[Floats, Floats32]:
    """Part frames of a pose, and rays tangent to the body in a nearby pose."""
    pose = upright(seed=seed)
    rays = tangent_rays(MODEL, moved(pose, np.random.default_rng(seed), 0.03, 0.1), count, seed)
    return frames_of(MODEL, pose), rays


@pytest.mark.nightly
@settings(max_examples=20)
@given(seeds)
def test_contact_equals_the_oracle(seed: int) -> None:
    frames, rays = missing(seed)
    for i in range(rays.shape[1]):
        part = i % PARTS
        found = contact_of(MODEL, frames[part], part, rays, i)
        plain = touch(MODEL, frames[part], part, rays[:, i].astype(float))
        assert found[0] == pytest.approx(plain.distance, abs=1e-6)
        assert found[1] == pytest.approx(plain.gap, abs=1e-9)
        assert found[2:5] == pytest.approx(plain.point, abs=1e-9)
        assert found[5] == pytest.approx(plain.share, abs=1e-9)
        assert found[6:9] == pytest.approx(plain.shrinks, abs=1e-9)


@pytest.mark.nightly
@settings(max_examples=20)
@given(seeds)
def test_nearest_part_has_the_least_distance(seed: int) -> None:
    frames, rays = missing(seed)
    distances, parts = nearest_of(MODEL, frames, rays)
    for i in range(rays.shape[1]):
        every = [touch(MODEL, frames[k], k, rays[:, i].astype(float)).distance for k in range(PARTS)]
        assert distances[i] == pytest.approx(min(every), abs=2e-3)  # a root of single precision
        assert every[parts[i]] == pytest.approx(min(every), abs=2e-3)


@pytest.mark.slow
@settings(max_examples=20)
@given(seeds)
def test_ray_tangent_to_a_round_part_has_no_gap(seed: int) -> None:
    """Tangent by geometry only: at the local radius from the axis, perpendicular to the axis and to the line from it."""
    rng = np.random.default_rng(seed)
    frames = frames_of(MODEL, upright(seed=seed))
    part = int(rng.choice(ROUND))
    share = rng.uniform(0.0, 1.0)
    radius = MODEL.radii[part, 0] + share * (MODEL.radii[part, 2] - MODEL.radii[part, 0])
    across = frames[part, :, :3] @ np.array([np.cos(seed), 0.0, np.sin(seed)])
    axis = frames[part, :, 1]
    base = frames[part, :, 3] + frames[part, :, :3] @ MODEL.bases[part]
    point = base + share * MODEL.lengths[part] * axis + radius * across
    angle = rng.uniform(0.5, np.pi - 0.5)
    direction = np.cos(angle) * axis + np.sin(angle) * np.cross(axis, across)
    rays = np.array([*(point - 3.0 * direction), *direction, *across, 2.5, 3.5], dtype=np.float32)[:, None]
    found = contact_of(MODEL, frames[part], part, rays, 0)
    assert found[1] == pytest.approx(0.0, abs=2e-5)
    assert found[0] == pytest.approx(0.0, abs=2e-4)
    assert found[2:5] == pytest.approx(point, abs=2e-5)


@pytest.mark.nightly
@settings(max_examples=20)
@given(seeds)
def test_gap_derivative_equals_finite_differences(seed: int) -> None:
    """Finite differences with a sliding contact; between the ends of round parts, where lines cross the part at a right
    angle: the change of radius along the contact of a slanting line is neglected."""
    pose = upright(seed=seed)
    frames, rays = frames_of(MODEL, pose), tangent_rays(MODEL, pose, 40, seed, ROUND)
    step = 1e-5
    for i in range(rays.shape[1]):
        part = ROUND[i % len(ROUND)]
        found = contact_of(MODEL, frames[part], part, rays, i)
        if not 0.15 < found[5] < 0.85 or abs(rays[3:6, i] @ frames[part, :, 1]) > 0.5:
            continue
        for k in range(3):
            there, back = frames[part].copy(), frames[part].copy()
            there[k, 3] += step
            back[k, 3] -= step
            slope = (contact_of(MODEL, there, part, rays, i)[1] - contact_of(MODEL, back, part, rays, i)[1]) / (2 * step)
            assert slope == pytest.approx(-found[6 + k], abs=0.06)


def test_gradient_grows_up_to_the_spread_and_ends_at_the_limit() -> None:
    for distance, gap in ((0.004, -0.003), (0.03, 0.02), (0.1, -0.1), (0.2, 0.1)):
        beside = (distance**2 - gap**2) / LATERAL_SCALE_M**2
        expected = min(1.0, 0.01 / abs(gap)) / 0.01**2 / (1.0 + beside) if distance < 0.15 else 0.0
        assert robust_weight(distance, gap, 0.01, 0.15) == pytest.approx(expected)


@given(st.lists(st.floats(0.0, 3.0), max_size=50), st.floats(0.01, 1.0))
def test_misfit_is_the_mean_of_truncated_squares_and_zero_without_rays(distances: list[float], limit: float) -> None:
    expected = np.mean(np.minimum(distances, limit) ** 2) if distances else 0.0
    assert mean_truncated_square(np.array(distances, np.float32), limit) == pytest.approx(expected, rel=1e-5, abs=1e-12)


def test_contour_rays_are_the_scene_row_by_row() -> None:
    rng = np.random.default_rng(0)
    scene = ContourRays(np.zeros(5, np.int64), *rng.normal(size=(3, 5, 3)), rng.uniform(1, 2, 5), rng.uniform(2, 3, 5))
    rays = scene.rows
    assert rays.shape == (11, 5)
    assert rays.dtype == np.float32
    assert midpoints(rays) == pytest.approx(scene.points, abs=1e-6)
