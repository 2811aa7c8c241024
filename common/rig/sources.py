"""Parsing of `source` and `background` of a viewer in a rig file into types."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

from zenocap.common.errors import UserError
from zenocap.common.rig.camera_settings import CameraSettings

SOURCES = (
    "a device number, /dev/videoN, /dev/v4l/by-id/NAME, rtsp://, http:// or https://, a video file, images/*.png, "
    "actor:NAME[?seed=N], rendered:FILE.npy[?fps=N], discover:MACHINE/CAMERA"
)
BACKGROUNDS = "adaptive, first:N, median, image:FILE, mog2"
FIRST = "first:60"  # background of a video file or the simulated person; of cameras and streams: adaptive
VIDEO_SUFFIXES = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg")
STREAMS = ("rtsp", "rtsps", "http", "https")
DISCOVER = "discover"  # scheme of an announced camera
STABLE_NAMES = ("/dev/v4l/by-id/", "/dev/v4l/by-path/")
ANNOUNCED = r"[A-Za-z0-9_\-][A-Za-z0-9_.\-]{0,63}"  # names of machines and their cameras
MAX_DEVICE = 99
MAX_SEED = 2**31 - 1
MAX_FIRST = 10_000
RENDERED_FPS, MAX_RENDERED_FPS = 30.0, 1000.0


class SpecError(UserError):
    """The text lists the allowed values."""


@dataclass(frozen=True)
class Device:
    """A camera of this machine: /dev/video`number`, or the one with the stable name `link`.

    number: None where `link` is given, a link of udev that is followed each time when the camera is opened.
    delay_ns: by which its images are older than their times say.
    """

    number: int | None
    link: Path | None = None
    settings: CameraSettings = field(default_factory=CameraSettings)
    delay_ns: int = 0

    @property
    def file(self) -> Path:
        """Device file, or the link to it."""
        return self.link or Path(f"/dev/video{self.number}")


@dataclass(frozen=True)
class Stream:
    """delay_ns: age of its images beyond their times."""

    url: str
    delay_ns: int = 0


@dataclass(frozen=True)
class Announced:
    """A camera that `zenocap viewer --discover` announces on another machine, under these names."""

    machine: str
    camera: str
    settings: CameraSettings = field(default_factory=CameraSettings)

    @property
    def text(self) -> str:
        """As in a rig file."""
        return f"{DISCOVER}:{self.machine}/{self.camera}"


@dataclass(frozen=True)
class VideoFile:
    """initial: a separate video of the T-pose, shown before the main one; None when that shows it.

    offset_ns: time of the first frame from that of the file of the rig that began first.
    hardware: whether it is decoded by hardware where that is possible.
    """

    path: Path
    initial: Path | None = None
    offset_ns: int = 0
    hardware: bool = False


@dataclass(frozen=True)
class Images:
    """All files of `folder` that match `pattern`, in the order of their names."""

    folder: Path
    pattern: str


@dataclass(frozen=True)
class Actor:
    """The simulated person: the demo motion, or one motion or posture repeated."""

    name: str
    seed: int


@dataclass(frozen=True)
class Rendered:
    """NumPy file of frames, (count, height, width, 3) uint8 BGR at `fps`, played forwards and backwards in a loop."""

    path: Path
    fps: float


@dataclass(frozen=True)
class FirstFrames:
    """The scene is empty in the first `count` frames."""

    count: int


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


def learning_frames(background: "Background") -> int:
    """Number of frames at the start from which a viewer learns the background; it publishes no results for them."""
    match background:
        case FirstFrames(count=count):
            return count
        case BackgroundImage():
            return 5
        case _:
            return 60


Source = Device | Stream | Announced | VideoFile | Images | Actor | Rendered
Background = FirstFrames | MedianFrames | BackgroundImage | Mog2 | AdaptiveBackground


def without_password(url: str) -> str:
    """The address of a stream as it may be shown, also of a wrong one."""
    return re.sub(r"^([a-z]+:/*)[^/]*@", r"\1", url, flags=re.IGNORECASE)


def parse_source(text: str | int, base: Path) -> Source:
    """Parse the `source` of a rig file in the folder `base`.  Raises SpecError."""
    if isinstance(text, int) or text.isdecimal():
        return _device(int(text))
    if text.startswith("/dev/video"):
        number = text.removeprefix("/dev/video")
        if not number.isdecimal():
            raise SpecError("/dev/video0 and so on")
        return _device(int(number))
    if text.startswith("/dev/"):
        if not text.startswith(STABLE_NAMES) or text.endswith("/") or ".." in Path(text).parts:
            raise SpecError("/dev/videoN, /dev/v4l/by-id/NAME or /dev/v4l/by-path/NAME, as `zenocap cameras` lists them")
        return Device(None, Path(text))
    parts = urlsplit(text)
    if parts.scheme in STREAMS:
        if not parts.netloc:
            raise SpecError(f"{parts.scheme}://HOST/...")
        return Stream(text)
    if parts.scheme == "actor":
        return _actor(parts.path, parts.query)
    if parts.scheme == "rendered":
        return _rendered(parts.path, parts.query, base)
    if text.startswith(f"{DISCOVER}:"):
        return _announced(text.removeprefix(f"{DISCOVER}:"))
    if not text.strip() or "://" in text:
        raise SpecError(SOURCES)
    path = base / text
    if any(mark in path.name for mark in "*?["):
        return Images(path.parent, path.name)
    return VideoFile(path)


def default_background(source: Source) -> str:
    """`background` of a source without one: a camera's room changes, and is not always empty when a viewer starts."""
    return "adaptive" if isinstance(source, Device | Stream | Announced) else FIRST


