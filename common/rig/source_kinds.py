"""The table of sources: which texts of a rig file mean each, and what opens it."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias
from urllib.parse import parse_qsl, urlsplit

from zenocap.common.errors import UserError
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.sources import (
    Actor,
    Announced,
    Device,
    Images,
    Rendered,
    Source,
    SpecError,
    Stream,
    VideoFile,
    without_password,
)
from zenocap.common.table import Table

STREAMS = ("rtsp", "rtsps", "http", "https")
STABLE_NAMES = ("/dev/v4l/by-id/", "/dev/v4l/by-path/")
ANNOUNCED = r"[A-Za-z0-9_\-][A-Za-z0-9_.\-]{0,63}"  # names of machines and their cameras
MAX_DEVICE = 99
MAX_SEED = 2**31 - 1
RENDERED_FPS, MAX_RENDERED_FPS = 30.0, 1000.0

Parse: TypeAlias = Callable[[str, Path], Source]


@dataclass(frozen=True)
class SourceKind:
    """name: of its texts in a rig file, before a colon, in lower case; `kind` of its type.  texts: their forms, for errors.

    parse: source of a text and the folder of the rig file.  Raises SpecError.
    open: "module:function".  Of a `LiveSource`: called with source, (width, height) px and frames/s, it returns a `Capture`
    or raises SourceError; the viewer opens it again whenever it fails, and measures its rate.  Of another source: called
    with `Viewer` and `Playback`, it yields each `Frame`, or raises SourceError.
    matches: own rows only: whether a text is of this kind, where it has another form than NAME:REST.
    """

    name: str
    texts: str
    parse: Parse
    open: str
    matches: Callable[[str], bool] | None = None

    def has(self, text: str) -> bool:
        return _scheme(text) == self.name if self.matches is None else self.matches(text)


def _scheme(text: str) -> str:
    scheme, colon, _ = text.partition(":")
    return scheme.lower() if colon else ""


def _rest(text: str) -> tuple[str, dict[str, str]]:
    """Path and options of NAME:PATH?KEY=VALUE."""
    parts = urlsplit(text)
    return parts.path, dict(parse_qsl(parts.query, keep_blank_values=True))


def _device(text: str, base: Path) -> Device:
    number = text.removeprefix("/dev/video")
    if text.startswith("/dev/") and number == text:
        if not text.startswith(STABLE_NAMES) or text.endswith("/") or ".." in Path(text).parts:
            raise SpecError("/dev/videoN, /dev/v4l/by-id/NAME or /dev/v4l/by-path/NAME, as `zenocap cameras` lists them")
        return Device(None, Path(text))
    if number != text and not number.isdecimal():
        raise SpecError("/dev/video0 and so on")
    if not (number.isdecimal() and int(number) <= MAX_DEVICE):
        raise SpecError(f"a device number from 0 to {MAX_DEVICE}")
    return Device(int(number))


def _stream(text: str, base: Path) -> Stream:
    parts = urlsplit(text)
    if not parts.netloc:
        raise SpecError(f"{parts.scheme}://HOST/...")
    return Stream(text)


def _announced(text: str, base: Path) -> Announced:
    machine, _, camera = text.partition(":")[2].partition("/")
    if not (re.fullmatch(ANNOUNCED, machine) and re.fullmatch(ANNOUNCED, camera)):
        raise SpecError("discover:MACHINE/CAMERA, as `zenocap cameras --discover` lists them")
    return Announced(machine, camera)


def _actor(text: str, base: Path) -> Actor:
    name, options = _rest(text)
    seed = options.pop("seed", "0")
    if not name or options or not seed.isdecimal() or int(seed) > MAX_SEED:
        names = "demo, walking, turning, running, boxing or a posture"
        raise SpecError(f"actor:NAME or actor:NAME?seed=N, NAME {names}, N to {MAX_SEED}")
    return Actor(name, int(seed))


def _rendered(text: str, base: Path) -> Rendered:
    name, options = _rest(text)
    try:
        fps = float(options.pop("fps", str(RENDERED_FPS)))
    except ValueError:
        fps = 0.0
    if not name.endswith(".npy") or options or not 0 < fps <= MAX_RENDERED_FPS:  # also rejects NaN
        raise SpecError(f"rendered:FILE.npy or rendered:FILE.npy?fps=N, N above 0 to {MAX_RENDERED_FPS:g}")
    return Rendered(base / name, fps)


def _images(text: str, base: Path) -> Images:
    path = base / text
    return Images(path.parent, path.name)


def _has_pattern(text: str) -> bool:
    return "://" not in text and any(mark in Path(text).name for mark in "*?[")


HOME = "zenocap.services.viewer.sources"
DEVICE = SourceKind(
    "device", "a device number, /dev/videoN, /dev/v4l/by-id/NAME", _device, f"{HOME}.device:open_device",
    lambda text: text.isdecimal() or text.startswith("/dev/"),
)  # fmt: skip
STREAM = SourceKind(
    "stream", "rtsp://, http:// or https://", _stream, f"{HOME}.device:open_stream",
    lambda text: _scheme(text) in STREAMS,
)  # fmt: skip
VIDEO = SourceKind(
    "video", "a video file", lambda text, base: VideoFile(base / text), f"{HOME}.video:frames_of",
    lambda text: bool(text.strip()) and "://" not in text,
)  # fmt: skip
IMAGES = SourceKind("images", "images/*.png", _images, f"{HOME}.images:frames_of", _has_pattern)
ACTOR = SourceKind("actor", "actor:NAME[?seed=N]", _actor, f"{HOME}.actor:frames_of")
RENDERED = SourceKind("rendered", "rendered:FILE.npy[?fps=N]", _rendered, f"{HOME}.rendered:frames_of")
DISCOVER = SourceKind(Announced.kind, "discover:MACHINE/CAMERA", _announced, f"{HOME}.source:not_opened")

SOURCES = Table(
    SourceKind,
    "zenocap.sources",
    {
        name: f"{__name__}:{name.upper()}"
        for name in ("device", "stream", "video", "images", "actor", "rendered", "discover")
    },
)
OF_NAMES = "of names: letters, digits, '.', '_' and '-'"
FILES = ("images", "video")  # rows of texts that no other row has, in this order


def parse_source(text: str | int, base: Path, *, installed: bool = True) -> Source:
    """Source of a text of a rig file in the folder `base`.  Raises SpecError.

    installed: whether rows of installed packages count too: not where a text may be somebody else's.
    """
    if isinstance(text, int):
        return _device(str(text), base)
    kind = _kind_of(text, installed)
    if kind is None:
        own = [SOURCES.row(name).texts for name in SOURCES.own]
        others = [f"{name}:..." for name in SOURCES.names() if name not in SOURCES.own] if installed else []
        raise SpecError(", ".join([*own, *others]))
    return kind.parse(text, base)


def _kind_of(text: str, installed: bool) -> SourceKind | None:
    for name in SOURCES.own:
        if name not in FILES and (kind := SOURCES.row(name)).has(text):
            return kind
    scheme = _scheme(text)  # asks for the installed packages only where a text has one
    if installed and scheme and scheme not in SOURCES.own and scheme in SOURCES.names():
        return SOURCES.row(scheme)
    return next((kind for kind in map(SOURCES.row, FILES) if kind.has(text)), None)


def named_source(text: str, such_as: str, option: str = "", *, installed: bool = True) -> tuple[str, Source]:
    """Name and source of NAME=SOURCE.  such_as: examples.  option: of the command line, before the text in errors.

    Raises UserError, without the password of a source.
    """
    name, equals, where = text.partition("=")
    shown = f"{option}{name}{equals}{without_password(where)}"
    if not (equals and name and where) or plain_name(name) != name:
        raise UserError(f"{shown}: allowed: NAME=SOURCE, such as {such_as}; {OF_NAMES}")
    try:
        return name, parse_source(where, Path(), installed=installed)
    except SpecError as error:
        raise UserError(f"{shown}: allowed: {error}") from error
