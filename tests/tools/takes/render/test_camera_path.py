"""Viewpoints and camera paths: the person is in every picture."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.services.animator.parameters import BODY_MARGIN_M
from zenocap.tools.takes.render.camera_path import (
    VIEWS,
    Shot,
    camera_path,
    framing_camera,
    turned_camera,
    undistorted_camera,
)

SIZES = st.sampled_from([(640, 360), (360, 640), (400, 400), (64, 800)])
POINTS = arrays(np.float64, (12, 3), elements=st.floats(-4, 4))


def in_picture(camera: Camera, points: Floats) -> bool:
    pixels = camera.project(points)
    return bool(np.isfinite(pixels).all() and (pixels >= 0).all() and (pixels <= np.array(camera.size) - 1).all())


@pytest.mark.nightly
@pytest.mark.parametrize("view", VIEWS)
@given(points=POINTS, size=SIZES)
@settings(deadline=None, max_examples=40)
def test_all_points_are_in_the_picture_and_the_camera_is_upright(view: str, points: Floats, size: tuple[int, int]) -> None:
    azimuth, elevation = np.radians(VIEWS[view])
    camera = framing_camera(float(azimuth), float(elevation), points, size)
    assert in_picture(camera, points)
    np.testing.assert_allclose(camera.rotation @ camera.rotation.T, np.eye(3), atol=1e-12)
    assert camera.rotation[1, 1] <= 0.0  # down in the image is not up in the world
    assert abs(camera.rotation[0, 1]) < 1e-12  # and the horizon is level


@given(points=POINTS, size=SIZES, turn=st.floats(0, 7))
@settings(deadline=None, max_examples=40)
def test_a_turning_camera_keeps_all_points_in_the_picture(points: Floats, size: tuple[int, int], turn: float) -> None:
    camera = framing_camera(0.6, 0.25, points, size, turned=True)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    assert in_picture(turned_camera(camera, middle, turn), points)


def test_a_front_view_is_from_in_front_and_a_left_one_from_the_persons_left() -> None:
    points = np.array([[-1.0, 0, -1], [1, 2, 1]])
    assert framing_camera(0.0, 0.1, points, (64, 64)).centre[2] > 1.0
    assert framing_camera(np.radians(VIEWS["left"][0]), 0.1, points, (64, 64)).centre[0] > 1.0


def test_turning_the_camera_equals_turning_the_world_the_other_way() -> None:
    camera = framing_camera(0.3, 0.2, np.array([[-1.0, 0, -1], [1, 2, 1]]), (640, 360))
    middle, turn = np.array([0.2, 0.0, -0.1]), 0.7
    c, s = np.cos(turn), np.sin(turn)
    about = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    points = np.random.default_rng(1).uniform(-1, 1, (20, 3))
    np.testing.assert_allclose(
        turned_camera(camera, middle, turn).project(middle + (points - middle) @ about.T), camera.project(points), atol=1e-6
    )


def test_the_view_of_a_rigs_camera_is_scaled_about_the_centre() -> None:
    matrix = np.array([[300.0, 0, 170.0], [0, 300.0, 110.0], [0, 0, 1]])
    camera = Camera("cam01", (320, 240), matrix, np.zeros(5), np.diag([1.0, -1, -1]), np.array([0, 1.0, 4.0]))
    shown = undistorted_camera(camera, (1280, 720))
    corner = camera.project(np.array([[0.4, 1.3, 0.0]]))[0] - (np.array(camera.size) - 1) / 2
    found = shown.project(np.array([[0.4, 1.3, 0.0]]))[0] - (np.array(shown.size) - 1) / 2
    np.testing.assert_allclose(found, 3.0 * corner, atol=1e-6)  # 240 to 720


def walk(count: int = 60) -> tuple[Floats, Floats]:
    """Two joint centres that move 6 m along X, lost for five frames; and their times."""
    way = np.linspace(0, 6, count)
    centres = np.zeros((count, 2, 3))
    centres[:, :, 0] = way[:, None]
    centres[:, 1, 1] = 1.7
    centres[20:25] = np.nan
    return centres, np.arange(count) / 30.0


@pytest.mark.parametrize("shot", [Shot(), Shot("front"), Shot(follows=True), Shot(turning=0.5), Shot("top", True, -1.0)])
def test_the_person_is_in_every_picture_of_every_path(shot: Shot) -> None:
    centres, times_s = walk()
    path = camera_path(centres, times_s, shot, (640, 360), {})
    assert path.moving == (shot.follows or bool(shot.turning))
    for row in range(len(centres)):
        if np.isfinite(centres[row]).all():
            camera, ground, _ = path.at(row)
            assert in_picture(camera, centres[row] + [0, BODY_MARGIN_M, 0])
            assert np.hypot(*(ground.middle - centres[row, 0, [0, 2]])) < ground.radius


def test_the_view_of_a_viewer_has_its_camera_and_an_unknown_one_is_an_error() -> None:
    centres, times_s = walk()
    matrix = np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]])
    camera = Camera("cam01", (320, 240), matrix, np.zeros(5), np.diag([1.0, -1, -1]), np.array([0, 1.0, 9.0]))
    shown, _, sun = camera_path(centres, times_s, Shot("1"), (640, 360), {"1": camera, "2": camera}).at(0)
    np.testing.assert_allclose(shown.centre, camera.centre)
    assert sun[2] > 0  # in front of the person, as the camera is
    for cameras, text in (({}, ""), ({"1": camera, "2": camera}, ", or a viewer: 1, 2")):
        with pytest.raises(ValueError, match=f"view 'behind': allowed: front, left, back, right, quarter, top{text}$"):
            camera_path(centres, times_s, Shot("behind"), (640, 360), cameras)


def test_a_following_camera_is_nearer() -> None:
    centres, times_s = walk()
    shots = Shot("front", follows=False), Shot("front", follows=True)
    far, near = (camera_path(centres, times_s, shot, (640, 360), {}).at(0)[0] for shot in shots)
    assert near.centre[2] < 0.7 * far.centre[2]


def test_a_single_picture_has_a_fixed_camera() -> None:
    centres, times_s = walk()
    assert not camera_path(centres[:1], times_s[:1], Shot(follows=True, turning=1.0), (640, 360), {}).moving
