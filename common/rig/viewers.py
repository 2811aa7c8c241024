"""The viewers of a rig: each camera at its working size, its source and its background, with checks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from zenocap.common.camera.calibration_files import camera_named
from zenocap.common.camera.lens import SIZE_GUESS, Sized, of_images
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Entry
from zenocap.common.errors import SourceError, UserError
from zenocap.common.rig.camera_settings import given_settings, setting_problem, settings_of
from zenocap.common.rig.file import RigFile, ViewerTable
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.source_kinds import parse_source
from zenocap.common.rig.sources import (
    USUAL_FPS,
    Actor,
    AdaptiveBackground,
    Announced,
    Background,
    BackgroundImage,
    Device,
    FirstFrames,
    FirstSeconds,
    Images,
    LiveSource,
    MedianFrames,
    Source,
    SpecError,
    VideoFile,
    parse_background,
)

LONG_SIDE_PX = 640  # default of the working size's long side
SAME_RATE = 0.01  # largest relative difference of frame rates that are treated as equal, such as 29.97 and 30
SAME_SHAPE = 0.02  # largest relative difference of the aspect ratios of working size and calibration
# Keys of a viewer's table that only one kind of source has, and that kind in words.
OF_ONE_KIND: tuple[tuple[str, type[Source], str], ...] = (
    ("initial", VideoFile, "a video file"),
    ("offset_s", VideoFile, "a video file"),
    ("delay_ms", LiveSource, "a camera or a stream; of a video file: offset_s"),
    ("hardware_decoding", VideoFile, "a video file"),
)


@dataclass(frozen=True)
class Viewer:
    """camera: at the working size.  calibrated_size: required (width, height) of the source's images, px.

    people: whether a small network corrects the silhouettes.  feedback: whether the tracker's pose helps them.
    keep_background: whether the background outlives the viewer, see `zenocap.services.viewer.kept_background`.
    """

    id: str
    camera: Camera
    calibrated_size: tuple[int, int]
    source: Source
    background: Background
    fps: float
    preview: bool
    silhouette: bool
    people: bool = False
    feedback: bool = False
    keep_background: bool = False

    @property
    def delay_ns(self) -> int:
        """By which its images are older than their times say, as the rig file has it; 0 for other than live sources."""
        return self.source.delay_ns if isinstance(self.source, LiveSource) else 0

    @property
    def is_synthetic(self) -> bool:
        """Whether its images show the simulated person."""
        return isinstance(self.source, Actor)

    @property
    def background_in_use(self) -> Background:
        """Background to use: the median of a whole video, because a person may stand still in its first frames."""
        match self.background, self.source:
            case MedianFrames(), VideoFile(path=path, hardware=hardware):
                return BackgroundImage(path, hardware)
            case background, _:
                return background


def rig_viewers(
    path: Path, base: Path, content: RigFile, cameras: dict[str, Camera], files: bool, used: Sequence[str] | None = None
) -> tuple[Viewer, ...]:
    """Viewers of a rig file.  path: of the rig, for errors.  base, files: see `load_rig`.  used: their ids; None: all.

    Raises UserError.
    """
    viewers: list[Viewer] = []
    users: dict[str, str] = {}
    for number, table in enumerate(content.viewer):
        if used is not None and table.id not in used:
            continue
        key = f"viewer[{number}]"
        entry = Entry(path, key)
        camera = camera_named(cameras, table.camera, f"{path}: {key}.camera")
        if table.camera in users:
            raise UserError(f"{path}: {key}.camera = {table.camera!r}: viewer {users[table.camera]!r} uses it already")
        users[table.camera] = table.id
        camera = replace(camera, name=plain_name(camera.name))
        source = _source(entry, table, base, files)
        camera = of_source(camera, source)
        size = _working_size(entry, table, camera)
        fps = table.fps or _own_fps(entry, source)
        try:
            background = parse_background(table.background or source.background, base, fps, size)
        except SpecError as error:
            raise entry.error("background", repr(table.background), str(error)) from error
        if isinstance(source, Announced) and isinstance(background, BackgroundImage):
            raise UserError(
                f"{path}: {key}.background = {table.background!r}: allowed for a camera of another machine: adaptive, "
                "first:N, first:SECONDSs, median, mog2: no picture is sent there"
            )
        if files and isinstance(background, BackgroundImage) and not background.path.is_file():
            raise UserError(f"{path}: {key}.background = {table.background!r}: no file {background.path}")
        _check_adaptive(entry, table, source, background)
        working = camera.resized(size)
        if isinstance(source, Announced) and table.people:
            raise entry.error("people", "true", "false for a camera of another machine (discover:)")
        viewers.append(
            Viewer(
                table.id, working, camera.size, source, background, fps, table.preview, table.silhouette, table.people,
                table.feedback, table.keep_background,
            )
        )  # fmt: skip
    return _from_the_first(viewers)


def _check_adaptive(entry: Entry, table: ViewerTable, source: Source, background: Background) -> None:
    """Raise UserError where the tracker's pose cannot help the silhouettes, or the background cannot be kept."""
    if table.feedback and isinstance(source, Announced):
        raise UserError(f"{entry.path}: {entry.key}.feedback = true: allowed for a camera of another machine: false")
    if table.keep_background and not source.live:
        raise entry.error("keep_background", "true", "only for a camera or stream of this machine")
    for name in ("feedback", "keep_background"):
        if getattr(table, name) and not isinstance(background, AdaptiveBackground):
            raise entry.error(name, "true", 'only with background = "adaptive"')


