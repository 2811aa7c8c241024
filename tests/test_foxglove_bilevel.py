"""The hand-written PNG is what another library reads back, pixel by pixel."""

import struct

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from common.formats.foxglove.bilevel import bilevel_png
from common.vision.background import Mask

SIDES = st.tuples(st.integers(1, 40), st.integers(1, 40))


@given(arrays(np.uint8, SIDES, elements=st.integers(0, 1)))
def test_opencv_reads_the_mask_back(mask: Mask) -> None:
    image = cv2.imdecode(np.frombuffer(bilevel_png(mask), np.uint8), cv2.IMREAD_GRAYSCALE)
    np.testing.assert_array_equal(image, 255 * mask)


def test_a_pixel_takes_one_bit() -> None:
    png = bilevel_png(np.ones((3, 5), np.uint8))
    assert struct.unpack(">IIBB", png[16:26]) == (5, 3, 1, 0)
