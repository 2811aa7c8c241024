"""A viewer's camera as `foxglove.CameraCalibration`: OpenCV's pinhole camera and distortions under ROS's names."""

import foxglove.messages as fox

from common.formats.foxglove.channels import camera_frame
from common.formats.foxglove.frames import timestamp
from common.messages import CameraInfo

PLUMB_BOB, RATIONAL = 5, 8  # coefficients: k1, k2, p1, p2, k3, and k4, k5, k6 after them
IDENTITY = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]


def calibration(camera: CameraInfo) -> fox.CameraCalibration:
    """K, D and R of the camera; its images are not rectified, so P is K with nothing behind it.

    Up to 5 distortions are `plumb_bob`, more are `rational_polynomial`.  OpenCV's thin prism and tilt (the 9th to the
    14th) have no name there and are left out.
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
