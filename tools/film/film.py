"""Film all cameras of a rig on this machine, together, into a folder that `zenocap track` takes."""

import queue
import shutil
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import Device, Stream
from zenocap.common.runtime.clock import RealClock
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import camera_images
from zenocap.tools.film.parameters import ESTIMATE_S, LONG_S, LOOK_S, QUEUE, READY_S, RESERVE_BYTES, RESERVE_S
from zenocap.tools.film.video_writer import VideoWriter

Opener = Callable[[Viewer, Playback], Iterator[Frame]]


@dataclass
class Filmed:
    """What was recorded of one camera.  lost: frames that the writer could not take.  away: how often the camera failed."""

    name: str
    frames: int = 0
    first_ns: int = 0
    last_ns: int = 0
    lost: int = 0
    away: int = 0

    @property
    def rate(self) -> float:
        """Frames/s, from the first to the last."""
        return (self.frames - 1) * 1e9 / (self.last_ns - self.first_ns) if self.frames > 1 else 0.0


class _Stopped(Exception):
    """Ends a camera that waits to be opened again."""


@dataclass
class _Camera:
    """One camera: a thread takes its frames, another writes them."""

    viewer: Viewer
    writer: VideoWriter
    opener: Opener
    stop: threading.Event
    begin_ns: int | None = None  # frames captured before are left out; None: all are
    result: Filmed = field(init=False)
    ready: threading.Event = field(default_factory=threading.Event)
    failure: Exception | None = None
    _queue: "queue.Queue[Frame | None]" = field(default_factory=lambda: queue.Queue(QUEUE))
    _threads: list[threading.Thread] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.result = Filmed(self.viewer.camera.name)

    def start(self) -> None:
        for work in (self._take, self._write):
            self._threads.append(threading.Thread(target=work, name=f"film-{self.viewer.id}", daemon=True))
            self._threads[-1].start()

    def join(self) -> None:
        for thread in self._threads:
            thread.join(15.0)

    def _take(self) -> None:
        def pause(seconds: float) -> None:
            if self.stop.wait(seconds):
                raise _Stopped

        def report(text: str) -> None:
            self.result.away += "trying again" in text

        playback = Playback(time.time_ns(), RealClock(), sleep=pause, report=report)
        frames = self.opener(self.viewer, playback)
        try:
            for frame in frames:
                self.ready.set()
                if self.stop.is_set():
                    break
                if self.begin_ns is None or frame.captured_ns < self.begin_ns:
                    continue
                try:
                    self._queue.put_nowait(frame)
                except queue.Full:
                    self.result.lost += 1
        except _Stopped:
            pass
        except Exception as error:  # any error of a driver must reach the command instead of ending this thread
            self.failure = error
            self.stop.set()
        finally:
            self.ready.set()
            close = getattr(frames, "close", None)
            if callable(close):
                close()
            self._queue.put(None)

    def _write(self) -> None:
        try:
            while (frame := self._queue.get()) is not None:
                if self.failure is None:
                    self.writer.write(frame.image, frame.captured_ns)
        except Exception as error:
            self.failure = error
            self.stop.set()
            while self._queue.get() is not None:
                self.result.lost += 1
        finally:
            try:
                self.writer.close()
            except Exception as error:
                self.failure = self.failure or error
        self.result.frames = self.writer.frames
        self.result.first_ns, self.result.last_ns = self.writer.first_ns, self.writer.last_ns


def filmed_viewers(rig: Rig) -> list[Viewer]:
    """Viewers whose source is a camera or stream.  Raises UserError when there is none."""
    found = [viewer for viewer in rig.viewers if isinstance(viewer.source, Device | Stream)]
    if not found:
        raise UserError(f"rig {rig.name}: no viewer has a camera or stream as source: nothing to film")
    return found


