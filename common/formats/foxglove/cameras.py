"""Camera and silhouette of a viewer for Foxglove: CameraCalibration, PNG of 1 bit per pixel.

PNG: W3C PNG specification, third edition, 5 and 11.2; every row has filter type 0.  Written without OpenCV, which takes
ten times as long.
"""

import struct
import zlib

import foxglove.messages as fox
import numpy as np

from zenocap.common.formats.foxglove.channels import camera_frame
from zenocap.common.formats.foxglove.scene import timestamp
from zenocap.common.messages import CameraInfo
from zenocap.common.vision.mask_codec import Region, unpack

PLUMB_BOB, RATIONAL = 5, 8  # coefficients: k1, k2, p1, p2, k3, and k4, k5, k6 after them
IDENTITY = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]


def calibration(camera: CameraInfo) -> fox.CameraCalibration:
    """Camera calibration; images are not rectified, so R is the identity and P = [K 0].

    Up to 5 distortions are `plumb_bob`, more are `rational_polynomial`.  OpenCV's thin prism and tilt (the 9th to the
    14th) are not supported by Foxglove and left out.
    """
    few = len(camera.distortions) <= PLUMB_BOB
    count = PLUMB_BOB if few else RATIONAL
    a, b, c, d, e, f, g, h, i = camera.matrix
    return fox.CameraCalibration(
        timestamp=timestamp(camera.captured_ns),
        frame_id=camera_frame(camera.viewer),
        width=camera.size[0],
        height=camera.size[1],
        distortion_model="plumb_bob" if few else "rational_polynomial",
        D=(camera.distortions + [0.0] * count)[:count],
        K=camera.matrix,
        R=IDENTITY,
        P=[a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0],
    )


SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREYSCALE = 0
LEVEL = 1  # zlib's fastest, sufficient for rows of mostly equal bytes; chosen by hand


def bilevel_png(size: tuple[int, int], region: Region, data: bytes) -> bytes:
    """Black-and-white PNG of a mask of `size` (width, height), packed by `pack`.

    Raises ValueError as `unpack`.
    """
    width, height = size
    left, top, across, down = region
    if min(region) < 0 or left + across > width or top + down > height:
        raise ValueError(f"region: {region}; it must lie within {width}x{height}")
    # Only the region is unpacked, with the columns before it that share its first byte.
    first, spare = divmod(left, 8)
    near = (spare, 0, across, down) if across and down else region
    bits = np.packbits(unpack((max(spare + across, 1), max(down, 1)), near, data), axis=1)
    rows = np.zeros((height, 1 + (width + 7) // 8), dtype=np.uint8)
    rows[top : top + down, 1 + first : 1 + first + bits.shape[1]] = bits[:down]
    head = struct.pack(">IIBBBBB", width, height, 1, GREYSCALE, 0, 0, 0)
    pixels = zlib.compress(rows.tobytes(), LEVEL)
    return SIGNATURE + _chunk(b"IHDR", head) + _chunk(b"IDAT", pixels) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(kind)))
