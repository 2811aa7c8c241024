"""Foxglove camera calibrations: equal projection to the rig's cameras."""

import struct

import cv2
import numpy as np
import pytest
from google.protobuf.message import Message
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.support.built_messages import built
from tests.support.foxglove_reader import parsed
from zenocap.common.arrays import Mask
from zenocap.common.formats.foxglove.cameras import bilevel_png, calibration
from zenocap.common.formats.foxglove.channels import CALIBRATION
from zenocap.common.messages import CameraInfo
from zenocap.common.vision.mask_codec import Region, pack

MATRIX = [500.0, 0.0, 319.5, 0.0, 510.0, 239.5, 0.0, 0.0, 1.0]
POINTS = np.array([[0.2, -0.3, 2.0], [-0.5, 0.4, 3.0]])


def calibration_message(distortions: list[float]) -> Message:
    info = built(CameraInfo, size=(640, 480), matrix=MATRIX, distortions=distortions)
    return parsed(CALIBRATION.channel(rig="r", viewer="1"), calibration(info).encode())


@pytest.mark.parametrize(
    ("distortions", "model", "count"),
    [
        ([], "plumb_bob", 5),
        ([0.1, -0.05, 0.001, 0.002], "plumb_bob", 5),
        ([0.1, -0.05, 0.001, 0.002, 0.01], "plumb_bob", 5),
        ([0.1, -0.05, 0.001, 0.002, 0.01, 0.02, 0.03, 0.04], "rational_polynomial", 8),
    ],
)
def test_the_same_points_project_to_the_same_pixels(distortions: list[float], model: str, count: int) -> None:
    found = calibration_message(distortions)
    assert (found.distortion_model, len(found.D), found.frame_id) == (model, count, "viewer/1")
    assert (found.width, found.height) == (640, 480)
    pixels, expected = (
        cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), np.array(matrix).reshape(3, 3), np.array(lens))[0]
        for matrix, lens in ((found.K, found.D), (MATRIX, distortions or [0.0] * 4))
    )
    np.testing.assert_allclose(pixels, expected, atol=1e-9)


def test_images_are_not_rectified_and_thin_prism_and_tilt_coefficients_are_omitted() -> None:
    found = calibration_message([0.1] * 8 + [0.5] * 6)
    assert list(found.D) == [0.1] * 8
    np.testing.assert_array_equal(np.array(found.R).reshape(3, 3), np.eye(3))
    np.testing.assert_array_equal(np.array(found.P).reshape(3, 4)[:, :3], np.array(MATRIX).reshape(3, 3))
    np.testing.assert_array_equal(np.array(found.P).reshape(3, 4)[:, 3], 0)


SIDES = st.tuples(st.integers(1, 40), st.integers(1, 40))


@st.composite
def masks(draw: st.DrawFn) -> Mask:
    """Masks with random pixels in a random region, at every alignment with the bytes."""
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


def test_images_have_one_bit_per_pixel() -> None:
    assert struct.unpack(">IIBB", png_of(np.ones((3, 5), np.uint8))[16:26]) == (5, 3, 1, 0)


@pytest.mark.parametrize("region", [(1, 0, 8, 8), (0, 1, 8, 8), (-1, 0, 8, 8), (0, 0, 0, 8), (0, 0, 0, 0)])
def test_invalid_packed_data_raises_an_error(region: Region) -> None:
    _, data = pack(np.ones((8, 8), np.uint8))
    with pytest.raises(ValueError, match="region"):
        bilevel_png((8, 8), region, data)