def film(
    viewers: Sequence[Viewer],
    folder: Path,
    seconds: float | None,
    stopped: Callable[[], bool],
    report: Callable[[str], None],
    opener: Opener = camera_images,
    free_bytes: Callable[[Path], int] = lambda path: shutil.disk_usage(path).free,
) -> tuple[list[Filmed], str]:
    """Film until `stopped`, for `seconds`, or until the disk is nearly full; returns the films, and why they ended early.

    All cameras give images before the first is written.  Raises UserError.
    """
    (folder / "videos").mkdir(parents=True, exist_ok=True)
    (folder / "times").mkdir(exist_ok=True)
    if free_bytes(folder) < RESERVE_BYTES:
        raise UserError(f"{folder}: {free_bytes(folder) / 1e6:.0f} MB free: allowed: at least {RESERVE_BYTES / 1e6:.0f} MB")
    stop = threading.Event()
    cameras = [_Camera(viewer, _writer(viewer, folder), opener, stop) for viewer in viewers]
    for camera in cameras:
        camera.start()
    reason = ""
    try:
        _wait_until_ready(cameras, stop, stopped)
        begin_ns = time.time_ns()
        for camera in cameras:
            camera.begin_ns = begin_ns
        if not stop.is_set() and not stopped():
            report(f"filming {len(cameras)} cameras")
            reason = _until_end(cameras, folder, begin_ns, seconds, stopped, report, free_bytes)
    finally:
        stop.set()
        for camera in cameras:
            camera.join()
            if not camera.writer.frames:  # nothing that a second try would have to replace
                camera.writer.remove()
    for camera in cameras:
        if isinstance(camera.failure, UserError) and not camera.writer.frames:
            raise camera.failure
        if camera.failure is not None:
            reason = f"{camera.result.name}: {camera.failure}"
    return [camera.result for camera in cameras], reason


def _writer(viewer: Viewer, folder: Path) -> VideoWriter:
    name = viewer.camera.name
    return VideoWriter(
        folder / "videos" / f"{name}.mkv", folder / "times" / f"{name}.csv", viewer.calibrated_size, viewer.fps
    )


def _wait_until_ready(cameras: Sequence[_Camera], stop: threading.Event, stopped: Callable[[], bool]) -> None:
    end_s = time.monotonic() + READY_S
    while not all(camera.ready.is_set() for camera in cameras) and not stop.is_set() and not stopped():
        if time.monotonic() > end_s:
            late = ", ".join(camera.result.name for camera in cameras if not camera.ready.is_set())
            raise UserError(f"{late}: no image within {READY_S:.0f} s: see zenocap cameras")
        time.sleep(0.02)


def _until_end(
    cameras: Sequence[_Camera],
    folder: Path,
    begin_ns: int,
    seconds: float | None,
    stopped: Callable[[], bool],
    report: Callable[[str], None],
    free_bytes: Callable[[Path], int],
) -> str:
    """Wait for the end; returns why it is early, else an empty text."""
    estimated, looked_s = False, 0.0
    while not stopped() and not cameras[0].stop.is_set():
        passed_s = (time.time_ns() - begin_ns) / 1e9
        if seconds is not None and passed_s >= seconds:
            return ""
        if passed_s - looked_s >= LOOK_S:
            looked_s = passed_s
            written = sum(camera.writer.bytes for camera in cameras)
            rate, free = written / passed_s, free_bytes(folder)
            if free < RESERVE_BYTES + RESERVE_S * rate:
                return f"the disk is nearly full: {free / 1e6:.0f} MB are left"
            if not estimated and passed_s >= ESTIMATE_S:
                estimated, lasts_s = True, (free - RESERVE_BYTES) / max(rate, 1.0)
                short = "; that is less than --seconds" if seconds is not None and lasts_s < seconds - passed_s else ""
                lasts = f"{lasts_s / 60:.0f} minutes" if lasts_s < LONG_S else f"{lasts_s / 3600:.0f} hours"
                report(f"{rate * 60 / 1e6:.0f} MB a minute; the disk lasts for {lasts}{short}")
        time.sleep(0.02)
    return ""
