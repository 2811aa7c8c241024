"""Where viewing lines meet the body: the compiled kernels against a plain oracle, and what must hold of any contact."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.body.anatomy import FOURTEEN_PARTS, Floats
from services.tracker.closest import (
    ASIDE,
    FOUND,
    Singles,
    contact,
    influence,
    misfit,
    nearest_parts,
    points_of,
    rays_of,
)  # fmt: skip
from services.tracker.model import model_of
from services.tracker.scene import Scene
from services.tracker.stature import average_body
from tests.tracker_scenes import frames_of, moved, tangent_rays, touch, upright

MODEL = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
PARTS = len(FOURTEEN_PARTS.parts)
ROUND = tuple(k for k in range(PARTS) if MODEL.radii[k, 0] == MODEL.radii[k, 1] and MODEL.radii[k, 2] == MODEL.radii[k, 3])
seeds = st.integers(0, 10_000)


def missing(seed: int, count: int = 60) -> tuple[Floats, Singles]:
    """The parts' frames of a pose, and rays that touch the body in another nearby."""
    pose = upright(seed=seed)
    rays = tangent_rays(MODEL, moved(pose, np.random.default_rng(seed), 0.03, 0.1), count, seed)
    return frames_of(MODEL, pose), rays


def found_of(frame: Floats, part: int, rays: Singles, i: int) -> Floats:
    found = np.empty(FOUND)
    contact(MODEL, frame, part, rays, i, found)
    return found


@settings(max_examples=20)
@given(seeds)
def test_a_contact_is_where_the_oracle_has_it(seed: int) -> None:
    frames, rays = missing(seed)
    for i in range(rays.shape[1]):
        part = i % PARTS
        found, plain = found_of(frames[part], part, rays, i), touch(MODEL, frames[part], part, rays[:, i].astype(float))
        assert found[0] == pytest.approx(plain.distance, abs=1e-6)
        assert found[1] == pytest.approx(plain.gap, abs=1e-9)
        assert found[2:5] == pytest.approx(plain.point, abs=1e-9)
        assert found[5] == pytest.approx(plain.share, abs=1e-9)
        assert found[6:9] == pytest.approx(plain.shrinks, abs=1e-9)


@settings(max_examples=20)
@given(seeds)
def test_the_nearest_part_is_the_nearest_of_all(seed: int) -> None:
    frames, rays = missing(seed)
    distances, parts = np.empty(rays.shape[1], np.float32), np.empty(rays.shape[1], np.int32)
    nearest_parts(MODEL, frames, rays, distances, parts)
    for i in range(rays.shape[1]):
        every = [touch(MODEL, frames[k], k, rays[:, i].astype(float)).distance for k in range(PARTS)]
        assert distances[i] == pytest.approx(min(every), abs=2e-3)  # a root of single precision
        assert every[parts[i]] == pytest.approx(min(every), abs=2e-3)


@settings(max_examples=20)
@given(seeds)
def test_a_ray_tangent_to_a_round_part_has_no_gap(seed: int) -> None:
    """Tangent by geometry alone: beside the axis by the radius there, square to the axis and to the line from it."""
    rng = np.random.default_rng(seed)
    frames = frames_of(MODEL, upright(seed=seed))
    part = int(rng.choice(ROUND))
    share = rng.uniform(0.0, 1.0)
    radius = MODEL.radii[part, 0] + share * (MODEL.radii[part, 2] - MODEL.radii[part, 0])
    across = frames[part, :, :3] @ np.array([np.cos(seed), 0.0, np.sin(seed)])
    axis = frames[part, :, 1]
    point = (
        frames[part, :, 3] + frames[part, :, :3] @ MODEL.bases[part] + share * MODEL.lengths[part] * axis + radius * across
    )
    angle = rng.uniform(0.5, np.pi - 0.5)
    direction = np.cos(angle) * axis + np.sin(angle) * np.cross(axis, across)
    rays = np.array([*(point - 3.0 * direction), *direction, *across, 2.5, 3.5], dtype=np.float32)[:, None]
    found = found_of(frames[part], part, rays, 0)
    assert found[1] == pytest.approx(0.0, abs=2e-5)
    assert found[0] == pytest.approx(0.0, abs=2e-4)
    assert found[2:5] == pytest.approx(point, abs=2e-5)


@settings(max_examples=20)
@given(seeds)
def test_the_gap_shrinks_as_the_part_moves_by_what_the_contact_says(seed: int) -> None:
    """Finite differences, the contact sliding as it will; between the ends of round parts, where lines cross
    the part squarely: how the radius changes as a slanting line meets it elsewhere is left out."""
    pose = upright(seed=seed)
    frames, rays = frames_of(MODEL, pose), tangent_rays(MODEL, pose, 40, seed, ROUND)
    step = 1e-5
    for i in range(rays.shape[1]):
        part = ROUND[i % len(ROUND)]
        found = found_of(frames[part], part, rays, i)
        if not 0.15 < found[5] < 0.85 or abs(rays[3:6, i] @ frames[part, :, 1]) > 0.5:
            continue
        for k in range(3):
            there, back = frames[part].copy(), frames[part].copy()
            there[k, 3] += step
            back[k, 3] -= step
            slope = (found_of(there, part, rays, i)[1] - found_of(back, part, rays, i)[1]) / (2 * step)
            assert slope == pytest.approx(-found[6 + k], abs=0.06)


def test_a_rays_influence_grows_up_to_the_spread_and_ends_at_the_limit() -> None:
    found = np.zeros(FOUND)
    for distance, gap in ((0.004, -0.003), (0.03, 0.02), (0.1, -0.1), (0.2, 0.1)):
        found[0], found[1] = distance, gap
        beside = (distance**2 - gap**2) / ASIDE**2
        expected = min(1.0, 0.01 / abs(gap)) / 0.01**2 / (1.0 + beside) if distance < 0.15 else 0.0
        assert influence(found, 0.01, 0.15) == pytest.approx(expected)


@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=50), st.floats(0.01, 1.0))
def test_the_misfit_is_the_mean_of_truncated_squares(distances: list[float], limit: float) -> None:
    expected = np.mean(np.minimum(distances, limit) ** 2)
    assert misfit(np.array(distances, np.float32), limit) == pytest.approx(expected, rel=1e-5, abs=1e-12)


def test_nothing_seen_is_no_misfit() -> None:
    assert misfit(np.empty(0, np.float32), 0.15) == 0.0


def test_rays_are_a_scene_row_by_row() -> None:
    rng = np.random.default_rng(0)
    scene = Scene(np.zeros(5, np.int64), *rng.normal(size=(3, 5, 3)), rng.uniform(1, 2, 5), rng.uniform(2, 3, 5))
    rays = rays_of(scene)
    assert rays.shape == (11, 5)
    assert rays.dtype == np.float32
    assert points_of(rays) == pytest.approx(scene.points, abs=1e-6)