def _from_the_first(viewers: Sequence[Viewer]) -> tuple[Viewer, ...]:
    """The viewers with the offsets of their files counted from the file that begins first."""
    first = min((viewer.source.offset_ns for viewer in viewers if isinstance(viewer.source, VideoFile)), default=0)
    return tuple(
        replace(viewer, source=replace(viewer.source, offset_ns=viewer.source.offset_ns - first))
        if isinstance(viewer.source, VideoFile)
        else viewer
        for viewer in viewers
    )


def at_rate(viewer: Viewer, fps: float) -> Viewer:
    """The viewer at another frame rate; the empty scene at the beginning keeps its duration."""
    background = viewer.background
    if isinstance(background, FirstFrames) and fps < viewer.fps:  # the same duration in fewer frames
        background = FirstSeconds(background.count / viewer.fps).at_rate(fps)
    return replace(viewer, fps=fps, background=background)


def at_common_rate(viewers: tuple[Viewer, ...]) -> tuple[tuple[Viewer, ...], list[str]]:
    """The viewers of video files at the lowest of their frame rates where these differ, and a note for the user.

    One number of first frames is a shorter time at a higher rate: the shortest of these times holds for all.
    """
    rates = [viewer.fps for viewer in viewers if isinstance(viewer.source, VideoFile)]
    if len(rates) != len(viewers) or max(rates) <= min(rates) * (1.0 + SAME_RATE):
        return viewers, []
    text = ", ".join(f"{viewer.id} {viewer.fps:.4g}" for viewer in viewers)
    note = f"frames/s: {text}: of the faster ones, the frames nearest in time to {min(rates):.4g} a second are used"
    empty_s = min(
        (one.background.count / one.fps for one in viewers if isinstance(one.background, FirstFrames)), default=0.0
    )
    found = [at_rate(viewer, min(rates)) for viewer in viewers]
    return tuple(_with_empty(viewer, empty_s) for viewer in found), [note]


def _with_empty(viewer: Viewer, seconds: float) -> Viewer:
    """The viewer with that much of the empty scene at the beginning, if it has any."""
    if not isinstance(viewer.background, FirstFrames):
        return viewer
    return replace(viewer, background=FirstSeconds(seconds).at_rate(viewer.fps))


def of_source(one: Sized, source: Source) -> Sized:
    """The lens or camera with the known size of a source's images in the place of a guess, see `of_images`."""
    size = source.own_size() if SIZE_GUESS in one.guessed else None
    return one if size is None else of_images(one, size)


