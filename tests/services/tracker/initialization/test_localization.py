"""Column around a person, and the rays that cross it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.tracker_ring import ring, shown, simulated_person, t_pose_at
from tests.support.tracker_scenes import NO_RAYS
from zenocap.common.arrays import Floats32
from zenocap.services.tracker.hull.contour_rays import FAR, NEAR, midpoints
from zenocap.services.tracker.initialization.localization import (
    Column,
    detect_t_pose,
    find_column,
    rays_in_column,
    reliability,
)

CAMERAS = ring(4)


def rays_at(x: float, z: float) -> Floats32:
    return shown(CAMERAS, 1, t_pose_at(1, x, z)).rays


@pytest.mark.nightly
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.7, -0.4)])
def test_column_is_where_most_layers_are_occupied(place: tuple[float, float]) -> None:
    column = find_column(rays_at(*place))
    assert np.linalg.norm(column.centre - place) < 0.1
    assert column.top - column.low == pytest.approx(simulated_person(1).height, rel=0.08)


def test_low_clutter_does_not_move_the_column() -> None:
    rays = rays_at(0.0, 0.0)
    rng = np.random.default_rng(0)
    heap = rays[:, rng.integers(0, rays.shape[1], 3 * rays.shape[1])].copy()
    heap[:3] = (np.array([1.5, 0.1, 1.0])[:, None] + rng.uniform(-0.3, 0.3, (3, heap.shape[1]))).astype(np.float32)
    heap[NEAR : FAR + 1] = 0.0
    assert np.linalg.norm(find_column(np.concatenate([rays, heap], axis=1)).centre) < 0.1


def test_few_rays_give_no_column() -> None:
    assert find_column(rays_at(0.0, 0.0)[:, :20]) is None
    assert find_column(NO_RAYS) is None


def test_object_that_is_empty_in_the_middle_is_no_t_pose() -> None:
    """Two posts, and something beside them at the height of the arms: nothing is between the posts."""
    posts = [(0.0, y, z) for z in (-0.14, 0.14) for y in np.linspace(0.0, 1.5, 40)]
    rays = np.zeros((11, 92), np.float32)
    rays[:3] = np.transpose([*posts, *[(0.0, 1.2, z) for z in (-0.45, 0.45)] * 6])
    assert detect_t_pose(rays) == "no T-pose: hold both arms out sideways, at the height of the shoulders"


def test_long_interval_is_less_reliable() -> None:
    rays = np.zeros((11, 2), np.float32)
    rays[FAR] = 0.0, 1.0
    near, far = reliability(rays)
    assert near == 1.0
    assert 0.0 < far < 0.2


@pytest.mark.nightly
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.2, 2.0))
def test_clipped_intervals_are_inside_the_column(x: float, z: float, radius: float) -> None:
    rays = rays_at(0.0, 0.0)
    column = Column(np.array([x, z]), 0.0, 1.8)
    kept = rays_in_column(rays, column, radius)
    assert kept.shape[1] <= rays.shape[1]
    middle = midpoints(kept)
    assert np.all(np.linalg.norm(middle[:, [0, 2]] - [x, z], axis=1) <= radius + 1e-3)
    assert np.all((kept[NEAR] <= kept[FAR]) & (middle[:, 1] > -0.2) & (middle[:, 1] < 2.0))


def test_wide_column_keeps_all_rays() -> None:
    rays = rays_at(0.0, 0.0)
    np.testing.assert_allclose(rays_in_column(rays, Column(np.zeros(2), -5.0, 5.0), 50.0), rays, atol=1e-5)
