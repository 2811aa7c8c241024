"""Image of a body in a view; of the tracked body in the next frame, as distances from its outline."""

from typing import NamedTuple

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Floats, Floats32, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.vision.silhouette import Extents

FARTHEST_PX = 1e4  # from the image; farther points are behind the camera or too close to it; chosen by hand
BAND_M = 0.08  # m, half width of the band in which the outline of a still body is uncertain: clothes, errors of the pose
BAND_MOTION = 0.5  # of the largest motion of the outline since the pose before, added to that; chosen by hand
MOVING_PERCENTILE = 90  # of the motions of the points of the body that counts as the largest; chosen by hand
BAND_MIN_PX = 2.0  # px; chosen by hand
LARGEST_SHARE = 0.9  # of the image, of the box of a body of use; chosen by hand
MARGIN_BANDS = 2.0  # bands around the body to which distances are computed; chosen by hand


class Prediction(NamedTuple):
    """Expected image of a body.

    left, top: column and row of the image at the first pixel of `depth`.  depth: (rows, columns) px from the outline,
    positive inside.  band: px, half width of the band in which the outline is uncertain.
    extents: of the body in the image.
    """

    left: int
    top: int
    depth: Floats32
    band: float
    extents: Extents

    @property
    def place(self) -> tuple[slice, slice]:
        """Rows and columns of the image that `depth` covers."""
        rows, columns = self.depth.shape
        return slice(self.top, self.top + rows), slice(self.left, self.left + columns)


def predicted(camera: Camera, points: Floats, motion: Floats | None = None) -> Prediction | None:
    """Expected image of a body in the view of a camera; None when too little of it is in the image.

    points: (parts, points, 3) in the world, metres; each part is the convex hull of its own.  motion: (parts, points, 3),
    by how much they moved since the pose before and are expected to move again; None: a body at rest.
    """
    expected = points if motion is None else points + motion
    seen, pixels = seen_parts(camera, expected)
    mask = drawn(camera.size, pixels[seen])
    left, top, across, down = cv2.boundingRect(mask)
    width, height = camera.size
    if across == 0 or across * down > LARGEST_SHARE * width * height:
        return None
    centre = np.median(expected.reshape(-1, 3), axis=0)
    depth_m = float(camera.rotation[2] @ centre + camera.translation[2])
    px_per_m = float(camera.matrix[0, 0]) / max(depth_m, 1e-3)
    largest = 0.0
    if motion is not None:
        largest = float(np.percentile(np.linalg.norm(motion.reshape(-1, 3), axis=1), MOVING_PERCENTILE))
    band = max(BAND_MIN_PX, px_per_m * (BAND_M + BAND_MOTION * largest))
    pad = int(np.ceil(MARGIN_BANDS * band)) + 1
    x0, y0 = max(0, left - pad), max(0, top - pad)
    crop = mask[y0 : top + down + pad, x0 : left + across + pad]
    extents = Extents(left, left + across - 1, top, top + down - 1)
    return Prediction(x0, y0, depths(crop), band, extents)


def seen_parts(camera: Camera, points: Floats) -> tuple[Bools, Floats]:
    """Whether each part of a body can be drawn in a view, (parts,), and its pixels (parts, points, 2).

    points: (parts, points, 3) in the world, metres; each part is the convex hull of its own.
    """
    pixels = camera.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
    return np.asarray((np.abs(pixels) <= FARTHEST_PX).all(axis=(1, 2))), pixels  # not so for NaN


def drawn(size: tuple[int, int], pixels: Floats) -> Mask:
    """Image (height, width) of 0 and 1 of parts that can be drawn, (parts, points, 2) px."""
    mask: Mask = np.zeros((size[1], size[0]), np.uint8)
    for part in pixels:
        cv2.fillConvexPoly(mask, cv2.convexHull(np.round(part).astype(np.int32)), (1,))
    return mask


def depths(mask: Mask) -> Floats32:
    """(rows, columns) px to the outline, positive inside; the border of the crop is no outline."""
    inside = cv2.distanceTransform(mask, cv2.DIST_L2, 3)
    outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 3)
    return np.asarray(np.where(mask != 0, inside - 0.5, 0.5 - outside), dtype=np.float32)
