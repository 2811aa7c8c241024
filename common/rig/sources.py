"""Types of `source` and `background` of a viewer in a rig file."""

import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal

from zenocap.common.errors import SourceError, UserError
from zenocap.common.rig.camera_settings import CameraSettings

BACKGROUNDS = "adaptive, first:N, first:SECONDSs, median, image:FILE, mog2"
FIRST, ADAPTIVE = "first:60", "adaptive"  # usual backgrounds of a video file or the simulated person, and of cameras
BARE_SUFFIXES = (".h264", ".264", ".h265", ".265", ".hevc", ".mjpeg", ".mjpg")
VIDEO_SUFFIXES = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg", ".ts", ".mts", ".m2ts", *BARE_SUFFIXES)
DISCOVER = "discover"  # scheme of an announced camera
MAX_FIRST = 10_000
MAX_EMPTY_PX = 1 << 32  # of all empty frames: 10,000 of 640x480, 2,071 of 1920x1080, 128 of 8K; chosen by hand
MAX_FIRST_S = 60.0  # s, of the empty scene; chosen by hand
ACTOR_FPS, IMAGES_FPS = 15.0, 30.0
USUAL_FPS = 30.0  # of a source whose rate is not known


class SpecError(UserError):
    """The text lists the allowed values."""


class Source(ABC):
    """The images of a viewer; each kind has a type and a row in the table of sources, see `source_kinds`.

    kind: name of the row.  live: whether it is a camera or stream that this machine opens, see `LiveSource`.
    ends: whether `zenocap track` takes it: every image comes once, as fast as it is asked for.
    finishes: whether it comes to an end in a live rig.
    background: that of a viewer whose table has none.
    """

    kind: ClassVar[str]
    live: ClassVar[bool] = False
    ends: ClassVar[bool] = True
    finishes: ClassVar[bool] = True
    background: ClassVar[str] = FIRST

    @property
    @abstractmethod
    def text(self) -> str:
        """As in a rig file; it may have a password."""

    @property
    def shown(self) -> str:
        """The text without a password."""
        return without_password(self.text)

    def missing(self) -> Mapping[str, str]:
        """What is wrong with its files, by key of the viewer's table."""
        return {}

    def own_fps(self) -> float | None:
        """Frames/s of a source that has a rate of its own; None: unknown.  Raises SourceError."""
        return None

    def own_size(self) -> tuple[int, int] | None:
        """(width, height) px of the images of files; None: unknown, or not readable, an error when they are used."""
        return None


@dataclass(frozen=True)
class LiveSource(Source):
    """A camera or stream: its images come without end, at their own times, and can be filmed.

    delay_ns: by which its images are older than their times say.
    buffers: whether images wait in it while it is opened, which are then left out.
    """

    delay_ns: int = field(default=0, kw_only=True)

    live: ClassVar[bool] = True
    ends: ClassVar[bool] = False
    finishes: ClassVar[bool] = False
    background: ClassVar[str] = ADAPTIVE
    buffers: ClassVar[bool] = False

    @property
    def title(self) -> str:
        """Name in messages to the user."""
        return self.shown

    @property
    def stamps(self) -> Literal["monotonic", "stream", "none"]:
        """Times of its images, CAP_PROP_POS_MSEC: of this machine's monotonic clock, of its own clock, or of no use."""
        return "none"


@dataclass(frozen=True)
class Device(LiveSource):
    """A camera of this machine: /dev/video`number`, or the one with the stable name `link`.

    number: None where `link` is given, a link of udev that is followed each time when the camera is opened.
    """

    number: int | None
    link: Path | None = None
    settings: CameraSettings = field(default_factory=CameraSettings)

    kind: ClassVar[str] = "device"

    @property
    def file(self) -> Path:
        """Device file, or the link to it."""
        return self.link or Path(f"/dev/video{self.number}")

    @property
    def text(self) -> str:
        return str(self.file)

    @property
    def title(self) -> str:
        if self.link is not None:
            return f"camera {self.link}"
        return f"camera {self.number} (/dev/video{self.number})" if sys.platform == "linux" else str(self.number)

    @property
    def stamps(self) -> Literal["monotonic", "stream", "none"]:
        return "monotonic" if sys.platform == "linux" else "none"


