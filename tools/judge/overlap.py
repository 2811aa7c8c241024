"""Overlap of body and silhouette in images of reduced size."""

from dataclasses import dataclass

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.common.vision.prediction import drawn, seen_parts
from zenocap.tools.judge.parameters import LONG_SIDE_PX, TOLERANCE_PX


@dataclass(frozen=True, slots=True)
class ViewSample:
    """A silhouette and a body in one view.  Shares are NaN where nothing is to be shared.

    outside: share of the silhouette more than TOLERANCE_PX outside the body.  uncovered: share of the body, as far as it is
    in the image, more than that outside the silhouette.  area: of the silhouette, as a share of the image.  cut: whether it
    touches the border of the image.  hidden: share of the body outside the image.
    """

    outside: float
    uncovered: float
    area: float
    cut: bool
    hidden: float


def reduced(camera: Camera) -> Camera:
    """The camera with an image of at most LONG_SIDE_PX."""
    scale = min(1.0, LONG_SIDE_PX / max(camera.size))
    return camera.resized((max(8, round(scale * camera.size[0])), max(8, round(scale * camera.size[1]))))


def reduced_mask(mask: Mask, camera: Camera) -> Mask:
    """A silhouette (height, width) at the size of a reduced camera, 0 and 1."""
    size = mask.shape[1], mask.shape[0]
    if size == camera.size:
        return np.asarray(mask != 0, dtype=np.uint8)
    smaller = cv2.resize((mask != 0).astype(np.uint8) * np.uint8(255), camera.size, interpolation=cv2.INTER_AREA)
    return np.asarray(smaller > 127, dtype=np.uint8)


def body_points(anatomy: Anatomy, body: Bdp, pose: Pose) -> Floats:
    """(parts, points, 3) in the world, metres, on the end ellipses of every part."""
    return np.stack(body_ellipses(body, part_frames(anatomy, body, pose)))


def body_mask(camera: Camera, points: Floats) -> tuple[Mask, float]:
    """Image (height, width) of a body, 0 and 1, and the share of its points outside it.  points: see `body_points`."""
    seen, pixels = seen_parts(camera, points)
    inside = ((pixels[seen] >= 0) & (pixels[seen] < np.array(camera.size))).all(axis=2)
    return drawn(camera.size, pixels[seen]), 1.0 - np.count_nonzero(inside) / (points.shape[0] * points.shape[1])


def view_sample(camera: Camera, mask: Mask, points: Floats | None) -> ViewSample:
    """Figures of one view.  camera: reduced.  mask: of its size.  points: of the body, None without a pose."""
    height, width = mask.shape
    count = int(np.count_nonzero(mask))
    outside, uncovered, hidden = np.nan, np.nan, np.nan
    if points is not None:
        body, hidden = body_mask(camera, points)
        kernel = np.ones((2 * TOLERANCE_PX + 1, 2 * TOLERANCE_PX + 1), np.uint8)
        if count:
            outside = np.count_nonzero((mask != 0) & (cv2.dilate(body, kernel) == 0)) / count
        if body.any():
            uncovered = np.count_nonzero((body != 0) & (cv2.dilate(mask, kernel) == 0)) / np.count_nonzero(body)
    cut = bool(mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any())
    return ViewSample(float(outside), float(uncovered), count / (width * height), cut, hidden)
