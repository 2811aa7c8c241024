"""The cameras that a live page shows: those of a rig file, named ones, or all of this machine."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import Images, VideoFile
from zenocap.common.video.reader import VideoReader
from zenocap.common.video.v4l2.listing import FoundCamera, found_cameras
from zenocap.tools.setup.cameras.named_sources import named_sources

LIVE = "a rig file with cameras, or NAME=SOURCE, such as left=/dev/video0, right=rtsp://192.168.1.20/stream or a=film.mkv"


def live_viewers(
    texts: Sequence[str],
    size: tuple[int, int],
    fps: float,
    load: Callable[[Path], Rig],
    find: Callable[[], Sequence[FoundCamera]] = found_cameras,
) -> tuple[list[Viewer], list[str]]:
    """Viewers of a rig file, of NAME=SOURCE, or for no texts of all cameras of this machine; and notes for the user.

    size, fps: requested from cameras without a rig file.  load: a rig file.  Raises UserError.
    """
    if not texts:
        return _found(find(), size, fps)
    if len(texts) == 1 and ("=" not in texts[0] or Path(texts[0]).exists()):
        return _of_rig(load(Path(texts[0])))
    for text in texts:
        if "=" not in text:
            raise UserError(f"{text}: allowed: {LIVE}")
    viewers = named_sources(texts, size, fps, files=True)
    return [_own_size(viewer) for viewer in viewers], []


def _found(cameras: Sequence[FoundCamera], size: tuple[int, int], fps: float) -> tuple[list[Viewer], list[str]]:
    good = [camera for camera in cameras if not camera.problem]
    notes = [f"note: {camera.path}: {camera.problem}" for camera in cameras if camera.problem]
    if not good:
        reasons = "; ".join(f"{camera.path}: {camera.problem}" for camera in cameras)
        raise UserError(f"no camera of this machine gives images{f': {reasons}' if reasons else ''}: allowed: {LIVE}")
    viewers = named_sources([f"cam{number:02d}={one.source}" for number, one in enumerate(good, 1)], size, fps)
    return viewers, notes + [f"cam{number:02d}: {one.name}, {one.source}" for number, one in enumerate(good, 1)]


def _of_rig(rig: Rig) -> tuple[list[Viewer], list[str]]:
    shown, notes = [], []
    for viewer in rig.viewers:
        if isinstance(viewer.source, Images):
            notes.append(f"note: viewer {viewer.id}: a folder of images: not shown")
        else:
            shown.append(_own_size(viewer))
    if not shown:
        raise UserError(f"rig {rig.name}: no viewer has a camera, stream or video: nothing to show")
    return shown, notes


def _own_size(viewer: Viewer) -> Viewer:
    """The viewer with the rate of its file, where it reads one.  Raises SourceError for a file that cannot be read."""
    if not isinstance(viewer.source, VideoFile):
        return viewer
    with VideoReader(viewer.source.path) as reader:
        return replace(viewer, calibrated_size=reader.size, fps=reader.fps, source=replace(viewer.source, initial=None))
