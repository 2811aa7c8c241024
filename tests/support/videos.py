"""Pictures whose grey value is their number."""

import numpy as np

from zenocap.common.arrays import Image

GREY_STEP = 10  # of grey values from one frame to the next


def grey_frames(count: int, size: tuple[int, int] = (64, 48)) -> list[Image]:
    """Frame k has the grey value GREY_STEP * (k % 24)."""
    return [np.full((size[1], size[0], 3), GREY_STEP * (k % 24), np.uint8) for k in range(count)]
