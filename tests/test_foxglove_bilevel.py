"""The hand-written PNG is what another library reads back, pixel by pixel."""

import struct

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from common.formats.foxglove.bilevel import bilevel_png
from common.vision.background import Mask
from common.vision.packing import Region, pack

SIDES = st.tuples(st.integers(1, 40), st.integers(1, 40))


@st.composite
def masks(draw: st.DrawFn) -> Mask:
    """A mask with anything in a part of it, so that every way of lying across the bytes comes."""
    height, width = draw(SIDES)
    mask = np.zeros((height, width), np.uint8)
    top, left = draw(st.integers(0, height - 1)), draw(st.integers(0, width - 1))
    part = mask[top:, left:]
    part[:] = draw(arrays(np.uint8, part.shape, elements=st.integers(0, 1)))
    return mask


def png_of(mask: Mask) -> bytes:
    return bilevel_png((mask.shape[1], mask.shape[0]), *pack(mask))


@given(masks())
def test_opencv_reads_the_mask_back(mask: Mask) -> None:
    image = cv2.imdecode(np.frombuffer(png_of(mask), np.uint8), cv2.IMREAD_GRAYSCALE)
    np.testing.assert_array_equal(image, 255 * mask)


def test_a_pixel_takes_one_bit() -> None:
    assert struct.unpack(">IIBB", png_of(np.ones((3, 5), np.uint8))[16:26]) == (5, 3, 1, 0)


@pytest.mark.parametrize("region", [(1, 0, 8, 8), (0, 1, 8, 8), (-1, 0, 8, 8), (0, 0, 0, 8), (0, 0, 0, 0)])
def test_what_pack_did_not_give_is_refused(region: Region) -> None:
    _, data = pack(np.ones((8, 8), np.uint8))
    with pytest.raises(ValueError, match="region"):
        bilevel_png((8, 8), region, data)
