"""Setup and states of a two-view viewer."""

from dataclasses import dataclass
from functools import cached_property

from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.camera.level_view import LevelView, level_view
from zenocap.common.messages import Assignment
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.services.viewer.states import LearningBackground, Segmentation, ViewerSetup
from zenocap.services.viewer.two_view.body_fit import PersonSizes, camera_rows


@dataclass(frozen=True)
class TwoViewSetup(ViewerSetup):
    """additions: to the paper, see `zenocap.common.rig.two_view`."""

    publish_silhouette: bool = False
    anatomy: Anatomy = TEN_PARTS
    additions: Additions = IMPROVED

    @cached_property
    def level(self) -> LevelView:
        return level_view(self.camera)

    @cached_property
    def rows(self) -> Floats:
        """(5, 3) of the level view, see `camera_rows`."""
        return camera_rows(self.level.camera)


@dataclass(frozen=True)
class LearningWithBody(LearningBackground):
    """bdp: universal BDP, None before one arrives."""

    bdp: Bdp | None = None


@dataclass(frozen=True)
class Pending:
    """A frame whose sighting is published and whose assignment is awaited.

    mask: (height, width) in the level view.  model: body of the sighting; None before a body is known.
    ray: slopes x and y of the sighting.
    """

    frame: int
    captured_ns: int
    mask: Mask
    model: PersonSizes | None = None
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

    scene: Segmentation
    bdp: Bdp | None = None
    pending: Pending | None = None
    advice: str = "waiting for a person"
    early: EarlyPose | None = None


@dataclass(frozen=True)
class TrackingBody:
    """Tracking a person.

    bdp, model: universal body.  pose, based_on: of the last universal BAP, and its frame.
    assignment: the last one that was answered.  usual_score: matching score that this person usually reaches in this view.
    lost: the score of the last frame was much lower and its limbs were searched all around.
    placed_ns: capture time of this viewer's frame at the last assignment.
    """

    scene: Segmentation
    bdp: Bdp
    model: PersonSizes
    pose: Pose
    based_on: int = -1
    assignment: Assignment | None = None
    pending: Pending | None = None
    usual_score: float = 0.0
    lost: bool = False
    placed_ns: int | None = None


TwoViewState = LearningWithBody | MeasuringBody | TrackingBody
