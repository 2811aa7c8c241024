"""Pinhole camera: projection, resizing, attitude, and the most orthogonal pair."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.simulated_cameras import look, paper_cameras
from zenocap.common.camera.pinhole import Camera, angle_between_deg, attitude, most_orthogonal_pair

POINT = st.tuples(st.floats(-1.5, 1.5), st.floats(0.0, 2.0), st.floats(-1.5, 1.5)).map(lambda p: np.array([p]))
TARGET = np.array([0.0, 1.0, 0.0])


def test_the_papers_cameras_have_the_right_orientation() -> None:
    one, two = paper_cameras()
    np.testing.assert_allclose(one.centre, [0.0, 1.0, 5.2], atol=1e-12)
    np.testing.assert_allclose(two.centre, [-5.2, 1.0, 0.0], atol=1e-12)
    middle, up = one.project(np.array([[0.0, 1.0, 0.0], [0.0, 1.5, 0.0]]))
    np.testing.assert_allclose(middle, [319.5, 239.5])
    assert up[1] < middle[1]  # y is down in the image
    assert one.project(np.array([[0.5, 1.0, 0.0]]))[0, 0] > middle[0]  # +X is right in camera 1
    assert two.project(np.array([[0.0, 1.0, 0.5]]))[0, 0] > middle[0]  # +Z is right in camera 2


@given(POINT)
def test_projection_equals_the_matrix_product(point: np.ndarray) -> None:
    camera = paper_cameras()[1]
    ray = camera.matrix @ (camera.rotation @ point[0] + camera.translation)
    np.testing.assert_allclose(camera.project(point)[0], ray[:2] / ray[2])


def test_points_behind_the_camera_have_no_pixel() -> None:
    pixels = paper_cameras()[0].project(np.array([[0.0, 1.0, 6.0], [0.0, 1.0, 0.0]]))
    assert np.isnan(pixels[0]).all()
    assert np.isfinite(pixels[1]).all()


@pytest.mark.nightly
@given(POINT, st.sampled_from([(160, 120), (320, 240), (1280, 960), (640, 240)]))
def test_a_resized_camera_scales_its_image_about_the_corner(point: np.ndarray, size: tuple[int, int]) -> None:
    distorted = look("cam", np.array([1.0, 2.0, 5.0]), TARGET, distortions=np.array([-0.2, 0.05, 0.001, -0.001, 0.0]))
    resized: Camera = distorted.resized(size)
    share = (distorted.project(point) + 0.5) / np.array(distorted.size)  # of the image from its corner at -0.5
    np.testing.assert_allclose((resized.project(point) + 0.5) / np.array(size), share, atol=1e-12)
    assert resized.size == size


FRONT = np.diag([1.0, -1.0, -1.0])  # world to a level camera looking to -Z


def camera_towards(heading_deg: float, tilt_deg: float = 0.0, roll_deg: float = 0.0) -> Camera:
    """A camera that was turned to its heading (from -Z towards +X), then up, then about its own axis."""
    turn = cv2.Rodrigues(np.array([0.0, np.radians(heading_deg), 0.0]))[0]
    tilt = cv2.Rodrigues(np.array([-np.radians(tilt_deg), 0.0, 0.0]))[0]
    roll = cv2.Rodrigues(np.array([0.0, 0.0, np.radians(roll_deg)]))[0]
    rotation = np.asarray(roll @ tilt @ FRONT @ turn)
    return Camera("c", (640, 480), np.diag([600.0, 600.0, 1.0]), np.zeros(4), rotation, np.zeros(3))


@pytest.mark.slow
@given(st.floats(-175, 175), st.floats(-60, 60), st.floats(-60, 60))
def test_attitude_equals_the_rotation_of_the_camera(heading, tilt, roll):
    found = attitude(camera_towards(heading, tilt, roll))
    assert found.heading_deg == pytest.approx(heading, abs=1e-6)
    assert found.tilt_deg == pytest.approx(tilt, abs=1e-6)
    assert abs(found.roll_deg) == pytest.approx(abs(roll), abs=1e-6)
    assert found.roll_deg * roll >= -1e-6


def test_angle_between_headings_is_at_most_180_degrees():
    assert angle_between_deg(camera_towards(-170), camera_towards(170)) == pytest.approx(20)


def test_the_papers_pair_is_found_with_the_front_view_first_and_one_camera_is_an_error():
    found = {"side": camera_towards(90), "oblique": camera_towards(40), "front": camera_towards(0)}
    assert most_orthogonal_pair(found) == ("front", "side")
    with pytest.raises(ValueError, match="two cameras are needed for a pair; there are: front"):
        most_orthogonal_pair({"front": found["front"]})


def test_equally_orthogonal_pairs_are_decided_by_the_front_view():
    ring = {f"cam{k}": camera_towards(k * 360 / 7 - 150) for k in range(7)}
    first, _ = most_orthogonal_pair(ring)
    assert first == min(ring, key=lambda name: abs(attitude(ring[name]).heading_deg))


@given(st.lists(st.floats(-180, 180), min_size=2, max_size=6))
def test_the_chosen_pair_is_the_most_orthogonal_within_a_tolerance(headings):
    cameras = {str(k): camera_towards(heading) for k, heading in enumerate(headings)}
    first, second = most_orthogonal_pair(cameras)
    chosen = abs(90 - angle_between_deg(cameras[first], cameras[second]))
    every = [abs(90 - angle_between_deg(cameras[a], cameras[b])) for a in cameras for b in cameras if a != b]
    assert chosen <= min(every) + 2.0
