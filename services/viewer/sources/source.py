"""Open the frame source of a viewer."""

import sys
import time
from collections.abc import Callable, Iterator
from typing import cast

from zenocap.common.errors import OpenError
from zenocap.common.rig.camera_settings import CameraSettings
from zenocap.common.rig.rig import Viewer
from zenocap.common.rig.source_kinds import SOURCES
from zenocap.common.rig.sources import Announced, Device, Images, LiveSource, VideoFile
from zenocap.common.runtime.clock import RealClock
from zenocap.common.table import attribute
from zenocap.common.video.reader import VideoReader
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import LONGEST_RUN_NS, RUNS_ON_NS
from zenocap.services.viewer.sources.camera_controls import CameraControls
from zenocap.services.viewer.sources.device import Opener, camera_frames
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import Fit, fit_of
from zenocap.services.viewer.sources.stamps import SourceRate
from zenocap.services.viewer.sources.tap import Tap
from zenocap.services.viewer.sources.video import declared_frames, video_frames


def open_source(
    viewer: Viewer, playback: Playback, rate: SourceRate | None = None, film: Tap | None = None,
    opener: Opener | None = None,
) -> Iterator[Frame]:  # fmt: skip
    """Iterate over the viewer's frames at its working size and rate.

    rate: measures that of a camera or stream.  film: is given all their images while a film is open.  opener: of it.

    Raises SourceError, on the first frame or later: OpenError, AccessDenied, SizeMismatch, EndedEarly.
    """
    if isinstance(viewer.source, LiveSource):
        return camera_frames(
            viewer.source, viewer.fps, viewer.calibrated_size, playback, opener, fit_of(viewer).named(viewer.source.title),
            controls=_controls(viewer.source, playback), rate=rate, film=film,
        )  # fmt: skip
    opened = cast("Callable[[Viewer, Playback], Iterator[Frame]]", attribute(SOURCES.row(viewer.source.kind).open))
    return opened(viewer, playback)


def not_opened(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    """Raises OpenError: a camera of another machine is opened by the viewer that runs there."""
    assert isinstance(viewer.source, Announced)
    text, machine = viewer.source.text, viewer.source.machine
    raise OpenError(f"{text}: its images stay on {machine}: the viewer runs there: see `zenocap up`")


def camera_images(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    """Images of a camera or stream as it gives them, at the calibrated size and not rectified.  Raises SourceError."""
    assert isinstance(viewer.source, LiveSource)
    controls = _controls(viewer.source, playback)
    return camera_frames(viewer.source, viewer.fps, viewer.calibrated_size, playback, controls=controls)


def images_of(
    source: LiveSource, size: tuple[int, int], fps: float, sleep: Callable[[float], None], report: Callable[[str], None]
) -> Iterator[Frame]:
    """Images of a camera or stream as it gives them, of `size` (width, height) px.  sleep, report: see `Playback`.

    Raises SourceError.
    """
    playback = Playback(time.time_ns(), RealClock(), sleep=sleep, report=report)
    return camera_frames(source, fps, size, playback, controls=_controls(source, playback))


def live_images(viewer: Viewer, playback: Playback, rate: SourceRate) -> Iterator[Frame]:
    """Images of any source as it gives them, of whatever size and not rectified.  rate: of a camera or stream.

    Raises SourceError.
    """
    if isinstance(viewer.source, LiveSource):
        return camera_frames(
            viewer.source, viewer.fps, viewer.calibrated_size, playback, fit=lambda image: image,
            controls=_controls(viewer.source, playback), rate=rate,
        )  # fmt: skip
    if isinstance(viewer.source, VideoFile):
        with VideoReader(viewer.source.path) as reader:
            size, fps = reader.size, reader.fps
        return video_frames(viewer.source, fps, Fit(size, size), playback)
    return open_source(viewer, playback)


def _controls(source: LiveSource, playback: Playback) -> CameraControls | None:
    """Controls of a camera where they can be set: on Linux."""
    if not isinstance(source, Device):
        return None
    if sys.platform != "linux":
        if source.settings != CameraSettings():
            playback.report(f"{source.title}: its settings in the rig file are left out: they are set on Linux only")
        return None
    return CameraControls(source.title, source.file, source.settings, playback.report)


def frame_count(viewer: Viewer) -> int | None:
    """Approximate number of frames of a source; None for a source without end or of unknown length."""
    match viewer.source:
        case VideoFile(path=path, initial=initial):
            return sum(declared_frames(file, viewer.fps) for file in (path, initial) if file is not None)
        case Images() as images:
            return len(images.files())
        case _:
            return None


def longest_run_ns(viewer: Viewer) -> int:
    """Longest time from frame 0 to the end of a live viewer; LONGEST_RUN_NS without an end or a known length."""
    source, frames = viewer.source, frame_count(viewer)
    if not frames:
        return LONGEST_RUN_NS
    begin_ns = source.offset_ns if isinstance(source, VideoFile) else 0
    return begin_ns + round(frames * 1e9 / min(viewer.fps, source.own_fps() or viewer.fps)) + RUNS_ON_NS
