"""The calibration that Foxglove gets projects as our camera does."""

import cv2
import numpy as np
import pytest
from foxglove_reader import parsed
from google.protobuf.message import Message

from common.formats.foxglove.calibration import calibration
from common.formats.foxglove.channels import CALIBRATION
from common.messages import CameraInfo

MATRIX = [500.0, 0.0, 319.5, 0.0, 510.0, 239.5, 0.0, 0.0, 1.0]


def said(distortions: list[float]) -> Message:
    info = CameraInfo(
        frame=0, captured_ns=3, viewer="1", name="cam01", size=(640, 480), matrix=MATRIX, distortions=distortions,
        rotation=np.eye(3).ravel().tolist(), translation=[0.0, 0.0, 0.0],
    )  # fmt: skip
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
    found = said(distortions)
    assert (found.distortion_model, len(found.D), found.frame_id) == (model, count, "viewer/1")
    assert (found.width, found.height) == (640, 480)
    points = np.array([[0.2, -0.3, 2.0], [-0.5, 0.4, 3.0]])
    matrix = np.array(found.K).reshape(3, 3)
    pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(found.D))
    expected, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), np.array(MATRIX).reshape(3, 3), np.array(distortions or [0.0] * 4)
    )
    np.testing.assert_allclose(pixels, expected, atol=1e-9)


def test_images_are_not_rectified() -> None:
    found = said([])
    np.testing.assert_array_equal(np.array(found.R).reshape(3, 3), np.eye(3))
    np.testing.assert_array_equal(np.array(found.P).reshape(3, 4)[:, :3], np.array(MATRIX).reshape(3, 3))
    np.testing.assert_array_equal(np.array(found.P).reshape(3, 4)[:, 3], 0)


def test_what_ros_has_no_name_for_is_left_out() -> None:
    assert list(said([0.1] * 8 + [0.5] * 6).D) == [0.1] * 8
