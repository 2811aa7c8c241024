import numpy as np
from actor_cameras import look, paper_cameras
from hypothesis import given
from hypothesis import strategies as st

from common.camera.pinhole import Camera

POINT = st.tuples(st.floats(-1.5, 1.5), st.floats(0.0, 2.0), st.floats(-1.5, 1.5)).map(lambda p: np.array([p]))
TARGET = np.array([0.0, 1.0, 0.0])


def test_the_papers_cameras_see_the_world_the_right_way_round() -> None:
    one, two = paper_cameras()
    np.testing.assert_allclose(one.centre, [0.0, 1.0, 5.2], atol=1e-12)
    np.testing.assert_allclose(two.centre, [-5.2, 1.0, 0.0], atol=1e-12)
    middle, up = one.project(np.array([[0.0, 1.0, 0.0], [0.0, 1.5, 0.0]]))
    np.testing.assert_allclose(middle, [319.5, 239.5])
    assert up[1] < middle[1]  # y is down in the image
    assert one.project(np.array([[0.5, 1.0, 0.0]]))[0, 0] > middle[0]  # +X is right in camera 1
    assert two.project(np.array([[0.0, 1.0, 0.5]]))[0, 0] > middle[0]  # +Z is right in camera 2


@given(POINT)
def test_projection_is_that_of_the_matrices(point: np.ndarray) -> None:
    camera = paper_cameras()[1]
    ray = camera.matrix @ (camera.rotation @ point[0] + camera.translation)
    np.testing.assert_allclose(camera.project(point)[0], ray[:2] / ray[2])


def test_points_behind_the_camera_have_no_pixel() -> None:
    pixels = paper_cameras()[0].project(np.array([[0.0, 1.0, 6.0], [0.0, 1.0, 0.0]]))
    assert np.isnan(pixels[0]).all()
    assert np.isfinite(pixels[1]).all()


@given(POINT, st.sampled_from([(160, 120), (320, 240), (1280, 960), (640, 240)]))
def test_a_resized_camera_scales_its_image_about_the_corner(point: np.ndarray, size: tuple[int, int]) -> None:
    distorted = look("cam", np.array([1.0, 2.0, 5.0]), TARGET, distortions=np.array([-0.2, 0.05, 0.001, -0.001, 0.0]))
    resized: Camera = distorted.resized(size)
    share = (distorted.project(point) + 0.5) / np.array(distorted.size)  # of the image from its corner at -0.5
    np.testing.assert_allclose((resized.project(point) + 0.5) / np.array(size), share, atol=1e-12)
    assert resized.size == size
