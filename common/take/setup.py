"""What the steps of a rig were set up with, as a file in its take, so that they can be run again without the rig."""

import hashlib
import math
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from common.camera.pinhole import Camera
from common.messages import Name, Number, Size
from common.runtime.recognizer_table import Source, Strictness
from common.runtime.rig import Rig, RigError
from common.runtime.specs import learning_frames
from common.runtime.tracker_table import Iterations, Particles, Points, Seed
from common.take.reading import TakeError

SETUP_FILE = "setup.json"
PRIOR_FILE = "tracker.prior"  # attachments
POSTURES_FILE = "recognizer.postures"
Digest = Annotated[str, Meta(pattern=r"^[0-9a-f]{64}$")]  # SHA-256


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


class RecordedTracker(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """As in `common.runtime.tracker_table`.  prior_sha256: of the prior's file, None without one."""

    prior_sha256: Digest | None
    particles: Particles
    points: Points
    iterations: Iterations
    seed: Seed
    anatomy: Name
    refinement: Name


class RecordedRecognizer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """As in `common.runtime.recognizer_table`.  model_sha256: of the model's file, None where it is not at hand."""

    model_sha256: Digest | None
    source: Source
    strictness: Strictness


class RecordedRig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """person_height: metres, of a person who was not measured.  tracker, recognizer: None for a rig without one."""

    name: Name
    method: Name
    person_height: Size | None
    viewers: Annotated[list[RecordedViewer], Meta(max_length=64)]
    tracker: RecordedTracker | None = None
    recognizer: RecordedRecognizer | None = None

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
    return RecordedRig(
        name=rig.name,
        method=rig.method,
        person_height=rig.person_height,
        viewers=viewers,
        tracker=_tracker(rig),
        recognizer=_recognizer(rig),
    )


def prior_of(rig: Rig) -> bytes | None:
    """The content of the prior's file; None without one, or where it lies on another machine.  Raises RigError."""
    return _content(rig.tracker.prior if rig.tracker else None)


def postures_of(rig: Rig) -> bytes | None:
    """The content of the recogniser's model; None without one, or where it lies elsewhere.  Raises RigError."""
    return _content(rig.recognizer.model if rig.recognizer else None)


def _content(path: Path | None) -> bytes | None:
    if path is None or not path.is_file():
        return None
    try:
        return path.read_bytes()
    except OSError as error:
        raise RigError(f"{path}: cannot be read: {error.strerror}") from error


def _tracker(rig: Rig) -> RecordedTracker | None:
    if rig.tracker is None:
        return None
    return RecordedTracker(
        prior_sha256=_digest(prior_of(rig)),
        particles=rig.tracker.particles,
        points=rig.tracker.points,
        iterations=rig.tracker.iterations,
        seed=rig.tracker.seed,
        anatomy=rig.tracker.anatomy,
        refinement=rig.tracker.refinement,
    )


def _recognizer(rig: Rig) -> RecordedRecognizer | None:
    if rig.recognizer is None:
        return None
    return RecordedRecognizer(
        model_sha256=_digest(postures_of(rig)), source=rig.recognizer.source, strictness=rig.recognizer.strictness
    )


def _digest(content: bytes | None) -> str | None:
    return None if content is None else hashlib.sha256(content).hexdigest()


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
