"""Visual hull: scene points lie on the person, and normals point outwards."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Floats, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.hull.contour_rays import DILATION, ContourRays, contour_rays, exclude_views, extract_outlines
from zenocap.services.tracker.hull.ray_intersection import surviving_intervals, viewing_lines
from zenocap.services.tracker.parameters import MIN_INTERVAL_RATIO

RADIUS_M = 0.3
MIDDLE = np.array([0.1, 1.0, -0.05])
LENSES = [None, np.array([-0.25, 0.08, 0.001, -0.002, 0.0])]


def ring(count: int, distortions: Floats | None = None) -> list[Camera]:
    angles = 2 * np.pi * np.arange(count) / count + 0.2
    places = [np.array([4 * np.sin(a), 1.6, 4 * np.cos(a)]) for a in angles]
    return [look(f"cam{k:02d}", place, np.array([0.0, 1.0, 0.0]), 0.0, distortions) for k, place in enumerate(places)]


def ball(camera: Camera, middle: Floats = MIDDLE, radius: float = RADIUS_M) -> Mask:
    """Silhouette of a ball, from the circle where viewing lines touch it."""
    offset = middle - camera.centre
    away = float(np.linalg.norm(offset))
    side = np.cross(offset, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, offset) / away
    angles = np.linspace(0.0, 2 * np.pi, 400, endpoint=False)[:, None]
    reach = radius * np.sqrt(1 - (radius / away) ** 2)
    circle = middle - (radius / away) ** 2 * offset + reach * (np.cos(angles) * side + np.sin(angles) * up)
    fine = np.zeros((8 * camera.size[1], 8 * camera.size[0]), dtype=np.uint8)
    corners = 8 * (camera.project(circle) + 0.5) - 0.5
    cv2.fillPoly(fine, [np.round(16 * corners).astype(np.int32)], 255, shift=4)
    covered = cv2.resize(fine, camera.size, interpolation=cv2.INTER_AREA)
    return np.asarray((covered > 127) * np.uint8(255), dtype=np.uint8)


def rays_of(masks: list[Mask | None], cameras: list[Camera], count: int) -> ContourRays:
    return contour_rays(*extract_outlines(masks, cameras, count))


@pytest.mark.parametrize("lens", LENSES, ids=["pinhole", "bent"])
def test_tangent_point_of_a_ball_is_in_every_interval(lens: Floats | None) -> None:
    cameras = ring(5, lens)
    scene = rays_of([ball(camera) for camera in cameras], cameras, 300)
    assert 290 <= len(scene.view) <= 300
    offset = MIDDLE - scene.origin
    depth = np.sum(offset * scene.direction, axis=1)
    assert np.all(scene.near <= depth)
    assert np.all(depth <= scene.far)
    tangent = scene.origin + depth[:, None] * scene.direction
    assert np.linalg.norm(tangent - MIDDLE, axis=1) == pytest.approx(RADIUS_M, abs=0.004)
    assert np.mean(np.linalg.norm(tangent - MIDDLE, axis=1)) == pytest.approx(RADIUS_M, abs=0.001)
    outwards = (tangent - MIDDLE) / np.linalg.norm(tangent - MIDDLE, axis=1)[:, None]
    assert np.min(np.sum(outwards * scene.normal, axis=1)) > np.cos(np.radians(8))
    assert np.linalg.norm(scene.normal, axis=1) == pytest.approx(1.0)
    assert np.sum(scene.normal * scene.direction, axis=1) == pytest.approx(0.0, abs=0.02)


def dumbbells(camera: Camera) -> Mask:
    """Three separate balls: most lines that touch one miss the others."""
    places = (MIDDLE, MIDDLE + np.array([0.5, 0.1, 0.1]), MIDDLE + np.array([-0.1, 0.0, -0.6]))
    masks = [ball(camera, place, radius) for place, radius in zip(places, (0.2, 0.1, 0.15), strict=True)]
    return np.maximum.reduce(masks)


def spans(masks: list[Mask], cameras: list[Camera], own: int, direction: Floats) -> tuple[float, float] | None:
    """Oracle: interval of the hull on one viewing line, in steps of 1 mm; None without one."""
    depths = np.arange(1.0, 8.0, 0.001)
    places = cameras[own].centre + depths[:, None] * direction
    alive = np.ones(len(depths), dtype=np.bool_)
    for k, (mask, camera) in enumerate(zip(masks, cameras, strict=True)):
        if k == own:
            continue
        u, v = np.floor(camera.project(places) + 0.5).astype(np.int64).T
        seen = (u >= 0) & (v >= 0) & (u < camera.size[0]) & (v < camera.size[1])
        alive &= seen  # the balls are whole in every image
        alive[seen] &= np.asarray(cv2.dilate(mask, DILATION))[v[seen], u[seen]] > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], alive, [False]]).astype(np.int8))).reshape(-1, 2)
    if len(edges) == 0:
        return None
    lengths = edges[:, 1] - edges[:, 0]
    counted = edges[lengths >= MIN_INTERVAL_RATIO * lengths.max()]
    return float(depths[counted[0, 0]]), float(depths[counted[-1, 1] - 1])


@pytest.mark.slow
@pytest.mark.parametrize("lens", LENSES, ids=["pinhole", "bent"])
@pytest.mark.parametrize("views", [2, 4])
def test_intervals_equal_a_dense_search(views: int, lens: Floats | None) -> None:
    cameras = ring(5, lens)[:views]
    masks = [dumbbells(camera) for camera in cameras]
    contours, seen = extract_outlines(masks, cameras, 60)
    directions, _ = viewing_lines(contours.view, contours.points, contours.tangents, seen)
    near, far = np.empty(len(directions)), np.empty(len(directions))
    surviving_intervals(contours.view, directions, seen, near, far)
    agreeing = several = 0
    for own, direction, first, last in zip(contours.view, directions, near, far, strict=True):
        expected = spans(masks, cameras, int(own), direction)
        assert (first <= last) == (expected is not None)
        if expected is not None:
            # Within half a pixel's depth; an interval near the threshold may or may not count.
            agreeing += abs(first - expected[0]) < 0.004 and abs(last - expected[1]) < 0.004
            several += last - first > 0.6
    assert agreeing >= 0.9 * len(directions)
    assert several > 0


@pytest.mark.parametrize("edge", ["left", "right", "top", "bottom"])
def test_image_border_is_neither_contour_nor_evidence(edge: str) -> None:
    """A camera that sees half of the ball gives no points along its border, and removes nothing beyond it."""
    cameras = ring(4)
    shift = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "top": (0.0, -1.0), "bottom": (0.0, 1.0)}[edge]
    matrix = cameras[0].matrix.copy()
    middle = np.array([319.5, 239.5]) * (1 + np.array(shift))
    matrix[:2, 2] += middle - cameras[0].project(MIDDLE[None])[0]
    cameras[0] = replace(cameras[0], matrix=matrix)
    masks = [ball(camera) for camera in cameras]
    contours, _ = extract_outlines(masks, cameras, 400)
    mine = contours.points[contours.view == 0]
    assert len(mine) > 20
    assert np.all((mine > 0) & (mine < np.array(cameras[0].size) - 1))
    away = np.linalg.norm(contours.edges[contours.view == 0] - middle, axis=1)
    assert np.ptp(away) < 6  # on the circle, none on the straight cut
    scene = rays_of(masks, cameras, 400)
    depth = np.sum((MIDDLE - scene.origin) * scene.direction, axis=1)
    assert np.all((scene.near <= depth) & (depth <= scene.far))
    assert len(scene.view) >= 390


def test_excluded_view_gives_no_points_and_no_evidence() -> None:
    cameras = ring(4)
    masks: list[Mask | None] = [ball(camera) for camera in cameras]
    masks[1] = np.full((480, 640), 0, np.uint8)
    masks[1][:40, :40] = 1  # another object in this view, so no interval survives
    contours, seen = extract_outlines(masks, cameras, 300)
    assert len(contour_rays(contours, seen).view) == 0
    scene = contour_rays(*exclude_views(contours, seen, {1}))
    assert set(scene.view.tolist()) == {0, 2, 3}
    assert len(scene.view) == np.count_nonzero(contours.view != 1)


def test_fewer_than_two_views_give_no_points() -> None:
    cameras = ring(3)
    masks: list[Mask | None] = [ball(cameras[0]), None, np.zeros((480, 640), np.uint8)]
    assert len(rays_of(masks, cameras, 300).view) == 0
    assert len(rays_of([None] * 3, cameras, 300).view) == 0
    assert len(rays_of([], [], 300).view) == 0


def test_mask_of_another_size_is_refused() -> None:
    cameras = ring(2)
    with pytest.raises(ValueError, match=r"camera cam01: a mask of \(64, 48\); allowed: \(640, 480\) px"):
        rays_of([ball(cameras[0]), np.zeros((48, 64), np.uint8)], cameras, 300)
