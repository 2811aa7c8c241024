"""A rig: an installation of cameras, from one TOML file or from a folder in the Pose2Sim layout."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import cv2

from common.camera.files import CalibrationError, camera_named, read_calibration
from common.camera.pairs import angle_between_deg, most_orthogonal_pair
from common.camera.pinhole import Camera
from common.runtime.rig_file import METHODS, LogTable, RigError, RigFile, ViewerTable, ZenohTable, read_toml, rig_file
from common.runtime.rig_folder import folder_rig, plain_name
from common.runtime.specs import (
    Actor,
    Background,
    BackgroundImage,
    Images,
    MedianFrames,
    Source,
    SpecError,
    VideoFile,
    parse_background,
    parse_source,
)

__all__ = ["Rig", "RigError", "Viewer", "demo_rig", "demo_rig_file", "load_rig"]

LONG_SIDE_PX = 640  # of the working size where the rig gives none
DEVICE_FPS, ACTOR_FPS, IMAGES_FPS = 30.0, 15.0, 30.0
SAME_SHAPE = 0.02  # relative difference of the aspect ratios of working size and calibration


@dataclass(frozen=True)
class Viewer:
    """camera: at the working size.  calibrated_size: (width, height) px that the source's images must have."""

    id: str
    camera: Camera
    calibrated_size: tuple[int, int]
    source: Source
    background: Background
    fps: float
    preview: bool
    silhouette: bool

    @property
    def background_in_use(self) -> Background:
        """The median of a video is one of all of it: in its first frames a person may stand still."""
        match self.background, self.source:
            case MedianFrames(), VideoFile(path=path):
                return BackgroundImage(path)
            case background, _:
                return background


@dataclass(frozen=True)
class Rig:
    """base: the folder that the file's paths are relative to.  notes: what to tell the user.

    digest: of the content of the rig and calibration files, equal on every machine of the rig.
    files: the rig file and the calibration, for the log.
    person_height: metres, of a person who is not asked for the initial posture; None to measure the body.
    """

    name: str
    method: str
    viewers: tuple[Viewer, ...]
    notes: tuple[str, ...]
    base: Path
    digest: str
    zenoh: ZenohTable
    log: LogTable
    files: tuple[Path, ...]
    person_height: float | None = None

    def viewer(self, id: str) -> Viewer:
        """The viewer of that id.  Raises RigError, which lists the ones there are."""
        for viewer in self.viewers:
            if viewer.id == id:
                return viewer
        raise RigError(f"rig {self.name}: no viewer {id!r}; there are: {', '.join(v.id for v in self.viewers)}")


def load_rig(path: Path | str, method: str | None = None, *, files: bool = True) -> Rig:
    """The rig of a TOML file or of a folder in the Pose2Sim layout.

    method: instead of the rig's own.  files: False where the sources may lie on other machines: a missing video or
    picture is no error then.  Raises RigError, whose text names file, key, value and what is allowed.
    """
    path = Path(path)
    if method is not None and method not in METHODS:
        raise RigError(f"method = {method!r}: allowed: {', '.join(METHODS)}")
    notes: tuple[str, ...] = ()
    if path.is_dir():
        base = path
        content, notes = folder_rig(path, method or METHODS[0])
        content_bytes = repr(content).encode()
        own_file = path / "clip.toml"
    elif path.exists():
        base, content_bytes = path.parent, path.read_bytes()
        content = rig_file(path, read_toml(path))
        own_file = path
    else:
        raise RigError(f"{path}: no such rig: allowed: a TOML file, or a folder with calibration.toml and videos/")
    method = method or content.method
    calibration = base / content.calibration
    if not calibration.is_file():
        raise RigError(f"{path}: calibration = {content.calibration!r}: no file {calibration}")
    try:
        cameras = read_calibration(calibration, content.up_axis)
        viewers = _viewers(path, base, content, cameras, files)
    except CalibrationError as error:
        raise RigError(str(error)) from error
    viewers, chosen = _enough(path, method, viewers)
    digest = hashlib.sha256(b"\0".join([content_bytes, calibration.read_bytes(), method.encode()])).hexdigest()[:16]
    all_notes = (*notes, *chosen, *_size_notes(content, viewers))
    files_of_rig = tuple(file for file in (own_file, calibration) if file.is_file())
    return Rig(
        content.name,
        method,
        viewers,
        all_notes,
        base,
        digest,
        content.zenoh,
        content.log,
        files_of_rig,
        content.person_height,
    )


def demo_rig_file() -> Path:
    """The rig file of `zenocap demo`, in the checkout that this package was installed from.  Raises RigError."""
    root = Path(__file__).resolve().parents[2]
    path = root / "deploy" / "rigs" / "demo.toml"
    if not path.is_file():
        raise RigError(f"{path}: no such file: the demo needs a checkout of the project, installed with pip install -e .")
    return path


def demo_rig() -> Rig:
    """Two viewers of the synthetic actor, the paper's orthogonal rig."""
    return load_rig(demo_rig_file())


