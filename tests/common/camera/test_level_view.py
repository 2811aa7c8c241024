"""The level view: the image of a camera without tilt, roll and lens distortion."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.simulated_cameras import look, paper_cameras
from zenocap.common.arrays import Floats, Image
from zenocap.common.camera.level_view import LevelView, level_view
from zenocap.common.camera.pinhole import Camera

LENS = np.array([-0.15, 0.04, 0.001, -0.001, 0.0])
TARGET = np.array([0.0, 0.9, 0.0])

CAMERAS = st.builds(
    lambda turn, height, roll, lens: look(
        "cam", np.array([5.0 * np.sin(turn), height, 5.0 * np.cos(turn)]), TARGET, roll, LENS if lens else None
    ).resized((320, 240)),
    st.floats(-3.1, 3.1),
    st.floats(0.3, 3.0),
    st.floats(-0.3, 0.3),
    st.booleans(),
)


def drawn(camera: Camera, line: Floats) -> Image:
    """The mask of a polyline in the world, about 5 px thick."""
    mask = np.zeros(camera.size[::-1], np.uint8)
    cv2.polylines(mask, [np.round(camera.project(line)).astype(np.int32)], False, 1, 5)
    return mask


@pytest.mark.parametrize("viewer", [0, 1])
def test_images_of_a_level_camera_are_unchanged(viewer: int) -> None:
    camera = paper_cameras()[viewer]
    view = level_view(camera)
    image = np.arange(480 * 640, dtype=np.uint8).reshape(480, 640)
    assert view.camera is camera
    assert view.maps is None
    assert view.warp(image) is image


@given(CAMERAS)
@settings(deadline=None, max_examples=10)
def test_the_level_camera_is_upright_at_the_same_position(camera: Camera) -> None:
    level = level_view(camera).camera
    np.testing.assert_allclose(level.centre, camera.centre, atol=1e-9)
    np.testing.assert_allclose(level.rotation[1], [0, -1, 0], atol=1e-3)
    np.testing.assert_allclose(level.rotation @ level.rotation.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(level.rotation) > 0
    assert level.rotation[2] @ camera.rotation[2] > 0
    assert not np.any(level.distortions)


@pytest.mark.nightly
@given(CAMERAS, st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
@settings(deadline=None, max_examples=10)
def test_a_vertical_line_of_the_world_is_one_column(camera: Camera, x: float, z: float) -> None:
    view = level_view(camera)
    line = np.column_stack([np.full(40, x), np.linspace(0.3, 1.6, 40), np.full(40, z)])
    columns = view.camera.project(line)[:, 0]
    assert np.ptp(columns) < 1e-3 * 640
    rows, xs = np.nonzero(view.warp(drawn(camera, line)))
    middle = [xs[rows == row].mean() for row in np.unique(rows)[6:-6]]
    assert np.max(np.abs(middle - columns[0])) < 1.5


@pytest.mark.nightly
@given(
    CAMERAS, st.lists(st.tuples(st.floats(-0.8, 0.8), st.floats(0.0, 1.8), st.floats(-0.8, 0.8)), min_size=1, max_size=5)
)
@settings(deadline=None, max_examples=10)
def test_level_camera_and_maps_agree_with_the_real_camera(camera: Camera, points: list[tuple[float, float, float]]) -> None:
    view = level_view(camera)
    world = np.array(points)
    real = camera.project(world)
    for level_px, real_px in zip(view.camera.project(world), real, strict=True):
        through = _through_the_maps(view, level_px)
        seen = np.all((real_px >= 0) & (real_px <= np.array(camera.size) - 1))
        if through is not None and seen:
            np.testing.assert_allclose(through, real_px, atol=1.0)


def _through_the_maps(view: LevelView, pixel: Floats) -> Floats | None:
    x, y = np.round(pixel).astype(int)
    width, height = view.camera.size
    if not (0 < x < width - 1 and 0 < y < height - 1):
        return None
    if view.maps is None:
        return pixel
    map_x, map_y = view.maps
    ax, ay = pixel - (x, y)
    step_x = np.array([map_x[y, x + 1] - map_x[y, x - 1], map_y[y, x + 1] - map_y[y, x - 1]]) / 2
    step_y = np.array([map_x[y + 1, x] - map_x[y - 1, x], map_y[y + 1, x] - map_y[y - 1, x]]) / 2
    result: Floats = np.array([map_x[y, x], map_y[y, x]]) + ax * step_x + ay * step_y
    return result


@pytest.mark.nightly
def test_the_level_view_keeps_the_visible_part_of_the_capture_volume() -> None:
    camera = look("cam", np.array([2.0, 2.2, 4.5]), TARGET, roll=0.1)
    view = level_view(camera)
    corners = np.array([[x, y, z] for x in (-0.4, 0.4) for y in (0.1, 1.7) for z in (-0.4, 0.4)])
    pixels = view.camera.project(corners)
    assert np.all((pixels >= 0) & (pixels < np.array(view.camera.size)))
    assert all(_through_the_maps(view, pixel) is not None for pixel in pixels)


@pytest.mark.slow
def test_pixels_outside_of_the_real_image_are_zero() -> None:
    camera = look("cam", np.array([0.0, 2.5, 4.5]), TARGET, roll=0.3)
    warped = level_view(camera).warp(np.ones((480, 640), np.uint8))
    assert set(np.unique(warped)) == {0, 1}


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_straight_up_or_down_has_no_level_view(way: float) -> None:
    camera = look("ceiling", np.array([0.0, 3.0, 0.0]), np.array([0.1, 3.0 + 2 * way, 0.0]))
    with pytest.raises(ValueError, match="camera ceiling: points within 10 degrees of straight up or down"):
        level_view(camera)