def size_notes(content: RigFile, viewers: tuple[Viewer, ...], cameras: Mapping[str, Camera]) -> list[str]:
    """Notes for the user on sizes of files instead of guesses, and on working sizes chosen by default.

    cameras: of the calibration.
    """
    tables, notes = {table.id: table for table in content.viewer}, []
    for viewer in viewers:
        (width, height), table = viewer.calibrated_size, tables[viewer.id]
        if (guess := cameras[table.camera].size) != viewer.calibrated_size:
            text = f"images of {width} x {height}, as its files have: {guess[0]} x {guess[1]} in the calibration is a guess"
            notes.append(f"viewer {viewer.id}: {text}")
        if table.size is None and viewer.camera.size != viewer.calibrated_size:
            working = f"{viewer.camera.size[0]} x {viewer.camera.size[1]}"
            notes.append(f"viewer {viewer.id}: images of {width} x {height} are processed at {working}")
    return notes


def video_notes(viewers: tuple[Viewer, ...]) -> list[str]:
    """Notes for the user on files of another size than that of the calibration; of those that can be read."""
    notes = []
    for viewer in viewers:
        size = viewer.source.own_size()
        if size is not None and size != viewer.calibrated_size:
            width, height = viewer.calibrated_size
            notes.append(
                f"viewer {viewer.id}: {viewer.source.kind} of {size[0]} x {size[1]}, calibration for {width} x {height}: "
                "scaled; wrong if the camera cuts its picture in one of them"
            )
    return notes


def _working_size(entry: Entry, table: ViewerTable, camera: Camera) -> tuple[int, int]:
    width, height = camera.size
    if table.size is None:
        scale = min(1.0, LONG_SIDE_PX / max(width, height))
        return max(16, round(width * scale)), max(16, round(height * scale))
    stretch = (table.size[0] / width) / (table.size[1] / height)
    if abs(stretch - 1) > SAME_SHAPE:
        such_as = f"[{table.size[0]}, {round(table.size[0] * height / width)}]"
        allowed = f"the shape of the calibrated {width} x {height} px, such as {such_as}"
        raise entry.error("size", list(table.size), allowed)
    if table.size[0] > width or table.size[1] > height:
        raise entry.error("size", list(table.size), f"at most the calibrated {width} x {height} px")
    return table.size


def _source(entry: Entry, table: ViewerTable, base: Path, files: bool) -> Source:
    try:
        source = parse_source(table.source, base)
    except SpecError as error:
        raise entry.error("source", repr(table.source), str(error)) from error
    for name, kind, allowed in OF_ONE_KIND:
        value = getattr(table, name)
        if value not in (None, 0) and not isinstance(source, kind):
            raise entry.error(name, "true" if value is True else repr(value), f"only where the source is {allowed}")
    if isinstance(source, VideoFile):
        initial = None if table.initial is None else base / table.initial
        offset_ns = round(table.offset_s * 1e9)
        source = replace(source, initial=initial, offset_ns=offset_ns, hardware=table.hardware_decoding)
    elif isinstance(source, Images):
        source = replace(source, rated=table.fps is not None)
    elif isinstance(source, LiveSource) and table.delay_ms:
        source = replace(source, delay_ns=round(table.delay_ms * 1e6))
    source = _with_settings(entry, table, source)
    for name, problem in source.missing().items() if files else ():
        raise UserError(f"{entry.path}: {entry.key}.{name} = {getattr(table, name)!r}: {problem}")
    return source


def _with_settings(entry: Entry, table: ViewerTable, source: Source) -> Source:
    """The source with the camera settings of its table.  Raises UserError."""
    given = given_settings(table)
    for name, value in given.items():
        if not isinstance(source, Device | Announced):
            raise entry.error(name, repr(value), "only where the source is a camera of a machine")
        problem = setting_problem(name, value)
        if problem is not None:
            raise entry.error(name, repr(value), problem)
    return replace(source, settings=settings_of(given)) if isinstance(source, Device | Announced) and given else source


def _own_fps(entry: Entry, source: Source) -> float:
    """Frame rate of a source when its viewer table gives none."""
    try:
        return source.own_fps() or USUAL_FPS
    except SourceError as error:
        raise UserError(f"{entry.path}: {entry.key}.source: {error}") from error
