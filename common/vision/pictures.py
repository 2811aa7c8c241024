"""Small JPEG pictures of images, to be looked at."""

import cv2
import numpy as np

from zenocap.common.arrays import Image


def jpeg(image: Image, long_side_px: int, quality: int) -> bytes:
    """JPEG of an image, reduced as by `small_picture`."""
    return cv2.imencode(".jpg", small_picture(image, long_side_px), [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def small_picture(image: Image, long_side_px: int) -> Image:
    """The image reduced so that its longer side has at most `long_side_px` pixels."""
    scale = min(1.0, long_side_px / max(image.shape[:2]))
    size = max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
