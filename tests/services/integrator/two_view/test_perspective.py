"""Position and perspective scaling factors.  [Two-view Eq. 3, Eq. 4]"""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.support.simulated_cameras import look, paper_cameras
from zenocap.common.camera.level_view import level_view
from zenocap.common.camera.pinhole import Camera
from zenocap.services.integrator.two_view.perspective import (
    Ray,
    ground_position,
    intersection_depths,
    position_of,
    scaling_factor,
)

ONE, TWO = paper_cameras()
BESIDE = look("cam03", np.array([1.0, 1.0, 5.2]), np.array([1.0, 1.0, 0.0]))  # looks along the axis of the first

FOCAL, ZC1, XC2 = 600.0, 5.2, -5.2
POSITIONS = st.tuples(st.floats(-2, 2), st.floats(0.3, 1.5), st.floats(-2, 2)).map(np.array)


def ray_to(camera: Camera, point: np.ndarray) -> Ray:
    x, y, depth = camera.rotation @ point + camera.translation
    return Ray(camera, float(x / depth), float(y / depth))


@given(POSITIONS)
def test_equation_3_recovers_the_position(position: np.ndarray) -> None:
    x1, z2 = ray_to(ONE, position).x * FOCAL, ray_to(TWO, position).x * FOCAL
    np.testing.assert_allclose(ground_position(x1, z2, FOCAL, FOCAL, ZC1, XC2), position[[0, 2]], atol=1e-9)


@given(st.floats(-200, 200), st.floats(-200, 200), st.floats(300, 900), st.floats(300, 900))
def test_the_general_form_equals_the_corrected_form_of_the_paper(
    x1: float, z2: float, focal1: float, focal2: float
) -> None:
    rays = Ray(ONE, x1 / focal1, 0.0), Ray(TWO, z2 / focal2, 0.0)
    expected = ground_position(x1, z2, focal1, focal2, ZC1, XC2)
    for ray, depth in zip(rays, intersection_depths(*rays), strict=True):
        np.testing.assert_allclose(ray.at_depth(depth)[[0, 2]], expected, atol=1e-9)


@given(POSITIONS, st.floats(-3.1, 3.1), st.booleans())
def test_position_by_equation_3_is_that_of_any_orthogonal_pair(position: np.ndarray, turn: float, mirrored: bool) -> None:
    sides = (turn, turn - np.pi / 2 if mirrored else turn + np.pi / 2)
    centre = np.array([0.3, 1.0, -0.2])
    cameras = [level_view(look("a", centre + np.array([5 * np.sin(t), 0.0, 5 * np.cos(t)]), centre)).camera for t in sides]
    facade, flank = (ray_to(camera, position) for camera in cameras)
    np.testing.assert_allclose(position_of(facade, flank), position, atol=1e-6)


def test_position_behind_a_camera_is_an_error() -> None:
    ahead = position_of(Ray(ONE, 0.0, 0.0), Ray(TWO, 0.5 * float(TWO.rotation[0, 2]), 0.0))
    assert 0 < ahead[2] < ZC1
    with pytest.raises(ValueError, match="behind a camera"):
        position_of(Ray(ONE, 0.0, 0.0), Ray(TWO, 1.2 * float(TWO.rotation[0, 2]), 0.0))


@pytest.mark.parametrize(("x1", "z2"), [(0.0, 0.0), (0.0, 80.0), (80.0, 0.0)])
def test_a_person_on_an_axis_is_no_special_case(x1: float, z2: float) -> None:
    x, z = ground_position(x1, z2, FOCAL, FOCAL, ZC1, XC2)
    assert (x == 0, z == 0) == (x1 == 0, z2 == 0)


@given(POSITIONS, st.floats(0.5, 2.6), st.floats(-1, 1), st.floats(0.4, 3.0))
def test_rays_of_any_two_level_cameras_intersect_at_the_position(
    position: np.ndarray, turn: float, start: float, height: float
) -> None:
    cameras = [
        level_view(look("a", np.array([5 * np.sin(t), height, 5 * np.cos(t)]), np.array([0, height, 0]))).camera
        for t in (start, start + turn)
    ]
    rays = [ray_to(camera, position) for camera in cameras]
    a, b = (ray.heading() / np.linalg.norm(ray.heading()) for ray in rays)
    assume(abs(a[0] * b[1] - a[1] * b[0]) > 0.15)
    for ray, depth in zip(rays, intersection_depths(rays[0], rays[1]), strict=True):
        np.testing.assert_allclose(ray.at_depth(depth), position, atol=1e-6)


@pytest.mark.parametrize(
    ("first", "second", "text"),
    [
        (Ray(ONE, 0.0, 0.0), Ray(BESIDE, 0.0, 0.0), "rays of cam01 and cam03 are nearly parallel"),
        (Ray(ONE, -3.0, 0.0), Ray(TWO, 1.0, 0.0), "rays of cam01 and cam02 intersect behind a camera"),
    ],
    ids=["parallel", "behind"],
)
def test_rays_without_an_intersection_before_both_cameras_are_refused(first: Ray, second: Ray, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        intersection_depths(first, second)


@given(POSITIONS)
def test_the_image_of_a_vertical_stick_is_scaled_by_the_scaling_factor(position: np.ndarray) -> None:
    stick = np.array([[0.0, 0.2, 0.0], [0.0, 1.5, 0.0]])
    for camera in (ONE, TWO):
        here, there = (
            np.ptp(camera.project(stick + offset * np.array([1, 0, 1]))[:, 1]) for offset in (np.zeros(3), position)
        )
        assert there / here == pytest.approx(scaling_factor(camera, position))
