"""Setup and states of the segmentation, which every viewer has."""

from dataclasses import dataclass, field

from zenocap.common.arrays import Image
from zenocap.common.camera.pinhole import Camera
from zenocap.common.rig.sources import AdaptiveBackground, BackgroundImage, FirstFrames, MedianFrames, Mog2
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.common.vision.background import Background
from zenocap.common.vision.mixture import Mixture
from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.advice.watch import AdviceWatch
from zenocap.services.viewer.parameters import SMALL_PERSON
from zenocap.services.viewer.people.segmenter import PeopleSegmenter


@dataclass(frozen=True)
class ViewerSetup:
    """camera: at the working size.  plate: (height, width, 3) of an image background, at the working size.

    people: network that corrects the silhouettes, or None; no value, for it works in a thread: only `segment` uses it.
    kept: background of an earlier run, or None.  small_px: height below which a person is too small.
    Raises ValueError for an image background without its plate.
    """

    id: str
    camera: Camera
    background: FirstFrames | MedianFrames | BackgroundImage | Mog2 | AdaptiveBackground
    publish_preview: bool = False
    plate: Image | None = None
    people: PeopleSegmenter | None = None
    kept: Adaptive | None = None
    small_px: float = SMALL_PERSON

    def __post_init__(self) -> None:
        if isinstance(self.background, BackgroundImage) and self.plate is None:
            raise ValueError(f"viewer {self.id}: background image {self.background.path} is missing")


@dataclass(frozen=True)
class Segmentation:
    """Background model and last extents of the person.

    background: None where silhouettes come from a take.  preview_ns: capture time of the last preview.
    watch: measures for the advice.  restored: whether the background is that of an earlier run.
    Mutable objects in a state: a `Mixture`, and the arrays of an `Adaptive`.  OpenCV gives no access to its model, and
    copies of the arrays would cost more than the silhouette.
    """

    background: Background | Mixture | Adaptive | None
    extents: Extents | None = None
    preview_ns: int = -(10**18)
    watch: AdviceWatch = field(default_factory=AdviceWatch)
    restored: bool = False


@dataclass(frozen=True)
class LearningBackground:
    """Collecting images of the scene.

    images: every `stride`-th frame of those `seen`, without those that are not in the take.
    """

    images: tuple[Image, ...] = ()
    seen: int = 0
    stride: int = 1
