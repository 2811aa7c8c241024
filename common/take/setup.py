"""What the steps of a rig were set up with, as a file in its take, so that they can be run again without the rig."""

import math
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from common.camera.pinhole import Camera
from common.messages import Name, Number, Size
from common.runtime.rig import Rig
from common.runtime.specs import learning_frames
from common.take.reading import TakeError

SETUP_FILE = "setup.json"


class RecordedViewer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """camera: at the working size, in the Y-up world; see `common.messages.CameraInfo`.

    learning_frames: at its start, of which it says nothing.  silhouette: whether it sends them.
    """

    id: Name
    camera: Name
    size: tuple[Annotated[int, Meta(ge=1, le=16384)], Annotated[int, Meta(ge=1, le=16384)]]
    matrix: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    distortions: Annotated[list[Number], Meta(max_length=14)]
    rotation: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    translation: Annotated[list[Number], Meta(min_length=3, max_length=3)]
    fps: Annotated[float, Meta(gt=0, le=1e4)]
    learning_frames: Annotated[int, Meta(ge=0, le=100_000)]
    silhouette: bool

    def pinhole(self) -> Camera:
        matrix, rotation = (np.array(values).reshape(3, 3) for values in (self.matrix, self.rotation))
        return Camera(self.camera, self.size, matrix, np.array(self.distortions), rotation, np.array(self.translation))


class RecordedRig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """person_height: metres, of a person who was not measured."""

    name: Name
    method: Name
    person_height: Size | None
    viewers: Annotated[list[RecordedViewer], Meta(max_length=64)]

    def cameras(self) -> dict[str, Camera]:
        """By viewer, in the rig's order."""
        return {viewer.id: viewer.pinhole() for viewer in self.viewers}

    def frame_ns(self) -> int:
        """Frame period of the slowest viewer."""
        return round(1e9 / min(viewer.fps for viewer in self.viewers))


def recorded_rig(rig: Rig) -> RecordedRig:
    """What of a rig decides what its steps say."""
    viewers = [
        RecordedViewer(
            id=viewer.id,
            camera=viewer.camera.name,
            size=viewer.camera.size,
            matrix=viewer.camera.matrix.ravel().tolist(),
            distortions=viewer.camera.distortions.ravel().tolist(),
            rotation=viewer.camera.rotation.ravel().tolist(),
            translation=viewer.camera.translation.ravel().tolist(),
            fps=viewer.fps,
            learning_frames=learning_frames(viewer.background_in_use),
            silhouette=viewer.silhouette,
        )
        for viewer in rig.viewers
    ]
    return RecordedRig(name=rig.name, method=rig.method, person_height=rig.person_height, viewers=viewers)


def write_setup(rig: RecordedRig) -> bytes:
    """JSON, whose numbers are read back as they were."""
    return msgspec.json.format(msgspec.json.encode(rig), indent=1)


def read_setup(path: Path, data: bytes) -> RecordedRig:
    """path: of the take, for errors.  Raises TakeError."""
    try:
        rig = msgspec.json.decode(data, type=RecordedRig)
    except (msgspec.MsgspecError, ValueError) as error:
        raise TakeError(f"{path}: attachment {SETUP_FILE}: {error}") from error
    if not rig.viewers or not all(math.isfinite(viewer.fps) for viewer in rig.viewers):
        raise TakeError(f"{path}: attachment {SETUP_FILE}: viewers: allowed: one or more")
    return rig
