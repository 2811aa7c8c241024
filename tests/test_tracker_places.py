"""The column in which somebody stands, and the rays that pass it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracker_ring import initial, ring, scene, seen, someone

from services.tracker.closest import FAR, NEAR, Singles, points_of
from services.tracker.places import Column, column_in, reliability, within

CAMERAS = ring(4)


def rays_at(x: float, z: float) -> Singles:
    rays, _ = scene(CAMERAS, list(seen(CAMERAS, 1, initial(1, x, z)).values()))
    return rays


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.7, -0.4)])
def test_somebody_is_where_most_heights_are_seen(place: tuple[float, float]) -> None:
    column = column_in(rays_at(*place))
    assert column is not None
    assert np.linalg.norm(column.centre - place) < 0.1
    assert column.top - column.low == pytest.approx(someone(1).height, rel=0.08)


def test_a_low_heap_beside_somebody_does_not_move_the_column() -> None:
    rays = rays_at(0.0, 0.0)
    rng = np.random.default_rng(0)
    heap = rays[:, rng.integers(0, rays.shape[1], 3 * rays.shape[1])].copy()
    heap[:3] = (np.array([1.5, 0.1, 1.0])[:, None] + rng.uniform(-0.3, 0.3, (3, heap.shape[1]))).astype(np.float32)
    heap[NEAR : FAR + 1] = 0.0
    column = column_in(np.concatenate([rays, heap], axis=1))
    assert column is not None
    assert np.linalg.norm(column.centre) < 0.1


def test_a_few_rays_are_nobody() -> None:
    assert column_in(rays_at(0.0, 0.0)[:, :20]) is None
    assert column_in(np.empty((11, 0), np.float32)) is None


def test_a_long_interval_is_less_reliable() -> None:
    rays = np.zeros((11, 2), np.float32)
    rays[FAR] = 0.0, 1.0
    near, far = reliability(rays)
    assert near == 1.0
    assert 0.0 < far < 0.2


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.2, 2.0))
def test_what_is_left_of_every_ray_lies_in_the_column(x: float, z: float, radius: float) -> None:
    rays = rays_at(0.0, 0.0)
    column = Column(np.array([x, z]), 0.0, 1.8)
    kept = within(rays, column, radius)
    assert kept.shape[1] <= rays.shape[1]
    middle = points_of(kept)
    assert np.all(np.linalg.norm(middle[:, [0, 2]] - [x, z], axis=1) <= radius + 1e-3)
    assert np.all((kept[NEAR] <= kept[FAR]) & (middle[:, 1] > -0.2) & (middle[:, 1] < 2.0))


def test_a_wide_column_leaves_all_as_it_is() -> None:
    rays = rays_at(0.0, 0.0)
    np.testing.assert_allclose(within(rays, Column(np.zeros(2), -5.0, 5.0), 50.0), rays, atol=1e-5)
