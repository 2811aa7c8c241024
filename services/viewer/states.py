"""A viewer's setup and the phases it goes through, as types."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import TEN_PARTS, Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.camera.level import LevelView, level_view
from common.camera.pinhole import Camera
from common.messages import Assignment
from common.runtime.specs import BackgroundImage, FirstFrames, MedianFrames, Mog2
from common.vision.background import Background
from common.vision.mixture import Mixture
from common.vision.silhouette import Extents
from services.viewer.body_fit import BodyFit, BodyModel, camera_rows

BackgroundSpec = FirstFrames | MedianFrames | BackgroundImage | Mog2
Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]


@dataclass(frozen=True)
class Setup:
    """camera: at the working size.  rows: (5, 3) of the level view.  plate: the picture of an image background."""

    id: str
    camera: Camera
    level: LevelView
    rows: Floats
    background: BackgroundSpec
    publish_silhouette: bool
    publish_preview: bool
    anatomy: Anatomy
    plate: Image | None


def viewer_setup(
    id: str,
    camera: Camera,
    background: BackgroundSpec,
    publish_silhouette: bool,
    publish_preview: bool = False,
    plate: Image | None = None,
    anatomy: Anatomy = TEN_PARTS,
) -> Setup:
    """plate: (height, width, 3) at the working size, for an image background.

    Raises ValueError for a camera that looks straight up or down, or an image background without its plate.
    """
    if isinstance(background, BackgroundImage) and plate is None:
        raise ValueError(f"viewer {id}: background image {background.path} was not read")
    level = level_view(camera)
    return Setup(
        id, camera, level, camera_rows(level.camera), background, publish_silhouette, publish_preview, anatomy, plate
    )


@dataclass(frozen=True)
class Seen:
    """What this viewer knows of the scene: its background model and where the person last was.

    background: None where silhouettes come from a take.  preview_ns: capture time of the last preview.
    """

    background: Background | Mixture | None
    extents: Extents | None = None
    preview_ns: int = -(10**18)


@dataclass(frozen=True)
class LearningBackground:
    """Collecting frames of the scene; None for one whose picture is not in the take.  bdp: the universal body, if known."""

    frames: tuple[Image | None, ...] = ()
    bdp: Bdp | None = None


@dataclass(frozen=True)
class Pending:
    """A frame whose sighting is out and whose assignment is awaited."""

    frame: int
    captured_ns: int
    mask: Mask
    fit: BodyFit | None = None


@dataclass(frozen=True)
class Early:
    """A universal BAP, of frame `based_on`, that came before its body."""

    pose: Pose
    based_on: int


@dataclass(frozen=True)
class MeasuringBody:
    """Waiting for the initial posture, measuring it, or waiting for the integrator to go on with a body that is known.

    The integrator's assignments say which.  bdp: the universal body said last, None if none was heard.
    """

    seen: Seen
    bdp: Bdp | None = None
    pending: Pending | None = None
    advice: str = "waiting for a person"
    early: Early | None = None


@dataclass(frozen=True)
class Tracking:
    """bdp, model: the universal body.  pose: of the universal BAP last received, of frame `based_on`, with the one before.

    typical: the matching score that this person usually reaches in this view.  lost: the last frame fell short of it and
    was searched widely.  placed_ns: when it was last assigned a place, by the capture time of its own newest frame.
    """

    seen: Seen
    bdp: Bdp
    model: BodyModel
    pose: Pose
    before: Pose
    based_on: int = -1
    assignment: Assignment | None = None
    pending: Pending | None = None
    typical: float = 0.0
    score: float = 0.0
    lost: bool = False
    placed_ns: int | None = None


State = LearningBackground | MeasuringBody | Tracking