@dataclass(frozen=True)
class Stream(LiveSource):
    """A stream that FFmpeg opens."""

    url: str

    kind: ClassVar[str] = "stream"
    buffers: ClassVar[bool] = True

    @property
    def text(self) -> str:
        return self.url

    @property
    def stamps(self) -> Literal["monotonic", "stream", "none"]:
        """Only RTSP carries times of the camera; of images over HTTP, FFmpeg assumes a rate."""
        return "stream" if self.url.startswith("rtsp") else "none"


@dataclass(frozen=True)
class Announced(Source):
    """A camera that `zenocap viewer --discover` announces on another machine, under these names."""

    machine: str
    camera: str
    settings: CameraSettings = field(default_factory=CameraSettings)

    kind: ClassVar[str] = DISCOVER
    ends: ClassVar[bool] = False
    finishes: ClassVar[bool] = False
    background: ClassVar[str] = ADAPTIVE

    @property
    def text(self) -> str:
        return f"{DISCOVER}:{self.machine}/{self.camera}"


@dataclass(frozen=True)
class VideoFile(Source):
    """initial: a separate video of the T-pose, shown before the main one; None when that shows it.

    offset_ns: time of the first frame from that of the file of the rig that began first.
    hardware: whether it is decoded by hardware where that is possible.
    """

    path: Path
    initial: Path | None = None
    offset_ns: int = 0
    hardware: bool = False

    kind: ClassVar[str] = "video"

    @property
    def text(self) -> str:
        return str(self.path)

    def missing(self) -> Mapping[str, str]:
        files = {"source": self.path, "initial": self.initial}
        return {key: f"no file {file}" for key, file in files.items() if file is not None and not file.is_file()}

    def own_fps(self) -> float | None:
        from zenocap.common.video.reader import VideoReader  # only here: `--help` imports this module

        if not self.path.is_file():
            return None
        with VideoReader(self.path) as reader:
            return reader.fps

    def own_size(self) -> tuple[int, int] | None:
        from zenocap.common.video.reader import VideoReader

        if self.path.is_file():
            with suppress(SourceError), VideoReader(self.path) as reader:
                return reader.size
        return None


@dataclass(frozen=True)
class Images(Source):
    """All files of `folder` that match `pattern`, in the order of their names.  rated: whether the rig has their rate."""

    folder: Path
    pattern: str
    rated: bool = False

    kind: ClassVar[str] = "images"

    @property
    def text(self) -> str:
        return str(self.folder / self.pattern)

    def missing(self) -> Mapping[str, str]:
        return {} if self.files() else {"source": f"no file matches {self.text}"}

    def files(self) -> list[Path]:
        """The pictures, unsorted, without the files ._NAME that macOS writes beside others."""
        return [path for path in self.folder.glob(self.pattern) if not path.name.startswith("._") and path.is_file()]

    def own_fps(self) -> float | None:
        return IMAGES_FPS

    def own_size(self) -> tuple[int, int] | None:
        import cv2  # which turns a picture as its EXIF data says, also when it is used

        first = min(self.files(), default=None)
        with suppress(cv2.error):
            image = None if first is None else cv2.imread(str(first))
            return None if image is None else (image.shape[1], image.shape[0])
        return None


@dataclass(frozen=True)
class Actor(Source):
    """The simulated person: the demo motion, or one motion or posture repeated."""

    name: str
    seed: int

    kind: ClassVar[str] = "actor"
    finishes: ClassVar[bool] = False

    @property
    def text(self) -> str:
        return f"actor:{self.name}?seed={self.seed}"

    def own_fps(self) -> float | None:
        return ACTOR_FPS


@dataclass(frozen=True)
class Rendered(Source):
    """NumPy file of frames, (count, height, width, 3) uint8 BGR at `fps`, played forwards and backwards in a loop."""

    path: Path
    fps: float

    kind: ClassVar[str] = "rendered"
    finishes: ClassVar[bool] = False

    @property
    def text(self) -> str:
        return f"rendered:{self.path}?fps={self.fps!r}"

    def missing(self) -> Mapping[str, str]:
        return {} if self.path.is_file() else {"source": f"no file {self.path}"}

    def own_fps(self) -> float | None:
        return self.fps


