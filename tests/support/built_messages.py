"""Messages with plain values in the fields that a test does not name."""

from copy import deepcopy
from typing import TypeVar

from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.vision.mask_codec import pack

M = TypeVar("M", bound=m.Message)

PLAIN: dict[type[m.Message], dict[str, object]] = {
    m.Health: {"service": "viewer", "id": "1", "state": "", "rate": 0.0, "stages_ms": {}, "counts": {}},
    m.TrackerPose: {
        "position": (0.0, 1.0, 0.0), "angles": {}, "position_spread": (0.0, 0.0, 0.0), "spread": {}, "likelihood": 0.0,
        "effective": 1.0, "lost": False, "views": [],
    },
    m.UniversalBap: {"position": (0.0, 1.0, 0.0), "angles": {}, "scores": {}, "views": {}, "stale": [], "lost": []},
    m.Sighting: {
        "viewer": "1", "present": True, "x": 0.0, "y": 0.0, "height": 1.0, "width": 0.3, "view": "facade", "score": 0.5,
    },
    m.Assignment: {
        "position": (0.0, 1.0, 0.0), "yaw": 0.0, "lean": 0.0, "roll": 0.0, "squatting": False, "views": {},
        "tracking": True,
    },
    m.Silhouette: {"viewer": "1", "size": (160, 120), "region": (0, 0, 0, 0), "data": b""},
    m.PartialBap: {"viewer": "1", "view": "facade", "angles": {}, "limbs": {}, "exchange": 0.0, "score": 0.5},
    m.Posture: {"label": None, "start_ns": 0, "end_ns": 0, "log_likelihoods": {}, "score": 0.0, "margin": 0.0},
    m.Verdict: {"rating": "good", "error": 0.1, "evidence": "one-pass", "reasons": [], "stretches": []},
    m.CameraInfo: {
        "viewer": "1", "name": "cam01", "size": (160, 120), "matrix": [150.0, 0, 80, 0, 150, 60, 0, 0, 1],
        "distortions": [], "rotation": [1.0, 0, 0, 0, -1, 0, 0, 0, -1], "translation": [0.0, 1.0, 5.0],
    },
}  # fmt: skip


def built(kind: type[M], **given: object) -> M:
    """A message with the given fields; frame and captured_ns are 0 without."""
    fields = {"frame": 0, "captured_ns": 0} | deepcopy(PLAIN[kind]) | given
    return kind(**fields)


def camera_message(camera: Camera, **given: object) -> m.CameraInfo:
    """The message of a camera, of a viewer of the same name unless given."""
    fields: dict[str, object] = {
        "viewer": camera.name, "name": camera.name, "size": camera.size, "matrix": camera.matrix.ravel().tolist(),
        "distortions": camera.distortions.ravel().tolist(), "rotation": camera.rotation.ravel().tolist(),
        "translation": camera.translation.ravel().tolist(),
    }  # fmt: skip
    return built(m.CameraInfo, **(fields | given))


def silhouette(viewer: str, frame: int, captured_ns: int, mask: Mask) -> m.Silhouette:
    """mask: (height, width)."""
    region, data = pack(mask)
    return m.Silhouette(
        frame=frame, captured_ns=captured_ns, viewer=viewer, size=mask.shape[::-1], region=region, data=data
    )
