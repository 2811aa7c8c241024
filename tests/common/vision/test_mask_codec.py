"""Packing: lossless for every mask; everything but a packed mask is rejected."""

import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from zenocap.common.vision.mask_codec import DIFFERENCES, pack, unpack

MASKS = arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=40), elements=st.integers(0, 1))


def _cross() -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    mask = np.zeros((12, 20), dtype=np.uint8)
    mask[2:9, 5] = 1
    mask[4, 3:14] = 1
    return mask


@given(MASKS)
def test_every_mask_round_trips(mask: np.ndarray[tuple[int, int], np.dtype[np.uint8]]) -> None:
    height, width = mask.shape
    assert np.array_equal(unpack((width, height), *pack(mask)), mask)


REGION, DATA = pack(_cross())


def test_region_is_the_box_of_all_nonzero_pixels_and_equal_masks_have_equal_bytes() -> None:
    assert REGION == (3, 2, 11, 7)
    assert pack(_cross()) == pack(_cross() * 255) == (REGION, DATA)


@pytest.mark.parametrize(
    ("size", "region", "data", "reason"),
    [
        *((size, REGION, DATA, r"size: .*allowed 1 to 16384") for size in ((0, 12), (20, 0), (-1, 12), (16385, 12))),
        *(
            ((20, 12), region, DATA, "must lie within 20x12")
            for region in ((-1, 2, 11, 7), (10, 2, 11, 7), (3, 6, 11, 7), (3, 2, -11, 7))
        ),
        *(((20, 12), region, b"", "an empty mask is") for region in ((0, 0, 0, 3), (1, 0, 0, 0))),
        ((20, 12), (0, 0, 0, 0), b"x", "an empty mask is"),
        ((20, 12), (3, 2, 11, 6), DATA, "do not hold exactly"),
        ((20, 12), REGION, DATA + b"\0", "do not hold exactly"),
        ((20, 12), (3, 2, 11, 1), DIFFERENCES + zlib.compress(b"\xff\xff", 1), "beyond the region's 11 columns"),
    ],
)
def test_what_is_no_packed_mask_of_this_size_and_region_is_refused(
    size: tuple[int, int], region: tuple[int, int, int, int], data: bytes, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        unpack(size, region, data)


def test_truncated_data_are_refused() -> None:
    for length in range(len(DATA)):
        with pytest.raises(ValueError, match="data: "):
            unpack((20, 12), REGION, DATA[:length])


@given(MASKS)
def test_the_format_without_row_differences_is_read(mask: np.ndarray[tuple[int, int], np.dtype[np.uint8]]) -> None:
    """Takes of version 0.1 have it."""
    height, width = mask.shape
    (left, top, across, down), _ = pack(mask)
    rows = np.packbits(mask[top : top + down, left : left + across], axis=1).tobytes()
    data = zlib.compress(rows, 1) if rows else b""
    assert np.array_equal(unpack((width, height), (left, top, across, down), data), mask)


def test_an_unknown_first_byte_is_refused() -> None:
    for first in set(range(256)) - {DATA[0]}:
        with pytest.raises(ValueError, match="not a zlib stream"):
            unpack((20, 12), REGION, bytes([first]) + DATA[1:])


@pytest.mark.slow
def test_a_decompression_bomb_is_refused() -> None:
    bomb = DIFFERENCES + zlib.compress(bytes(50_000_000), 9)
    with pytest.raises(ValueError, match="do not hold exactly"):
        unpack((20, 12), (3, 2, 11, 7), bomb)


@given(st.binary(max_size=60))
def test_random_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="data: "):
        unpack((20, 12), (3, 2, 11, 7), data)
