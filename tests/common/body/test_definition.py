"""The neutral pose of an anatomy."""

import numpy as np

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import neutral_pose


def test_the_neutral_pose_has_the_given_yaw_and_does_not_modify_the_anatomy() -> None:
    before = TEN_PARTS.neutral.copy()
    pose = neutral_pose(TEN_PARTS, np.array([1, 2, 3]), yaw=0.7)
    assert pose.angles[TEN_PARTS.index["navel.y"]] == 0.7
    assert pose.position.dtype == np.float64
    np.testing.assert_array_equal(pose.position, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(TEN_PARTS.neutral, before)
