"""Setup and states of a viewer."""

from dataclasses import dataclass, field

from zenocap.common.arrays import Floats, Image, Mask
from zenocap.common.body.anatomy import TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.camera.level_view import LevelView, level_view
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Assignment
from zenocap.common.rig.sources import AdaptiveBackground, BackgroundImage, FirstFrames, MedianFrames, Mog2
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.common.vision.background import Background
from zenocap.common.vision.mixture import Mixture
from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.advice.watch import Watch
from zenocap.services.viewer.feedback import NO_FEEDBACK, Feedback
from zenocap.services.viewer.people.segmenter import PeopleSegmenter
from zenocap.services.viewer.two_view.body_fit import BodyModel, camera_rows

BackgroundSpec = FirstFrames | MedianFrames | BackgroundImage | Mog2 | AdaptiveBackground


@dataclass(frozen=True)
class Setup:
    """Setup of a viewer.

    camera: at the working size.  rows: (5, 3) of the level view.  plate: image of an image background, or None.
    additions: to the paper, see `zenocap.common.rig.two_view`.  people: network that corrects the silhouettes, or None; it
    is no value, for it works in a thread: only `segment` uses it.  kept: background of an earlier run, or None.
    """

    id: str
    camera: Camera
    level: LevelView
    rows: Floats
    background: BackgroundSpec
    publish_silhouette: bool
    publish_preview: bool
    anatomy: Anatomy
    plate: Image | None
    additions: Additions = IMPROVED
    people: PeopleSegmenter | None = None
    kept: Adaptive | None = None


def viewer_setup(
    id: str,
    camera: Camera,
    background: BackgroundSpec,
    publish_silhouette: bool,
    publish_preview: bool = False,
    plate: Image | None = None,
    anatomy: Anatomy = TEN_PARTS,
    additions: Additions = IMPROVED,
    people: PeopleSegmenter | None = None,
    kept: Adaptive | None = None,
) -> Setup:
    """Setup of a viewer.  plate: (height, width, 3) at the working size, for an image background.

    additions: to the paper, see `zenocap.common.rig.two_view`.
    Raises ValueError for a camera that looks straight up or down, or an image background without its plate.
    """
    if isinstance(background, BackgroundImage) and plate is None:
        raise ValueError(f"viewer {id}: background image {background.path} is missing")
    level = level_view(camera)
    return Setup(
        id, camera, level, camera_rows(level.camera), background, publish_silhouette, publish_preview, anatomy, plate,
        additions, people, kept,
    )  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """Background model and last extents of the person.

    background: None where silhouettes come from a take.  preview_ns: capture time of the last preview.
    watch: measures for the advice.  restored: whether the background is that of an earlier run.
    Mutable objects in a state: a `Mixture`, and the arrays of an `Adaptive`.  OpenCV gives no access to its model, and
    copies of the arrays would cost more than the silhouette.
    """

    background: Background | Mixture | Adaptive | None
    extents: Extents | None = None
    preview_ns: int = -(10**18)
    watch: Watch = field(default_factory=Watch)
    restored: bool = False


@dataclass(frozen=True)
class LearningBackground:
    """Collecting images of the scene, None for those not in the take.  bdp: universal BDP, None before one arrives.

    feedback: of the tracker, where the rig has one.
    """

    frames: tuple[Image | None, ...] = ()
    bdp: Bdp | None = None
    feedback: Feedback = NO_FEEDBACK


@dataclass(frozen=True)
class Pending:
    """A frame whose sighting is published and whose assignment is awaited.

    mask: (height, width) in the level view.  model: body of the sighting; None before a body is known.
    ray: slopes x and y of the sighting.
    """

    frame: int
    captured_ns: int
    mask: Mask
    model: BodyModel | None = None
    ray: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class EarlyPose:
    """A universal BAP, of frame `based_on`, that arrived before its universal BDP."""

    pose: Pose
    based_on: int


@dataclass(frozen=True)
class MeasuringBody:
    """Waiting for the T-pose, measuring it, or waiting for the pose of a known body.

    The assignments of the integrator decide which.  bdp: last universal BDP, None before one arrives.
    advice: health text.
    """

    scene: Scene
    bdp: Bdp | None = None
    pending: Pending | None = None
    advice: str = "waiting for a person"
    early: EarlyPose | None = None


@dataclass(frozen=True)
class Tracking:
    """Tracking a person.

    bdp, model: universal body.  pose, based_on: of the last universal BAP, and its frame.
    assignment: the last one that was answered.  usual_score: matching score that this person usually reaches in this view.
    lost: the score of the last frame was much lower and its limbs were searched all around.
    placed_ns: capture time of this viewer's frame at the last assignment.
    """

    scene: Scene
    bdp: Bdp
    model: BodyModel
    pose: Pose
    based_on: int = -1
    assignment: Assignment | None = None
    pending: Pending | None = None
    usual_score: float = 0.0
    lost: bool = False
    placed_ns: int | None = None


State = LearningBackground | MeasuringBody | Tracking
