"""The model's outline is the hull of what its surface projects to."""

import cv2
import numpy as np
from animator_stand_in import body, pose_at

from common.body.anatomy import TEN_PARTS
from common.body.definition import Pose
from common.body.kinematics import part_frames
from common.body.surface import end_ellipses
from common.runtime.rig import demo_rig
from services.animator.outlines import outlines

CAMERA = demo_rig().viewers[0].camera


def test_every_part_lies_in_its_outline_and_reaches_it() -> None:
    pose = pose_at(0.7)
    found = dict(outlines(TEN_PARTS, body(), pose, CAMERA))
    assert list(found) == list(TEN_PARTS.parts)
    for part, frame in zip(TEN_PARTS.parts, part_frames(TEN_PARTS, body(), pose), strict=True):
        points = CAMERA.project(end_ellipses(frame, body().sizes[TEN_PARTS.index[part]]))
        hull = found[part].astype(np.float32)
        distances = [cv2.pointPolygonTest(hull, (float(x), float(y)), True) for x, y in points]
        assert min(distances) > -0.01
        assert min(map(abs, distances)) < 0.01


def test_parts_behind_the_camera_have_no_outline() -> None:
    behind = Pose(CAMERA.centre + np.array([0.0, 0.0, 3.0]), TEN_PARTS.neutral)
    assert outlines(TEN_PARTS, body(), behind, CAMERA) == []
