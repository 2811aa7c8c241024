"""Scene points: viewing lines through the silhouettes' contours, cut with every other silhouette.  [Hybrid III]"""

from collections.abc import Sequence

import cv2
import numpy as np

from common.camera.pinhole import Camera
from common.vision.background import Mask
from services.tracker.hull_contours import Contours, sample_contours
from services.tracker.hull_rays import Flags, Floats, Integers, Silhouettes, survive, viewing_lines
from services.tracker.lens import LENGTH, REACH, lens_of, undistorted
from services.tracker.scene import Scene

DILATION = np.ones((3, 3), np.uint8)  # odd: an even kernel shifts the mask by a pixel


def scene_points(masks: Sequence[Mask | None], cameras: Sequence[Camera], count: int) -> Scene:
    """The scene of masks taken at the same time by calibrated cameras.  Deterministic.

    masks: one for every camera, (height, width) uint8, not 0 on the person; None or empty: the view is absent.
    count: rays in all; those without a place that survives are not in the scene.  With fewer than two views it is empty.
    Raises ValueError when a mask's shape is not its camera's.
    """
    contours, seen = outlines(masks, cameras, count)
    directions, normals = viewing_lines(contours.view, contours.points, contours.tangents, seen)
    near, far = np.empty(len(directions)), np.empty(len(directions))
    survive(contours.view, directions, seen, near, far)
    kept = near <= far
    view = contours.view[kept]
    return Scene(view, seen.centre[view], directions[kept], normals[kept], near[kept], far[kept])


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
    seen = Silhouettes(
        lens,
        np.array([camera.rotation for camera in cameras]).reshape(-1, 3, 3),
        np.array([camera.centre for camera in cameras]).reshape(-1, 3),
        np.array([camera.size for camera in cameras], dtype=np.int64).reshape(-1, 2),
        boxes,
        at,
        np.concatenate(dilated) if dilated else np.empty(0, np.uint8),
        *_bounds(lens, boxes, cameras),
    )
    sizes = [cameras[k].size for k in views]
    return sample_contours(views, crops, [(int(boxes[k, 0]), int(boxes[k, 1])) for k in views], sizes, count), seen


def _box(mask: Mask) -> tuple[int, int, int, int] | None:
    """Left, top, width, height of the mask with a free edge of two pixels where the image has them; None when empty."""
    left, top, across, down = cv2.boundingRect(mask)
    if across == 0:
        return None
    right, bottom = min(left + across + 2, mask.shape[1]), min(top + down + 2, mask.shape[0])
    left, top = max(left - 2, 0), max(top - 2, 0)
    return left, top, right - left, bottom - top


def _bounds(lens: Floats, boxes: Integers, cameras: Sequence[Camera]) -> tuple[Floats, Flags]:
    """`bounds` and `whole` of Silhouettes."""
    bounds = np.zeros((len(cameras), 4))
    whole = np.zeros(len(cameras), dtype=np.bool_)
    for k, camera in enumerate(cameras):
        left, top, across, down = boxes[k].tolist()
        if across == 0:
            continue
        right, bottom = left + across - 1, top + down - 1
        width, height = camera.size
        whole[k] = left > 0 and top > 0 and right < width - 1 and bottom < height - 1
        steps = 9 if lens[k, REACH] > 0 else 2
        u, v = np.linspace(left, right, steps), np.linspace(top, bottom, steps)
        edge = [(a, b) for a in u for b in (top, bottom)] + [(a, b) for a in (left, right) for b in v]
        flat = np.array([undistorted(lens[k], float(a), float(b)) for a, b in edge])
        bounds[k] = flat[:, 0].min(), flat[:, 0].max(), flat[:, 1].min(), flat[:, 1].max()
    return bounds, whole
