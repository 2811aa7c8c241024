"""Pictures whose grey value is their number; EXIF data of a turned one."""

import numpy as np

from zenocap.common.arrays import Image

GREY_STEP = 10  # of grey values from one frame to the next
# EXIF data of a JPEG: orientation 6, that of a telephone held upright.
QUARTER_TURN = b"\xff\xe1\0\x22Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"


def grey_frames(count: int, size: tuple[int, int] = (64, 48)) -> list[Image]:
    """Frame k has the grey value GREY_STEP * (k % 24)."""
    return [np.full((size[1], size[0], 3), GREY_STEP * (k % 24), np.uint8) for k in range(count)]
