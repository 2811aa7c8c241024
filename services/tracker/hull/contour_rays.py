"""Contour rays: viewing lines cut to the visual hull, and scene points on them.  [Hybrid III]"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.hull.contours import Contours, sample_contours
from zenocap.services.tracker.hull.ray_intersection import surviving_intervals, viewing_lines
from zenocap.services.tracker.hull.views import Silhouettes, lenses_and_bounds
from zenocap.services.tracker.threads import in_threads

ORIGIN, DIRECTION, NEAR, FAR = 0, 3, 9, 10  # rows of rays; 6 to 8: the normal


@dataclass(frozen=True)
class ContourRays:
    """Contour rays and their intervals within the other silhouettes.  Y-up world, metres.

    view: (n,) camera index.  origin: (n, 3) its centre.  direction: (n, 3) unit viewing line, away from it.
    normal: (n, 3) unit, out of the person: viewing line x contour tangent.
    near, far: (n,) ends of the surviving interval, as distances along the viewing line.  Rays without support from another
    view are left out.
    """

    view: Ints
    origin: Floats
    direction: Floats
    normal: Floats
    near: Floats
    far: Floats

    @property
    def points(self) -> Floats:
        """(n, 3) scene points: midpoints of the surviving intervals."""
        middle: Floats = self.origin + (0.5 * (self.near + self.far))[:, None] * self.direction
        return middle

    @property
    def rows(self) -> Floats32:
        """(11, n) for compiled functions, row by row: origin, direction, normal, near, far."""
        rows = np.concatenate([self.origin.T, self.direction.T, self.normal.T, self.near[None], self.far[None]])
        return np.ascontiguousarray(rows, dtype=np.float32)


# Paper (replaced): [Hybrid III] cites exact polyhedral hulls; here rays of sampled contours, cut to the silhouettes.
DILATION = np.ones((3, 3), np.uint8)  # odd: an even kernel shifts the mask by a pixel


def contour_rays(contours: Contours, silhouettes: Silhouettes) -> ContourRays:
    """Contour rays of the outlines from `extract_outlines`; none with fewer than two views."""
    inner, _ = viewing_lines(contours.view, contours.points, contours.tangents, silhouettes)
    near, far = np.empty(len(inner)), np.empty(len(inner))

    def intersect(first: int, end: int) -> None:
        rays = slice(first, end)
        surviving_intervals(contours.view[rays], inner[rays], silhouettes, near[rays], far[rays])

    in_threads(len(inner), intersect)
    directions, normals = viewing_lines(contours.view, contours.edges, contours.tangents, silhouettes)
    kept = near <= far
    view = contours.view[kept]
    return ContourRays(view, silhouettes.centre[view], directions[kept], normals[kept], near[kept], far[kept])


def exclude_views(contours: Contours, silhouettes: Silhouettes, views: Collection[int]) -> tuple[Contours, Silhouettes]:
    """The same outlines with some views absent."""
    if not views:
        return contours, silhouettes
    gone = list(views)
    kept = ~np.isin(contours.view, gone)
    box = silhouettes.box.copy()
    box[gone] = 0
    left = Contours(contours.view[kept], contours.points[kept], contours.edges[kept], contours.tangents[kept])
    return left, silhouettes._replace(box=box)


def extract_outlines(masks: Sequence[Mask | None], cameras: Sequence[Camera], count: int) -> tuple[Contours, Silhouettes]:
    """About `count` points on all contours, and the silhouettes that limit their viewing lines.  Deterministic.

    masks: one per camera, taken at the same time, (height, width) uint8, not 0 on the person; None or empty: the view is
    absent.  Raises ValueError when a mask's shape is not its camera's.
    """
    views: list[int] = []
    crops: list[Mask] = []
    dilated: list[Mask] = []
    boxes = np.zeros((len(cameras), 4), dtype=np.int64)
    at = np.zeros(len(cameras), dtype=np.int64)
    length = 0
    for k, (mask, camera) in enumerate(zip(masks, cameras, strict=True)):
        if mask is None:
            continue
        if mask.shape != camera.size[::-1]:
            raise ValueError(f"camera {camera.name}: a mask of {mask.shape[::-1]}; allowed: {camera.size} px")
        box = _box(mask)
        if box is None:
            continue
        left, top, across, down = box
        crop = mask[top : top + down, left : left + across]
        views.append(k)
        crops.append(crop)
        dilated.append(np.asarray(cv2.dilate(crop, DILATION), dtype=np.uint8).reshape(-1))
        boxes[k], at[k] = box, length
        length += len(dilated[-1])
    lens, sizes, bounds, whole = lenses_and_bounds(cameras, boxes)
    rotations = np.array([camera.rotation for camera in cameras]).reshape(-1, 3, 3)
    centres = np.array([camera.centre for camera in cameras]).reshape(-1, 3)
    pixels = np.concatenate(dilated) if dilated else np.empty(0, np.uint8)
    silhouettes = Silhouettes(lens, rotations, centres, sizes, boxes, at, pixels, bounds, whole)
    return sample_contours(views, crops, boxes, sizes, count), silhouettes


def _box(mask: Mask) -> tuple[int, int, int, int] | None:
    """Left, top, width, height of the mask with a margin of two pixels where the image has them; None when empty."""
    left, top, across, down = cv2.boundingRect(mask)
    if across == 0:
        return None
    right, bottom = min(left + across + 2, mask.shape[1]), min(top + down + 2, mask.shape[0])
    left, top = max(left - 2, 0), max(top - 2, 0)
    return left, top, right - left, bottom - top


def midpoints(rays: Floats32) -> Floats:
    """(n, 3) midpoints of the surviving intervals, metres."""
    middle = 0.5 * (rays[NEAR].astype(np.float64) + rays[FAR])
    points: Floats = rays[:3].T.astype(np.float64) + middle[:, None] * rays[3:6].T
    return points
