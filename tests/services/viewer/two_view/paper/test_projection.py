"""The scaled orthographic projection of the paper.  [Two-view 3.2, 4.2]"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.two_view_scene import MODEL, NAVEL, directions, model_mask, rows
from zenocap.common.arrays import Floats
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.paper.projection import depth_of_scale, orthographic, point_at, shift


def image_of(camera: Floats, point: Floats) -> Floats:
    local = camera[:3] @ point + camera[3]
    image: Floats = camera[4, 0] * local[:2] / local[2] + camera[4, 1:]
    return image


@given(st.floats(-1, 1), st.floats(0, 2), st.floats(-1, 1), st.floats(2, 9))
def test_image_of_a_point_at_the_depth_is_that_of_the_camera(x: float, y: float, z: float, depth: float) -> None:
    camera = rows(0)
    point = point_at(camera, x / 5, (y - 1) / 5, depth)
    np.testing.assert_allclose(image_of(orthographic(camera, depth), point), image_of(camera, point), atol=1e-6)


def test_nearer_points_are_not_larger() -> None:
    camera, depth = rows(0), 5.2
    near, far = (np.array([0.5, 1.0, z]) for z in (0.8, -0.8))
    flat = orthographic(camera, depth)
    np.testing.assert_allclose(image_of(flat, near), image_of(flat, far), atol=0.05)
    assert np.linalg.norm(image_of(camera, near) - image_of(camera, far)) > 1


def test_scaling_factor_gives_the_depth() -> None:
    camera = rows(0)
    at_origin = float(camera[3, 2])
    assert depth_of_scale(camera, 1.0) == pytest.approx(at_origin)
    assert depth_of_scale(camera, 1.25) == pytest.approx(at_origin / 1.25)


def test_point_on_a_ray_has_its_slopes_and_depth() -> None:
    camera = rows(1)
    local = camera[:3] @ point_at(camera, 0.1, -0.2, 4.0) + camera[3]
    np.testing.assert_allclose(local, [0.4, -0.8, 4.0], atol=1e-12)


@pytest.mark.parametrize(("right_px", "down_px"), [(0, 0), (5, 0), (-2, 2), (1, -5)])
def test_shift_finds_a_body_displaced_by_one_of_the_shifts(right_px: int, down_px: int) -> None:
    camera = rows(0)
    fit = BodyFit(MODEL, camera, model_mask(camera, directions()))
    fit.place(NAVEL, np.eye(3), directions())
    step = fit.metres_per_pixel()
    start = NAVEL - step * (right_px * camera[0] + down_px * camera[1])
    found = shift(fit, start, np.eye(3), directions())
    np.testing.assert_allclose(found.position, NAVEL, atol=1e-9)
    assert found.score == pytest.approx(1.0)
