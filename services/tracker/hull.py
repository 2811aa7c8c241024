"""Scene points: viewing lines through the silhouettes' contours, cut with every other silhouette.  [Hybrid III]"""

from collections.abc import Collection, Sequence

import cv2
import numpy as np

from common.camera.pinhole import Camera
from common.vision.background import Mask
from services.tracker.hull_contours import Contours, sample_contours
from services.tracker.hull_rays import survive
from services.tracker.hull_views import Silhouettes, bounds_of, viewing_lines
from services.tracker.lens import LENGTH, lens_of
from services.tracker.scene import Scene

DILATION = np.ones((3, 3), np.uint8)  # odd: an even kernel shifts the mask by a pixel


def scene_points(masks: Sequence[Mask | None], cameras: Sequence[Camera], count: int) -> Scene:
    """The scene of masks taken at the same time by calibrated cameras.  Deterministic.

    masks: one for every camera, (height, width) uint8, not 0 on the person; None or empty: the view is absent.
    count: rays in all; those without a place that survives are not in the scene.  With fewer than two views it is empty.
    Raises ValueError when a mask's shape is not its camera's.
    """
    return scene_of(*outlines(masks, cameras, count))


def scene_of(contours: Contours, seen: Silhouettes) -> Scene:
    """The scene of what `outlines` gave."""
    inner, _ = viewing_lines(contours.view, contours.points, contours.tangents, seen)
    near, far = np.empty(len(inner)), np.empty(len(inner))
    survive(contours.view, inner, seen, near, far)
    directions, normals = viewing_lines(contours.view, contours.edges, contours.tangents, seen)
    kept = near <= far
    view = contours.view[kept]
    return Scene(view, seen.centre[view], directions[kept], normals[kept], near[kept], far[kept])


def without(contours: Contours, seen: Silhouettes, views: Collection[int]) -> tuple[Contours, Silhouettes]:
    """The same with some views absent."""
    if not views:
        return contours, seen
    gone = list(views)
    kept = ~np.isin(contours.view, gone)
    box = seen.box.copy()
    box[gone] = 0
    left = Contours(contours.view[kept], contours.points[kept], contours.edges[kept], contours.tangents[kept])
    return left, seen._replace(box=box)


def outlines(masks: Sequence[Mask | None], cameras: Sequence[Camera], count: int) -> tuple[Contours, Silhouettes]:
    """About `count` points on all contours, and the silhouettes to cut their viewing lines with; as `scene_points`."""
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
    lens = np.array([lens_of(camera) for camera in cameras]).reshape(-1, LENGTH)
    sizes = np.array([camera.size for camera in cameras], dtype=np.int64).reshape(-1, 2)
    bounds, whole = np.zeros((len(cameras), 4)), np.zeros(len(cameras), dtype=np.bool_)
    bounds_of(lens, boxes, sizes, bounds, whole)
    rotations = np.array([camera.rotation for camera in cameras]).reshape(-1, 3, 3)
    centres = np.array([camera.centre for camera in cameras]).reshape(-1, 3)
    pixels = np.concatenate(dilated) if dilated else np.empty(0, np.uint8)
    seen = Silhouettes(lens, rotations, centres, sizes, boxes, at, pixels, bounds, whole)
    return sample_contours(views, crops, boxes, sizes, count), seen


def _box(mask: Mask) -> tuple[int, int, int, int] | None:
    """Left, top, width, height of the mask with a free edge of two pixels where the image has them; None when empty."""
    left, top, across, down = cv2.boundingRect(mask)
    if across == 0:
        return None
    right, bottom = min(left + across + 2, mask.shape[1]), min(top + down + 2, mask.shape[0])
    left, top = max(left - 2, 0), max(top - 2, 0)
    return left, top, right - left, bottom - top
