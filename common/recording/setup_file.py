"""Attachments with which a take is recomputed: setup, prior, posture model, parameters; video notes."""

import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import msgspec
import numpy as np
from msgspec import UNSET, Meta, UnsetType

from zenocap.common.body.anatomy import ANATOMIES, Anatomy
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError, reading
from zenocap.common.messages import Name, Number, Size
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.recognizer import Source, Strictness
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.sources import learning_frames
from zenocap.common.rig.tracker import DEFAULT_FILTER, FilterOptions, Heading, Iterations, Particles, Points, Seed
from zenocap.common.rig.two_view import IMPROVED, Additions

SETUP_FILE = "setup.json"  # names of attachments
PARAMETERS_FILE = "parameters.json"
PRIOR_FILE = "tracker.prior"
POSTURES_FILE = "recognizer.postures"
VIDEO_NOTES = "videos"  # name of metadata: by viewer, what its video states and does not hold, see `VideoSummary`

Parameters: TypeAlias = Mapping[str, Mapping[str, object]]
"""By service and name: values of the services' `parameters.py`, as JSON has them."""

Digest = Annotated[str, Meta(pattern=r"^[0-9a-f]{64}$")]  # SHA-256


class RecordedViewer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """camera: at the working size, in the Y-up world; see `zenocap.common.messages.CameraInfo`.

    learning_frames: number of frames at the start without messages.  silhouette: whether silhouettes are published.
    delay_ns: by which capture times were corrected (`delay_ms`); left out of the file where it is 0.
    """

    id: Name
    camera: Name
    size: tuple[Annotated[int, Meta(ge=1, le=16384)], Annotated[int, Meta(ge=1, le=16384)]]
    matrix: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    distortions: Annotated[list[Number], Meta(max_length=14)]
    rotation: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    translation: Annotated[list[Number], Meta(min_length=3, max_length=3)]
    fps: Annotated[float, Meta(ge=1e-3, le=1e4)]
    learning_frames: Annotated[int, Meta(ge=0, le=100_000)]
    silhouette: bool
    delay_ns: Annotated[int, Meta(ge=0, le=10_000_000_000)] | UnsetType = UNSET

    def pinhole(self) -> Camera:
        matrix, rotation = (np.array(values).reshape(3, 3) for values in (self.matrix, self.rotation))
        return Camera(self.camera, self.size, matrix, np.array(self.distortions), rotation, np.array(self.translation))


class RecordedTurn(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """As `zenocap.services.tracker.states.Turn`."""

    captured_ns: int
    front: tuple[Number, Number, Number]


class RecordedTracker(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """As in `zenocap.common.rig.tracker`.  prior_sha256: of the prior's file, None without one.

    front: viewer.  heading: degrees.  turns: of `zenocap mirror`.  They are left out of the file where they are not set.
    """

    prior_sha256: Digest | None
    particles: Particles
    points: Points
    iterations: Iterations
    seed: Seed
    anatomy: Name
    refinement: Name
    filter: FilterOptions = DEFAULT_FILTER
    front: Name | UnsetType = UNSET
    heading: Heading | UnsetType = UNSET
    turns: Annotated[list[RecordedTurn], Meta(max_length=1000)] | UnsetType = UNSET


class RecordedRecognizer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """As in `zenocap.common.rig.recognizer`.  model_sha256: of the model's file, None when the file is not available."""

    model_sha256: Digest | None
    source: Source
    strictness: Strictness


class RecordedRig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """person_height: metres, of an average body until the T-pose.  tracker, recognizer: None for a rig without one.

    additions: to the paper's two-view method; None for all of them.
    delays: as in the rig file; left out of the file for "report".
    """

    name: Name
    method: Name
    person_height: Size | None
    viewers: Annotated[list[RecordedViewer], Meta(max_length=64)]
    tracker: RecordedTracker | None = None
    recognizer: RecordedRecognizer | None = None
    additions: Annotated[list[Name], Meta(max_length=64)] | None = None
    delays: Literal["off", "report", "follow"] | UnsetType = UNSET

    def added(self) -> Additions:
        """Additions to the paper's two-view method."""
        return IMPROVED if self.additions is None else frozenset(self.additions)

    def cameras(self) -> dict[str, Camera]:
        """Cameras by viewer, in the order of the rig."""
        return {viewer.id: viewer.pinhole() for viewer in self.viewers}

    def frame_ns(self) -> int:
        """Frame period of the slowest viewer."""
        return round(1e9 / min(viewer.fps for viewer in self.viewers))

    def anatomy(self) -> Anatomy:
        """Anatomy of the tracked body.  Raises ValueError."""
        name = self.tracker.anatomy if self.tracker else ""
        if name not in ANATOMIES:
            raise ValueError(f"tracker.anatomy = {name!r}: allowed: {', '.join(ANATOMIES)}")
        return ANATOMIES[name]


def recorded_rig(rig: Rig) -> RecordedRig:
    """The part of a rig on which the results of its steps depend."""
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
            delay_ns=viewer.delay_ns or UNSET,
        )
        for viewer in rig.viewers
    ]
    return RecordedRig(
        name=rig.name, method=rig.method, person_height=rig.person_height, viewers=viewers, tracker=_tracker(rig),
        recognizer=_recognizer(rig), additions=None if rig.additions == IMPROVED else sorted(rig.additions),
        delays=UNSET if rig.delays == "report" else rig.delays,
    )  # fmt: skip


