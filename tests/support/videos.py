"""Pictures whose grey value is their number; EXIF data of a turned one."""

import struct

import numpy as np

from zenocap.common.arrays import Image

GREY_STEP = 10  # of grey values from one frame to the next
UPRIGHT = 6  # orientation in the EXIF data of a JPEG, that of a telephone held upright


def with_orientation(jpeg: bytes, orientation: int, order: bytes = b"MM") -> bytes:
    """The JPEG with EXIF data of an orientation, 1 to 8.  order: of bytes, II or MM."""
    byte_order = ">" if order == b"MM" else "<"
    exif = b"Exif\0\0" + order + struct.pack(f"{byte_order}HIHHHIHHI", 42, 8, 1, 274, 3, 1, orientation, 0, 0)
    return jpeg[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif + jpeg[2:]


def grey_frames(count: int, size: tuple[int, int] = (64, 48)) -> list[Image]:
    """Frame k has the grey value GREY_STEP * (k % 24)."""
    return [np.full((size[1], size[0], 3), GREY_STEP * (k % 24), np.uint8) for k in range(count)]
