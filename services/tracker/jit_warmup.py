"""Warm-up of compiled functions before the first frame set, which would otherwise be delayed."""

import numpy as np

from zenocap.common.arrays import Mask
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.body.proportions import HIP_HEIGHT, t_pose_angles
from zenocap.common.camera.pinhole import Camera
from zenocap.common.vision.prediction import drawn, seen_parts
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.states import TrackerSetup
from zenocap.services.tracker.tracking import describe, initial_state, track

STATURE_M = 1.75
PERSON_FRAMES, LIMB_FRAMES, EMPTY_FRAMES = 12, 3, 3


def load_compiled(setup: TrackerSetup) -> str:
    """Track an average person in T-pose at the origin, then without the left arm, then frame sets without a person.

    Returns the health text before the frame sets without the arm, for which a limb is searched.
    """
    body = average_body(setup.anatomy, STATURE_M)
    pose = Pose(np.array([0.0, HIP_HEIGHT * STATURE_M, 0.0]), t_pose_angles(setup.anatomy))
    state, state_text = initial_state(setup), ""
    everything = frozenset(setup.anatomy.parts)
    one_arm = everything - {"left_upper_arm", "left_lower_arm"}
    for k, shown in enumerate([everything] * PERSON_FRAMES + [one_arm] * LIMB_FRAMES + [frozenset()] * EMPTY_FRAMES):
        masks = {viewer: _silhouette(setup, camera, body, pose, shown) for viewer, camera in setup.cameras.items()}
        state, _ = track(setup, state, k * setup.frame_ns, masks)
        state_text = describe(state) if shown == everything else state_text
    return state_text


def _silhouette(setup: TrackerSetup, camera: Camera, body: Bdp, pose: Pose, shown: frozenset[str]) -> Mask:
    """Mask of the shown parts of the body, without those behind the camera."""
    seen, pixels = seen_parts(camera, np.stack(body_ellipses(body, part_frames(setup.anatomy, body, pose))))
    return drawn(camera.size, pixels[seen & [part in shown for part in setup.anatomy.parts]])