def _viewers(path: Path, base: Path, content: RigFile, cameras: dict[str, Camera], files: bool) -> tuple[Viewer, ...]:
    viewers: list[Viewer] = []
    users: dict[str, str] = {}
    for number, table in enumerate(content.viewer):
        key = f"viewer[{number}]"
        camera = camera_named(cameras, table.camera, f"{path}: {key}.camera")
        if table.camera in users:
            raise RigError(f"{path}: {key}.camera = {table.camera!r}: viewer {users[table.camera]!r} has it already")
        users[table.camera] = table.id
        camera = replace(camera, name=plain_name(camera.name))
        size = _working_size(path, key, table, camera)
        source = _source(path, key, table, base, files)
        try:
            background = parse_background(table.background, base)
        except SpecError as error:
            raise RigError(f"{path}: {key}.background = {table.background!r}: allowed: {error}") from error
        if files and isinstance(background, BackgroundImage) and not background.path.is_file():
            raise RigError(f"{path}: {key}.background = {table.background!r}: no file {background.path}")
        fps = table.fps or _own_fps(path, key, source, files)
        working = camera.resized(size)
        viewers.append(Viewer(table.id, working, camera.size, source, background, fps, table.preview, table.silhouette))
    return tuple(viewers)


def _size_notes(content: RigFile, viewers: tuple[Viewer, ...]) -> list[str]:
    """What to tell of the working sizes that nobody asked for."""
    chosen = {table.id for table in content.viewer if table.size is not None}
    return [
        f"viewer {viewer.id}: images of {viewer.calibrated_size[0]} x {viewer.calibrated_size[1]} "
        f"are worked on at {viewer.camera.size[0]} x {viewer.camera.size[1]}"
        for viewer in viewers
        if viewer.id not in chosen and viewer.camera.size != viewer.calibrated_size
    ]


def _working_size(path: Path, key: str, table: ViewerTable, camera: Camera) -> tuple[int, int]:
    width, height = camera.size
    if table.size is None:
        scale = min(1.0, LONG_SIDE_PX / max(width, height))
        return max(16, round(width * scale)), max(16, round(height * scale))
    stretch = (table.size[0] / width) / (table.size[1] / height)
    if abs(stretch - 1) > SAME_SHAPE:
        raise RigError(
            f"{path}: {key}.size = {list(table.size)}: allowed: the shape of the calibrated {width} x {height} px, "
            f"such as [{table.size[0]}, {round(table.size[0] * height / width)}]"
        )
    return table.size


def _source(path: Path, key: str, table: ViewerTable, base: Path, files: bool) -> Source:
    try:
        source = parse_source(table.source, base)
    except SpecError as error:
        raise RigError(f"{path}: {key}.source = {table.source!r}: allowed: {error}") from error
    if table.initial is not None:
        if not isinstance(source, VideoFile):
            raise RigError(f"{path}: {key}.initial = {table.initial!r}: allowed: only where the source is a video file")
        source = replace(source, initial=base / table.initial)
    if not files:
        return source
    match source:
        case VideoFile():
            for name, file in (("source", source.path), ("initial", source.initial)):
                if file is not None and not file.is_file():
                    raise RigError(f"{path}: {key}.{name} = {str(getattr(table, name))!r}: no file {file}")
        case Images() if not any(source.folder.glob(source.pattern)):
            raise RigError(f"{path}: {key}.source = {table.source!r}: no file matches {source.folder / source.pattern}")
    return source


def _own_fps(path: Path, key: str, source: Source, files: bool) -> float:
    """The rate of a source whose viewer gives none."""
    match source:
        case Actor():
            return ACTOR_FPS
        case Images():
            return IMAGES_FPS
        case VideoFile(path=file) if files or file.is_file():
            capture = cv2.VideoCapture(str(file))
            rate = float(capture.get(cv2.CAP_PROP_FPS)) if capture.isOpened() else 0.0
            capture.release()
            if not 0 < rate <= 1000:
                raise RigError(f"{path}: {key}.source: {file} cannot be opened as a video or has no frame rate: give fps")
            return rate
    return DEVICE_FPS


def _enough(path: Path, method: str, viewers: tuple[Viewer, ...]) -> tuple[tuple[Viewer, ...], tuple[str, ...]]:
    """The viewers that take part: of more than two, two-view takes the most nearly orthogonal pair."""
    least = 2 if method == "two-view" else 1
    if len(viewers) < least:
        raise RigError(f"{path}: {len(viewers)} viewer(s): allowed: {least} or more [[viewer]] for method {method!r}")
    if method != "two-view" or len(viewers) == 2:
        return viewers, ()
    by_id = {viewer.id: viewer for viewer in viewers}
    pair = most_orthogonal_pair({id: viewer.camera for id, viewer in by_id.items()})
    first, second = (by_id[id] for id in pair)
    angle = angle_between_deg(first.camera, second.camera)
    note = (
        f"method two-view uses two of the {len(viewers)} cameras: {first.id} (front) and {second.id}, "
        f"{angle:.0f} degrees apart, the most nearly orthogonal pair"
    )
    return (first, second), (note,)
