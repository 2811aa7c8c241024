"""The visual hull: scene points lie on the person, and normals point out of it."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.camera.pinhole import Camera
from common.vision.background import Mask
from services.tracker.hull import scene_points
from tests.actor_cameras import look

RADIUS_M = 0.3
MIDDLE = np.array([0.1, 1.0, -0.05])


def ring(count: int, distortions: NDArray[np.float64] | None = None) -> list[Camera]:
    angles = 2 * np.pi * np.arange(count) / count + 0.2
    places = [np.array([4 * np.sin(a), 1.6, 4 * np.cos(a)]) for a in angles]
    return [look(f"cam{k:02d}", place, np.array([0.0, 1.0, 0.0]), 0.0, distortions) for k, place in enumerate(places)]


def ball(camera: Camera, middle: NDArray[np.float64] = MIDDLE, radius: float = RADIUS_M) -> Mask:
    """The silhouette of a ball: what lies within the picture of the circle where viewing lines touch it."""
    offset = middle - camera.centre
    away = float(np.linalg.norm(offset))
    side = np.cross(offset, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, offset) / away
    angles = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)[:, None]
    reach = radius * np.sqrt(1 - (radius / away) ** 2)
    circle = middle - (radius / away) ** 2 * offset + reach * (np.cos(angles) * side + np.sin(angles) * up)
    fine = np.zeros((4 * camera.size[1], 4 * camera.size[0]), dtype=np.uint8)
    corners = 4 * (camera.project(circle) + 0.5) - 0.5
    cv2.fillPoly(fine, [np.round(16 * corners).astype(np.int32)], 255, shift=4)
    covered = cv2.resize(fine, camera.size, interpolation=cv2.INTER_AREA)
    return np.asarray((covered > 127) * np.uint8(255), dtype=np.uint8)


@pytest.mark.parametrize("lens", [None, np.array([-0.25, 0.08, 0.001, -0.002, 0.0])], ids=["pinhole", "bent"])
def test_the_tangent_point_of_a_ball_is_in_every_interval(lens: NDArray[np.float64] | None) -> None:
    cameras = ring(5, lens)
    scene = scene_points([ball(camera) for camera in cameras], cameras, 300)
    assert 290 <= len(scene.view) <= 300
    offset = MIDDLE - scene.origin
    depth = np.sum(offset * scene.direction, axis=1)
    assert np.all(scene.near <= depth)
    assert np.all(depth <= scene.far)
    tangent = scene.origin + depth[:, None] * scene.direction
    assert np.linalg.norm(tangent - MIDDLE, axis=1) == pytest.approx(RADIUS_M, abs=0.006)
    outwards = (tangent - MIDDLE) / np.linalg.norm(tangent - MIDDLE, axis=1)[:, None]
    assert np.min(np.sum(outwards * scene.normal, axis=1)) > np.cos(np.radians(8))
    assert np.linalg.norm(scene.normal, axis=1) == pytest.approx(1.0)
    assert np.sum(scene.normal * scene.direction, axis=1) == pytest.approx(0.0, abs=0.02)


def test_fewer_than_two_views_give_no_points() -> None:
    cameras = ring(3)
    masks: list[Mask | None] = [ball(cameras[0]), None, np.zeros((480, 640), np.uint8)]
    assert len(scene_points(masks, cameras, 300).view) == 0
    assert len(scene_points([None] * 3, cameras, 300).view) == 0
    assert len(scene_points([], [], 300).view) == 0


def test_a_mask_of_another_size_is_refused() -> None:
    cameras = ring(2)
    with pytest.raises(ValueError, match=r"camera cam01: a mask of \(64, 48\); allowed: \(640, 480\) px"):
        scene_points([ball(cameras[0]), np.zeros((48, 64), np.uint8)], cameras, 300)
