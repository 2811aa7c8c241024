"""Cameras and streams: sources without end, reopened automatically after a failure."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Protocol, cast

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.errors import AccessDenied, OpenError, SizeMismatch, SourceError
from zenocap.common.rig.source_kinds import SOURCES
from zenocap.common.rig.sources import Device, LiveSource, Stream
from zenocap.common.rig.viewers import Viewer
from zenocap.common.runtime.clock import Clock
from zenocap.common.table import attribute
from zenocap.services.viewer import parameters as p
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback, Size
from zenocap.services.viewer.sources.resize import Fit
from zenocap.services.viewer.sources.stamps import SourceRate, StreamClock, buffer_age_ns
from zenocap.services.viewer.sources.tap import Tap

# A grab shorter than this takes an image that was waiting: FFmpeg keeps those of the time in which it examines a stream.
WAITING_NS, MOST_WAITING = 15_000_000, 300  # the first shorter than a period at 60 frames/s; chosen by hand
HELD_S = 5.0  # of an opened camera until its images are taken, of which MOST_WAITING wait at most; chosen by hand
SETTLING_S = 3.0  # in which automatic exposure, white balance and focus find their values; chosen by hand
# OpenCV keeps the buffer of a grabbed frame until the next one is grabbed.  With one buffer the camera has none while an
# image is decoded, and its next frame is lost.  A viewer grabs without pause, so that no frame grows old in the others.
BUFFERS = 3


class Capture(Protocol):
    """The used part of cv2.VideoCapture."""

    def isOpened(self) -> bool: ...

    def grab(self) -> bool: ...

    def retrieve(self) -> tuple[bool, object]: ...

    def get(self, propId: int) -> float: ...

    def release(self) -> None: ...


class Controls(Protocol):
    """Controls of a camera, see `CameraControls`."""

    def begin(self) -> bool: ...

    def lock(self) -> None: ...


Opener = Callable[[LiveSource, Size, float], Capture]


def open_stream(source: Stream, size: Size, fps: float) -> Capture:
    """Open a stream; its images have the size and rate that it has."""
    timeouts = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, p.STREAM_TIMEOUT_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, p.STREAM_TIMEOUT_MS]
    return cast("Capture", cv2.VideoCapture(source.url, cv2.CAP_FFMPEG, timeouts))


def open_device(source: Device, size: Size, fps: float) -> Capture:
    """Open a camera and request images of `size` at `fps`; it may deliver others."""
    if sys.platform == "linux":  # a link is followed: the camera may have another number than before
        capture = cv2.VideoCapture(os.path.realpath(source.file), cv2.CAP_V4L2)
    else:
        if source.number is None:
            raise OpenError(f"{source.title}: allowed on {sys.platform}: a number, such as 0")
        capture = cv2.VideoCapture(source.number, cv2.CAP_ANY)
    # Most webcams reach their full rate uncompressed only for small images.
    capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*(source.settings.format or "MJPG")))
    capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
    capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
    capture.set(cv2.CAP_PROP_FPS, fps)
    capture.set(cv2.CAP_PROP_BUFFERSIZE, BUFFERS)
    return cast("Capture", capture)


def opener_of(source: LiveSource) -> Opener:
    """What opens a source, by the table of sources.  Raises UserError."""
    return cast("Opener", attribute(SOURCES.row(source.kind).open))


def camera_frames(
    source: LiveSource,
    fps: float,
    size: Size,
    playback: Playback,
    opener: Opener | None = None,
    fit: Callable[[Image], Image] | None = None,
    controls: Controls | None = None,
    rate: SourceRate | None = None,
    film: Tap | None = None,
) -> Iterator[Frame]:
    """Yield frames without end at most `fps` per second, with capture times as the source gives them (`stamps`).

    size: calibrated (width, height), px.  opener: None: that of the table of sources.  fit: applied to every image; None:
    images stay at the calibrated size.  controls: of a camera, set each time it is opened; the first SETTLING_S s are left
    out while they settle.  rate: is given the times of all frames.  film: while it is open, is given all images at the
    calibrated size, not rectified, also those that `playback` does not want.

    Raises OpenError or AccessDenied when the camera cannot be opened at first, SizeMismatch for images of a wrong size.  A
    camera that fails later is reported and reopened, with increasing waits, until it delivers images.
    """
    name, opener = source.title, opener or opener_of(source)
    unreduced = Fit(size, size, name=name)
    fit = fit or unreduced
    if (capture := _opened(source, size, fps, opener)) is None:
        raise _open_error(source)
    index, due_ns, period_ns, last_ns = 0, 0, round(1e9 / fps), 0
    times, rate = CaptureTimes(source, playback), rate or SourceRate()
    try:
        _leave_out_waiting(capture, source, playback.clock)
        _settle(capture, controls, playback)
        while True:
            if not capture.grab():
                capture.release()
                if film is not None:
                    film.lost()
                playback.report(f"{name}: lost after {index} frames: unplugged, or the stream ended; trying again")
                capture, tries = _reopen(source, size, fps, opener, playback)
                playback.report(f"{name}: back after {tries} tries")
                times = CaptureTimes(source, playback)
                rate.restart()
                _leave_out_waiting(capture, source, playback.clock)
                _settle(capture, controls, playback)
                continue
            captured_ns = last_ns = max(times.of(capture) - source.delay_ns, last_ns + 1)
            rate.add(captured_ns)
            if captured_ns < due_ns - p.EARLY_FRAME * period_ns:
                continue
            # Jitter stays on the grid of frame periods; a camera slower than requested starts a new grid.
            next_due_ns = (captured_ns if index == 0 else max(due_ns, captured_ns - period_ns // 2)) + period_ns
            wanted = playback.wants(captured_ns)
            if not wanted and (film is None or not film.is_open):
                index, due_ns = index + 1, next_due_ns
                continue
            decoded, image = capture.retrieve()
            if not decoded:
                continue
            due_ns = next_due_ns
            if film is not None and film.is_open:
                film.offer(unreduced(np.array(image, dtype=np.uint8)), captured_ns)
            if not wanted:
                index += 1
                continue
            yield Frame(index, captured_ns, fit(np.asarray(image, dtype=np.uint8)))
            index += 1
    finally:
        capture.release()


def of_working_size(viewer: Viewer) -> Opener:
    """Opener of a camera that is open already, for HELD_S: its images are not smaller than the viewer's working size.

    An assignment from the network chooses that size, by which tables and backgrounds take memory.  Raises SourceError.
    """
    assert isinstance(viewer.source, LiveSource)
    source, (width, height), opener = viewer.source, viewer.camera.size, opener_of(viewer.source)
    if (capture := _opened(source, viewer.calibrated_size, viewer.fps, opener)) is None:
        raise _open_error(source)
    for _ in range(MOST_WAITING):
        decoded, image = capture.retrieve()
        if decoded or not capture.grab():
            break
    if not decoded:
        raise _open_error(source)
    down, across = np.shape(cast("Image", image))[:2]
    if max(width / across, height / down) >= 1.0 + p.LETTERBOX:
        allowed = f"at most that of the camera's own images, {across} x {down} px"
        raise SizeMismatch(f"{source.title}: size = {[width, height]}: allowed: {allowed}")
    held, opened_s = [capture], time.monotonic()

    def open_or_held(source: LiveSource, size: Size, fps: float) -> Capture:
        if held and time.monotonic() - opened_s < HELD_S:
            return held.pop()
        while held:  # its images are as old
            held.pop().release()
        return opener(source, size, fps)

    return open_or_held


class CaptureTimes:
    """Capture times of the frames of one connection."""

    def __init__(self, source: LiveSource, playback: Playback) -> None:
        self._clock, self._stamps = playback.clock, source.stamps
        self._stream = StreamClock()

    def of(self, capture: Capture) -> int:
        """Of the frame just grabbed, nanoseconds since the Unix epoch."""
        now_ns = self._clock.now_ns()
        if self._stamps == "stream":
            return self._stream.captured_ns(round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6), now_ns)
        if self._stamps == "monotonic":
            return now_ns - buffer_age_ns(capture.get(cv2.CAP_PROP_POS_MSEC), time.monotonic_ns())
        return now_ns


def _leave_out_waiting(capture: Capture, source: LiveSource, clock: Clock) -> None:
    """Grab the images that waited while a stream was opened: they are up to some seconds old."""
    for _ in range(MOST_WAITING if source.buffers else 0):
        begin_ns = clock.now_ns()
        if not capture.grab() or clock.now_ns() - begin_ns > WAITING_NS:
            return


def _settle(capture: Capture, controls: Controls | None, playback: Playback) -> None:
    """Set the controls, and leave out frames while automatic ones find their values.  Raises OpenError."""
    if controls is None or not controls.begin():
        return
    end_ns = playback.clock.now_ns() + round(SETTLING_S * 1e9)
    while playback.clock.now_ns() < end_ns:
        if not capture.grab():
            return  # lost; they settle when it is back
    controls.lock()


def _reopen(source: LiveSource, size: Size, fps: float, opener: Opener, playback: Playback) -> tuple[Capture, int]:
    wait_s, tries = p.RECONNECT_FIRST_S, 0
    while True:
        playback.sleep(wait_s)
        tries += 1
        with suppress(SourceError):  # of an opener that says why
            if (capture := _opened(source, size, fps, opener)) is not None:
                return capture, tries
        wait_s = min(2 * wait_s, p.RECONNECT_LONGEST_S)


def _opened(source: LiveSource, size: Size, fps: float, opener: Opener) -> Capture | None:
    """Open the capture and grab one frame; None when this fails."""
    capture = opener(source, size, fps)
    if capture.isOpened() and capture.grab():
        return capture
    capture.release()
    return None


def _open_error(source: LiveSource) -> OpenError | AccessDenied:
    name = source.title
    if not isinstance(source, Device):
        return OpenError(f"{name}: the stream does not open within {p.STREAM_TIMEOUT_MS // 1000} s: is the address right?")
    path = source.file
    if path.exists() and not os.access(path, os.R_OK | os.W_OK):
        return AccessDenied(f"{name}: no permission: add this user to the group `video` and log in again")
    if sys.platform == "linux" and not path.exists():
        folder, pattern = (path.parent, "*") if source.link else (Path("/dev"), "video*")
        cameras = ", ".join(sorted(str(found) for found in folder.glob(pattern))) or "none"
        return OpenError(f"{name}: no such camera; there are: {cameras}")
    return OpenError(f"{name}: delivers no image: another program may be using it")
