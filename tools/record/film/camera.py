"""A camera of this machine that is filmed."""

import queue
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Viewer
from zenocap.common.runtime.clock import RealClock
from zenocap.common.video.parameters import DISK_HANGS, ENDS_S
from zenocap.common.video.video_writer import VideoWriter, queue_length
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.tools.record.film.parameters import LATE_PERIODS

CAMERA_HANGS = "the camera does not respond: the video is left unfinished"
Opener = Callable[[Viewer, Playback], Iterator[Frame]]


@dataclass
class Filmed:
    """Recording of one camera.  lost: frames that the writer could not take.  away: failures of the camera.

    begin_ns: start of the film, by the clock of `first_ns`; 0 where it is not known.
    """

    name: str
    frames: int = 0
    first_ns: int = 0
    last_ns: int = 0
    lost: int = 0
    away: int = 0
    begin_ns: int = 0

    def late_text(self, fps: float) -> str:
        """Warning of a first image long after the start of the film; empty otherwise.  fps: nominal rate, frames/s."""
        late_s = (self.first_ns - self.begin_ns) / 1e9
        if not self.begin_ns or not self.frames or late_s * fps <= LATE_PERIODS:
            return ""
        return (
            f"{self.name}: first image {late_s * 1e3:.0f} ms after the start of the film, {late_s * fps:.1f} periods: its "
            "time may be wrong by that: check with zenocap sync"
        )

    @property
    def rate(self) -> float:
        """Frames/s, from the first to the last."""
        return (self.frames - 1) * 1e9 / (self.last_ns - self.first_ns) if self.frames > 1 else 0.0


class _Stopped(Exception):
    """Ends a camera that waits to be opened again."""


@dataclass
class LocalCamera:
    """One camera: a thread takes its frames, another writes them."""

    viewer: Viewer
    writer: VideoWriter
    opener: Opener
    stop: threading.Event
    begin_ns: int | None = None  # frames captured before are left out; None: all are
    end_ns: int | None = None  # as are those from this time on
    result: Filmed = field(init=False)
    ready: threading.Event = field(default_factory=threading.Event)
    failure: Exception | None = None
    _queue: "queue.Queue[Frame | None]" = field(init=False)
    _threads: list[threading.Thread] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.result = Filmed(self.viewer.camera.name)
        self._queue = queue.Queue(queue_length(self.viewer.calibrated_size))

    def start(self) -> None:
        for work in (self._take, self._write):
            self._threads.append(threading.Thread(target=work, name=f"film-{self.viewer.id}", daemon=True))
            self._threads[-1].start()

    def join(self) -> None:
        for thread in self._threads:
            thread.join(ENDS_S)
        if self._threads[-1].is_alive():
            waiting = self._queue.qsize()  # with the end in place of the frame that is being written
            self.failure = self.failure or UserError(DISK_HANGS if waiting else CAMERA_HANGS)
            self.result.lost += waiting
        self.result.frames = self.writer.frames
        self.result.first_ns, self.result.last_ns = self.writer.first_ns, self.writer.last_ns

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
                if self.end_ns is not None and frame.captured_ns >= self.end_ns:
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
