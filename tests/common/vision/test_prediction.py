"""The expected image of a body: place, depth from the outline, motion, band."""

import numpy as np

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Floats
from zenocap.common.vision.prediction import BAND_M, drawn, predicted, seen_parts

CAMERA = look("cam01", np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 0.0])).resized((320, 240))
PX_PER_M = CAMERA.matrix[0, 0] / 4.0


def box(x: float = 0.0) -> Floats:
    """(1, 8, 3) corners of a flat box of 0.5 x 1.6 m around x, 1 m above the ground."""
    corners = [(x + dx, 1.0 + dy, dz) for dx in (-0.25, 0.25) for dy in (-0.8, 0.8) for dz in (-0.001, 0.001)]
    return np.array([corners])


def test_depth_is_positive_inside_and_grows_from_the_outline() -> None:
    found = predicted(CAMERA, box())
    middle = found.depth[found.depth.shape[0] // 2]
    assert abs(middle.max() - 0.25 * PX_PER_M) < 2.0
    assert abs(np.count_nonzero(middle > 0) - 0.5 * PX_PER_M) < 2.5
    assert middle[0] < -found.band
    left, right, top, bottom = found.extents
    assert abs((left + right) / 2 - 159.5) < 1.0
    assert abs(bottom - top - 1.6 * PX_PER_M) < 2.5


def test_a_motion_moves_the_body_and_widens_the_band() -> None:
    still, moving = predicted(CAMERA, box()), predicted(CAMERA, box(), box(0.2) - box())
    assert abs(moving.extents.leftmost - still.extents.leftmost - 0.2 * PX_PER_M) < 2.0
    assert abs(still.band - BAND_M * PX_PER_M) < 0.05
    assert moving.band > 1.5 * still.band


def test_a_body_outside_of_the_image_has_no_prediction() -> None:
    assert predicted(CAMERA, box(30.0)) is None
    assert predicted(CAMERA, box() + np.array([0.0, 0.0, 8.0])) is None  # behind the camera


def test_a_part_behind_the_camera_is_not_drawn() -> None:
    seen, pixels = seen_parts(CAMERA, np.concatenate([box(), box() + np.array([0.0, 0.0, 8.0])]))
    assert seen.tolist() == [True, False]
    alone = drawn(CAMERA.size, seen_parts(CAMERA, box())[1])
    assert alone.any()
    np.testing.assert_array_equal(drawn(CAMERA.size, pixels[seen]), alone)