def prior_of(rig: Rig) -> bytes | None:
    """Content of the prior's file; None without one, or when it is on another machine.  Raises UserError."""
    return _content(rig.tracker.prior if rig.tracker else None)


def postures_of(rig: Rig) -> bytes | None:
    """Content of the recognizer's model file; None without one, or when it is on another machine.  Raises UserError."""
    return _content(rig.recognizer.model if rig.recognizer else None)


def _content(path: Path | None) -> bytes | None:
    if path is None or not path.is_file():
        return None
    with reading(path):
        return path.read_bytes()


def _tracker(rig: Rig) -> RecordedTracker | None:
    if rig.tracker is None:
        return None
    return RecordedTracker(
        prior_sha256=_digest(prior_of(rig)), particles=rig.tracker.particles, points=rig.tracker.points,
        iterations=rig.tracker.iterations, seed=rig.tracker.seed, anatomy=rig.tracker.anatomy,
        refinement=rig.tracker.refinement, filter=rig.tracker.filter,
        front=UNSET if rig.tracker.front is None else rig.tracker.front,
        heading=UNSET if rig.tracker.heading is None else rig.tracker.heading,
    )  # fmt: skip


def _recognizer(rig: Rig) -> RecordedRecognizer | None:
    if rig.recognizer is None:
        return None
    return RecordedRecognizer(
        model_sha256=_digest(postures_of(rig)), source=rig.recognizer.source, strictness=rig.recognizer.strictness
    )


def _digest(content: bytes | None) -> str | None:
    return None if content is None else hashlib.sha256(content).hexdigest()


def write_setup(rig: RecordedRig) -> bytes:
    """JSON from which all numbers are read back exactly."""
    return msgspec.json.format(msgspec.json.encode(rig), indent=1)


def read_setup(path: Path, data: bytes) -> RecordedRig:
    """Decode the setup of a take.  path: of the take, for errors.  Raises UserError."""
    try:
        rig = msgspec.json.decode(data, type=RecordedRig)
    except (msgspec.MsgspecError, ValueError) as error:
        raise UserError(f"{path}: attachment {SETUP_FILE}: {error}") from error
    if not rig.viewers or not all(math.isfinite(viewer.fps) for viewer in rig.viewers):
        raise UserError(f"{path}: attachment {SETUP_FILE}: viewers: allowed: one or more")
    return rig


def setup_of(path: Path) -> RecordedRig | None:
    """The rig of a take from the attachment that it begins with; None for a take without one.  Raises UserError."""
    take = TakeReader(path)
    next(take.messages(), None)  # attachments come before the first message
    return read_setup(path, take.attachments[SETUP_FILE]) if SETUP_FILE in take.attachments else None


def checked_attachment(path: Path, name: str, content: bytes | None, digest: str | None) -> bytes | None:
    """Content of an attachment; None where the setup has no digest of it.  path: of the take.

    Raises UserError when it is missing, ValueError when it is another than the recorded one.
    """
    if digest is None:
        return None
    if content is None:
        raise UserError(f"{path}: attachment {name} is missing: the take cannot be recomputed")
    found = hashlib.sha256(content).hexdigest()
    if found != digest:
        raise ValueError(f"{path}: attachment {name}: sha256 = {found[:12]}...: allowed: {digest[:12]}..., as recorded")
    return content


def write_parameters(parameters: Parameters) -> bytes:
    """JSON with sorted keys: equal parameters give equal bytes."""
    return msgspec.json.format(msgspec.json.encode(parameters, order="sorted"), indent=1)


def read_parameters(path: Path, data: bytes) -> dict[str, dict[str, object]]:
    """Parameters by service and name.  path: of the take, for errors.  Raises UserError."""
    try:
        return msgspec.json.decode(data, type=dict[str, dict[str, object]])
    except (msgspec.MsgspecError, ValueError) as error:
        raise UserError(f"{path}: attachment {PARAMETERS_FILE}: {error}") from error