def parse_background(text: str, base: Path) -> Background:
    """Parse the `background` of a rig file in the folder `base`.  Raises SpecError."""
    kind, _, rest = text.partition(":")
    match kind:
        case "first" if rest.isdecimal() and 1 <= int(rest) <= MAX_FIRST:
            return FirstFrames(int(rest))
        case "first":
            raise SpecError(f"first:N with N from 1 to {MAX_FIRST} frames")
        case "image" if rest:
            return BackgroundImage(base / rest)
        case "median" if not rest:
            return MedianFrames()
        case "adaptive" if not rest:
            return AdaptiveBackground()
        case "mog2" if not rest:
            return Mog2()
    raise SpecError(BACKGROUNDS)


def _device(number: int) -> Device:
    if not 0 <= number <= MAX_DEVICE:
        raise SpecError(f"a device number from 0 to {MAX_DEVICE}")
    return Device(number)


def _announced(text: str) -> Announced:
    machine, _, camera = text.partition("/")
    if not (re.fullmatch(ANNOUNCED, machine) and re.fullmatch(ANNOUNCED, camera)):
        raise SpecError("discover:MACHINE/CAMERA, as `zenocap cameras --discover` lists them")
    return Announced(machine, camera)


def _actor(name: str, query: str) -> Actor:
    options = dict(parse_qsl(query, keep_blank_values=True))
    seed = options.pop("seed", "0")
    if not name or options or not seed.isdecimal() or int(seed) > MAX_SEED:
        names = "demo, walking, turning, running, boxing or a posture"
        raise SpecError(f"actor:NAME or actor:NAME?seed=N, NAME {names}, N to {MAX_SEED}")
    return Actor(name, int(seed))


def _rendered(name: str, query: str, base: Path) -> Rendered:
    options = dict(parse_qsl(query, keep_blank_values=True))
    try:
        fps = float(options.pop("fps", str(RENDERED_FPS)))
    except ValueError:
        fps = 0.0
    if not name.endswith(".npy") or options or not 0 < fps <= MAX_RENDERED_FPS:  # also rejects NaN
        raise SpecError(f"rendered:FILE.npy or rendered:FILE.npy?fps=N, N above 0 to {MAX_RENDERED_FPS:g}")
    return Rendered(base / name, fps)
