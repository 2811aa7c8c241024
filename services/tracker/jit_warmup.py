"""Warm-up of compiled functions before the first frame set, which would otherwise be delayed."""

import cv2
import numpy as np

from zenocap.common.arrays import Mask
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.body.proportions import HIP_HEIGHT, t_pose_angles
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.tracking import Setup, describe, initial_state, track

STATURE_M = 1.75
PERSON_FRAMES, EMPTY_FRAMES = 12, 3


def load_compiled(setup: Setup) -> str:
    """Track an average person in T-pose at the origin, then frame sets without a person.

    Returns the health text before the empty frame sets.
    """
    body = average_body(setup.anatomy, STATURE_M)
    pose = Pose(np.array([0.0, HIP_HEIGHT * STATURE_M, 0.0]), t_pose_angles(setup.anatomy))
    state, state_text = initial_state(setup), ""
    for k in range(PERSON_FRAMES + EMPTY_FRAMES):
        masks = {
            viewer: _silhouette(setup, camera, body, pose) if k < PERSON_FRAMES else _empty(camera)
            for viewer, camera in setup.cameras.items()
        }
        state, _ = track(setup, state, k * setup.frame_ns, masks)
        state_text = describe(state) if k < PERSON_FRAMES else state_text
    return state_text


def _silhouette(setup: Setup, camera: Camera, body: Bdp, pose: Pose) -> Mask:
    """Mask of the body, without parts behind the camera."""
    mask = _empty(camera)
    for ellipses in body_ellipses(body, part_frames(setup.anatomy, body, pose)):
        points = camera.project(ellipses)
        if np.all(np.isfinite(points)) and np.abs(points).max() < 1e5:
            cv2.fillConvexPoly(mask, cv2.convexHull(np.round(points).astype(np.int32)), (1,))
    return mask


def _empty(camera: Camera) -> Mask:
    width, height = camera.size
    return np.zeros((height, width), np.uint8)
