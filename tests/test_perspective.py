"""Position and perspective scaling factors.  [Two-view Eq. 3, Eq. 4]"""

from math import sqrt

import numpy as np
import pytest
from actor_cameras import look, paper_cameras
from hypothesis import assume, given
from hypothesis import strategies as st

from common.camera.level import level_view
from common.camera.pinhole import Camera
from services.integrator.perspective import Ray, ground_position, meeting_depths, scaling_factor

ONE, TWO = paper_cameras()
FOCAL, ZC1, XC2 = 600.0, 5.2, -5.2
PLACES = st.tuples(st.floats(-2, 2), st.floats(0.3, 1.5), st.floats(-2, 2)).map(np.array)


def ray_to(camera: Camera, point: np.ndarray) -> Ray:
    x, y, depth = camera.rotation @ point + camera.translation
    return Ray(camera, float(x / depth), float(y / depth))


@given(PLACES)
def test_equation_3_gives_the_place_back(place: np.ndarray) -> None:
    x1, z2 = ray_to(ONE, place).x * FOCAL, ray_to(TWO, place).x * FOCAL
    np.testing.assert_allclose(ground_position(x1, z2, FOCAL, FOCAL, ZC1, XC2), place[[0, 2]], atol=1e-9)


@given(st.floats(-200, 200), st.floats(-200, 200), st.floats(300, 900), st.floats(300, 900))
def test_the_general_form_is_the_papers_corrected_one(x1: float, z2: float, focal1: float, focal2: float) -> None:
    rays = Ray(ONE, x1 / focal1, 0.0), Ray(TWO, z2 / focal2, 0.0)
    expected = ground_position(x1, z2, focal1, focal2, ZC1, XC2)
    for ray, depth in zip(rays, meeting_depths(*rays), strict=True):
        np.testing.assert_allclose(ray.at_depth(depth)[[0, 2]], expected, atol=1e-9)


@given(st.floats(-200, 200), st.floats(-200, 200))
def test_the_corrected_form_is_the_printed_one_off_the_axes(x1: float, z2: float) -> None:
    assume(abs(x1) > 1e-3 and abs(z2) > 1e-3)
    printed = (
        (ZC1 * FOCAL + z2 * XC2) / (FOCAL * FOCAL / x1 + z2),
        (x1 * ZC1 - XC2 * FOCAL) / (FOCAL * FOCAL / z2 + x1),
    )
    np.testing.assert_allclose(ground_position(x1, z2, FOCAL, FOCAL, ZC1, XC2), printed, rtol=1e-9)


@pytest.mark.parametrize(("x1", "z2"), [(0.0, 0.0), (0.0, 80.0), (80.0, 0.0)])
def test_a_person_on_an_axis_is_no_special_case(x1: float, z2: float) -> None:
    x, z = ground_position(x1, z2, FOCAL, FOCAL, ZC1, XC2)
    assert (x == 0) == (x1 == 0)
    assert (z == 0) == (z2 == 0)


@given(PLACES, st.floats(0.5, 2.6), st.floats(-1, 1), st.floats(0.4, 3.0))
def test_any_two_level_cameras_meet_in_the_place(place: np.ndarray, turn: float, start: float, height: float) -> None:
    cameras = [
        level_view(look("a", np.array([5 * np.sin(t), height, 5 * np.cos(t)]), np.array([0, height, 0]))).camera
        for t in (start, start + turn)
    ]
    rays = [ray_to(camera, place) for camera in cameras]
    a, b = (ray.heading() / np.linalg.norm(ray.heading()) for ray in rays)
    assume(abs(a[0] * b[1] - a[1] * b[0]) > 0.15)
    for ray, depth in zip(rays, meeting_depths(rays[0], rays[1]), strict=True):
        np.testing.assert_allclose(ray.at_depth(depth), place, atol=1e-6)


def test_parallel_rays_do_not_meet() -> None:
    other = look("cam03", np.array([1.0, 1.0, 5.2]), np.array([1.0, 1.0, 0.0]))
    with pytest.raises(ValueError, match="rays of cam01 and cam03 are nearly parallel"):
        meeting_depths(Ray(ONE, 0.0, 0.0), Ray(other, 0.0, 0.0))


def test_rays_that_meet_behind_a_camera_are_refused() -> None:
    with pytest.raises(ValueError, match="rays of cam01 and cam02 meet behind a camera"):
        meeting_depths(Ray(ONE, -3.0, 0.0), Ray(TWO, 1.0, 0.0))


@given(PLACES)
def test_equation_4_is_the_ratio_of_depths(place: np.ndarray) -> None:
    assert scaling_factor(ONE, place) == pytest.approx(ZC1 / (ZC1 - place[2]))
    assert scaling_factor(TWO, place) == pytest.approx(-XC2 / (place[0] - XC2))
    assert scaling_factor(ONE, np.zeros(3)) == pytest.approx(1.0)


@given(PLACES)
def test_a_vertical_stick_is_scaled_by_it(place: np.ndarray) -> None:
    stick = np.array([[0.0, 0.2, 0.0], [0.0, 1.5, 0.0]])
    for camera in (ONE, TWO):
        here, there = (
            np.ptp(camera.project(stick + offset * np.array([1, 0, 1]))[:, 1]) for offset in (np.zeros(3), place)
        )
        assert there / here == pytest.approx(scaling_factor(camera, place))


@given(PLACES)
def test_equation_4_as_printed_where_the_start_lies_on_both_axes(place: np.ndarray) -> None:
    x1 = ray_to(ONE, place).x * FOCAL
    printed = ZC1 * sqrt(FOCAL**2 + x1**2) / (FOCAL * sqrt((ZC1 - place[2]) ** 2 + place[0] ** 2))
    assert scaling_factor(ONE, place) == pytest.approx(printed)
