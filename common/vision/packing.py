"""A mask for the wire, lossless: the box around its pixels, 8 pixels a byte row by row, zlib at its fastest level."""

import zlib

import numpy as np

from common.vision.background import Mask

Region = tuple[int, int, int, int]  # left, top, width, height, px

LEVEL = 1
LARGEST_SIDE = 16384  # px, as in `common.messages.Silhouette`


def pack(mask: Mask) -> tuple[Region, bytes]:
    """Region and bytes of a mask (height, width), not 0 on the person; (0, 0, 0, 0) and b"" when it is empty."""
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    if len(rows) == 0:
        return (0, 0, 0, 0), b""
    left, right, top, bottom = int(columns[0]), int(columns[-1]) + 1, int(rows[0]), int(rows[-1]) + 1
    bits = np.packbits(mask[top:bottom, left:right] != 0, axis=1)
    return (left, top, right - left, bottom - top), zlib.compress(bits.tobytes(), LEVEL)


def unpack(size: tuple[int, int], region: Region, data: bytes) -> Mask:
    """The mask, (height, width) uint8 of 0 and 1, of what `pack` gave; size: (width, height).

    Memory is bounded by `size` whatever `data` holds.  Raises ValueError for a size or region out of range, for data
    that is damaged, cut, too long or followed by anything, and for bits set beyond the region's right edge.
    """
    width, height = size
    left, top, across, down = region
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise ValueError(f"size: {width}x{height}; allowed 1 to {LARGEST_SIDE} px either way")
    if min(region) < 0 or left + across > width or top + down > height:
        raise ValueError(f"region: {region}; it must lie within {width}x{height}")
    mask = np.zeros((height, width), dtype=np.uint8)
    if across == 0 or down == 0:
        if region != (0, 0, 0, 0) or data:
            raise ValueError(f"region: {region} with {len(data)} bytes; an empty mask is (0, 0, 0, 0) with none")
        return mask
    stride = (across + 7) // 8
    bits = np.frombuffer(_inflate(data, stride * down), dtype=np.uint8).reshape(down, stride)
    spare = 8 * stride - across
    if spare and np.any(bits[:, -1] & ((1 << spare) - 1)):
        raise ValueError(f"data: bits are set beyond the region's {across} columns")
    mask[top : top + down, left : left + across] = np.unpackbits(bits, axis=1, count=across)
    return mask


def _inflate(data: bytes, expected: int) -> bytes:
    """Exactly so many bytes from one whole zlib stream, never more than one byte beyond that in memory."""
    stream = zlib.decompressobj()
    try:
        content = stream.decompress(data, expected + 1)
    except zlib.error as error:
        raise ValueError(f"data: {len(data)} bytes are not a zlib stream ({error})") from error
    if len(content) != expected or not stream.eof or stream.unused_data or stream.unconsumed_tail:
        raise ValueError(f"data: {len(data)} bytes do not hold exactly the {expected} of the region")
    return content
