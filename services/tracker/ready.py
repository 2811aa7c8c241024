"""Loading what is compiled before the first instant: otherwise the first person seen costs the tracker instants."""

import cv2
import numpy as np

from common.body.definition import Bdp, Pose
from common.body.kinematics import part_frames
from common.body.proportions import HIP_HEIGHT, stretched_angles
from common.body.surface import body_ellipses
from common.camera.pinhole import Camera
from services.tracker.stature import average_body
from services.tracker.tracking import Mask, Setup, describe, follow, initial_state

HEIGHT = 1.75
INSTANTS, EMPTY = 12, 3


def load_compiled(setup: Setup) -> str:
    """Follow an average person who stands at the origin in the initial posture, and then is gone.

    Returns what the tracker does before that, in words.
    """
    body = average_body(setup.anatomy, HEIGHT)
    pose = Pose(np.array([0.0, HIP_HEIGHT * HEIGHT, 0.0]), stretched_angles(setup.anatomy))
    state, words = initial_state(setup), ""
    for k in range(INSTANTS + EMPTY):
        masks = {
            viewer: _drawn(setup, camera, body, pose) if k < INSTANTS else _empty(camera)
            for viewer, camera in setup.cameras.items()
        }
        state, _ = follow(setup, state, k * setup.frame_ns, masks)
        words = describe(state) if k < INSTANTS else words
    return words


def _drawn(setup: Setup, camera: Camera, body: Bdp, pose: Pose) -> Mask:
    """The body's silhouette; without the parts that are not before the camera."""
    mask = _empty(camera)
    for ellipses in body_ellipses(body, part_frames(setup.anatomy, body, pose)):
        points = camera.project(ellipses)
        if np.all(np.isfinite(points)) and np.abs(points).max() < 1e5:
            cv2.fillConvexPoly(mask, cv2.convexHull(np.round(points).astype(np.int32)), (1,))
    return mask


def _empty(camera: Camera) -> Mask:
    width, height = camera.size
    return np.zeros((height, width), np.uint8)
