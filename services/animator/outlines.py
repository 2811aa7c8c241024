"""The model's outline as a camera sees it, part by part."""

import cv2
import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.kinematics import part_frames
from common.body.surface import body_ellipses
from common.camera.pinhole import Camera

FAR_PX = 1e5  # a part that is all but in the camera lies nowhere in its picture


def outlines(anatomy: Anatomy, bdp: Bdp, pose: Pose, camera: Camera) -> list[tuple[str, Floats]]:
    """Each part's name and its convex outline, (corners, 2) px of the camera's picture, lens included.

    Parts that are not wholly in front of the camera are left out.
    """
    ellipses = body_ellipses(bdp, part_frames(anatomy, bdp, pose))
    pixels = camera.project(np.concatenate(ellipses)).reshape(len(ellipses), -1, 2)
    found: list[tuple[str, Floats]] = []
    for part, points in zip(anatomy.parts, pixels, strict=True):
        if np.isfinite(points).all() and np.abs(points).max() < FAR_PX:
            hull = cv2.convexHull(points.astype(np.float32))
            found.append((part, np.asarray(hull, dtype=np.float64).reshape(-1, 2)))
    return found
