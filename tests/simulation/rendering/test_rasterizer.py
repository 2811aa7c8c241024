"""The triangle filler against OpenCV and simple cases, and the sensor's noise."""

import cv2
import numpy as np
import pytest
from numpy.typing import ArrayLike

from zenocap.simulation.rendering.rasterizer import composite, downsample, fill_triangles, sensor_image

CORNERS = [[0.0, 0.0], [15.0, 0.0], [0.0, 15.0]]


def draw(pixels: ArrayLike, depth: ArrayLike, bgr: ArrayLike, size: int = 16) -> tuple[np.ndarray, np.ndarray]:
    nearness = np.zeros((size, size), dtype=np.float32)
    colour = np.zeros((size, size, 3), dtype=np.float32)
    triangles = np.arange(len(pixels), dtype=np.int32).reshape(-1, 3)
    points, far, paint = (np.array(values, dtype=np.float32) for values in (pixels, depth, bgr))
    fill_triangles(points, far, paint, triangles, nearness, colour)
    return nearness, colour


@pytest.mark.slow
def test_pixel_is_filled_when_its_centre_is_in_the_triangle() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        corners = rng.uniform(-10, 42, (3, 2))
        nearness, _ = draw(corners, [1.0] * 3, [[1.0] * 3] * 3, size=32)
        triangle = corners.astype(np.float32)
        inside = [[cv2.pointPolygonTest(triangle, (float(x), float(y)), True) for x in range(32)] for y in range(32)]
        assert np.all((nearness > 0)[np.array(inside) > 1e-3])
        assert not np.any((nearness > 0)[np.array(inside) < -1e-3])


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_nearer_triangle_hides_the_other_in_any_order(order: tuple[int, int]) -> None:
    depth = np.repeat([(2.0, 3.0)[k] for k in order], 3)
    grey = np.repeat([(10.0, 200.0)[k] for k in order], 3)
    nearness, colour = draw(CORNERS * 2, depth, np.tile(grey[:, None], 3))
    assert colour[3, 3, 0] == 10.0
    assert nearness[3, 3] == pytest.approx(0.5)


def test_a_triangle_behind_the_camera_is_left_out() -> None:
    nearness, _ = draw(CORNERS, [1.0, 0.0, 1.0], [[1.0] * 3] * 3)
    assert not nearness.any()


def test_average_gives_coverage_and_premultiplied_colour() -> None:
    nearness = np.zeros((4, 4), dtype=np.float32)
    nearness[:2, :1] = 1.0
    colour = np.full((4, 4, 3), 80.0, dtype=np.float32)
    layer = np.empty((2, 2, 4), dtype=np.float32)
    downsample(nearness, colour, 2, layer)
    assert layer[0, 0].tolist() == [40.0, 40.0, 40.0, 0.5]
    assert not layer[1:].any()
    scene = np.full((2, 2, 3), 100.0, dtype=np.float32)
    composite(scene, layer, 0, 0)
    assert scene[0, 0].tolist() == [90.0] * 3
    assert scene[1, 1].tolist() == [100.0] * 3


def test_noise_is_unbiased_with_given_strength_and_depends_on_the_key() -> None:
    scene = np.full((200, 200, 3), 128.0, dtype=np.float32)
    frames = [np.empty(scene.shape, dtype=np.uint8) for _ in range(3)]
    for frame, key in zip(frames, (1, 1, 2), strict=True):
        sensor_image(scene, 1.0, 2.5, key, frame)
    assert np.array_equal(frames[0], frames[1])
    noise = frames[0].astype(float) - 128.0
    assert abs(noise.mean()) < 0.05
    assert noise.std() == pytest.approx(2.5, rel=0.06)
    other = frames[2].astype(float) - 128.0
    assert abs(np.corrcoef(noise.ravel(), other.ravel())[0, 1]) < 0.02
    assert abs(np.corrcoef(noise[:, 1:].ravel(), noise[:, :-1].ravel())[0, 1]) < 0.02
    assert abs(np.corrcoef(noise[..., 0].ravel(), noise[..., 1].ravel())[0, 1]) < 0.02
