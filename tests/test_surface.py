"""Points on the parts' ends: a cylinder's, a cone's, and one whose axis begins beside its joint."""

import numpy as np

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from common.body.definition import neutral_pose
from common.body.kinematics import part_frames
from common.body.surface import body_ellipses, end_ellipses
from services.tracker.stature import body_of_height
from tests.pose_tracks import body

UPRIGHT = np.eye(3, 4)
SIZE = np.array([0.5, 0.2, 0.1])


def test_a_cylinder_has_two_equal_ends_its_height_apart() -> None:
    near, far = np.split(end_ellipses(UPRIGHT, SIZE, 12), 2)
    np.testing.assert_allclose(far - near, np.tile([0.0, 0.5, 0.0], (12, 1)), atol=1e-12)
    np.testing.assert_allclose((near[:, 0] / 0.2) ** 2 + (near[:, 2] / 0.1) ** 2, 1.0)


def test_a_cone_has_its_tips_radii_at_the_far_end() -> None:
    _, far = np.split(end_ellipses(UPRIGHT, SIZE, 12, tip=np.array([0.05, 0.04])), 2)
    np.testing.assert_allclose((far[:, 0] / 0.05) ** 2 + (far[:, 2] / 0.04) ** 2, 1.0)
    np.testing.assert_allclose(far[:, 1], 0.5)


def test_a_base_moves_the_part_in_its_own_frame() -> None:
    turned = np.array([[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0]])
    base = np.array([0.1, 0.0, 0.0])
    moved = end_ellipses(turned, SIZE, base=base) - end_ellipses(turned, SIZE)
    np.testing.assert_allclose(moved, np.tile([0.0, 0.1, 0.0], (48, 1)), atol=1e-12)


def test_a_body_stands_as_high_as_its_person() -> None:
    for anatomy, bdp, slack in ((TEN_PARTS, body(1.8), 0.001), (FOURTEEN_PARTS, body_of_height(1.8), 0.04)):
        pose = neutral_pose(anatomy, np.zeros(3))
        points = np.concatenate(body_ellipses(bdp, part_frames(anatomy, bdp, pose)))
        assert abs(np.ptp(points[:, 1]) - 1.8) < slack