@dataclass(frozen=True)
class FirstFrames:
    """The scene is empty in the first `count` frames."""

    count: int


def most_first(size: tuple[int, int]) -> int:
    """Largest number of empty frames of this size, (width, height) px."""
    return max(1, min(MAX_FIRST, MAX_EMPTY_PX // (size[0] * size[1])))


@dataclass(frozen=True)
class FirstSeconds:
    """The scene is empty in the first `seconds`, whatever the frame rate."""

    seconds: float

    def at_rate(self, fps: float) -> FirstFrames:
        """The whole frame periods in that time."""
        return FirstFrames(min(MAX_FIRST, max(1, int(self.seconds * fps + 1e-6))))


@dataclass(frozen=True)
class MedianFrames:
    """The median of frames sampled over the whole source."""


@dataclass(frozen=True)
class BackgroundImage:
    """A picture, or the median of a video.  hardware: see `VideoFile`."""

    path: Path
    hardware: bool = False


@dataclass(frozen=True)
class Mog2:
    """OpenCV's adaptive mixture of Gaussians."""


@dataclass(frozen=True)
class AdaptiveBackground:
    """A model that needs no empty room and follows changes of light and furniture."""


def empty_frames(background: "Background") -> int:
    """Number of first frames that show the empty scene; 0 where the background does not define them."""
    return background.count if isinstance(background, FirstFrames) else 0


def first_text(frames: int | None, seconds: float | None) -> str | None:
    """`background` of a rig file for a scene that is empty in the first `frames` or `seconds`; None for neither.

    Raises SpecError for both.
    """
    if frames and seconds:
        raise SpecError(f"empty_frames = {frames} and empty_seconds = {seconds:g}: allowed: one of them")
    return f"first:{seconds:g}s" if seconds else f"first:{frames}" if frames else None


def learning_frames(background: "Background") -> int:
    """Number of frames at the start from which a viewer learns the background; it publishes no results for them."""
    match background:
        case FirstFrames(count=count):
            return count
        case BackgroundImage():
            return 5
        case _:
            return 60


Background = FirstFrames | MedianFrames | BackgroundImage | Mog2 | AdaptiveBackground
# `mog2` stays beside `adaptive`: users compare silhouettes with the mixture model that [Hybrid III] has.
PLAIN_BACKGROUNDS: Mapping[Literal["adaptive", "median", "mog2"], Background] = {  # by their texts in a rig file
    "adaptive": AdaptiveBackground(), "median": MedianFrames(), "mog2": Mog2(),
}  # fmt: skip


def without_password(url: str) -> str:
    """The address of a stream as it may be shown, also of a wrong one, and of one after the name of its kind."""
    return re.sub(r"^((?:[a-z][a-z0-9+.\-]*:)+?/*)[^/]*@", r"\1", url, flags=re.IGNORECASE)


def parse_background(text: str, base: Path, fps: float = USUAL_FPS, size: tuple[int, int] | None = None) -> Background:
    """Parse the `background` of a rig file in the folder `base`.  fps, size: of the images.  Raises SpecError."""
    kind, _, rest = text.partition(":")
    match kind:
        case "first":
            found = _parse_first(rest, fps)
            if size is not None and found.count > (most := most_first(size)):
                raise SpecError(f"first:N with N from 1 to {most} at {size[0]} x {size[1]} px")
            return found
        case "image" if rest:
            return BackgroundImage(base / rest)
        case "median" | "adaptive" | "mog2" if not rest:
            return PLAIN_BACKGROUNDS[kind]
    raise SpecError(BACKGROUNDS)


def _parse_first(text: str, fps: float) -> FirstFrames:
    if re.fullmatch(r"\d{1,5}", text) and 1 <= int(text) <= MAX_FIRST:
        return FirstFrames(int(text))
    if re.fullmatch(r"\d{1,2}(\.\d+)?s", text) and 0 < float(text[:-1]) <= MAX_FIRST_S:
        return FirstSeconds(float(text[:-1])).at_rate(fps)
    raise SpecError(
        f"first:N with N from 1 to {MAX_FIRST} frames, or first:SECONDSs up to {MAX_FIRST_S:g}, such as first:2s"
    )
