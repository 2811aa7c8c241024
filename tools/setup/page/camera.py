"""A camera that a thread reads without end: its newest images, and the measures of them."""

import logging
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Viewer
from zenocap.common.rig.sources import Device
from zenocap.common.runtime.clock import RealClock
from zenocap.common.vision.image_measures import brightness, exposure, focus, grey_of, light, noise
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import ADVICE_LIGHT_S
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import live_images
from zenocap.services.viewer.sources.stamps import SourceRate
from zenocap.tools.setup.page.advice import Measures
from zenocap.tools.setup.page.parameters import KEPT_S, LATE_S, RETRY_S

logger = logging.getLogger(__name__)
STOPPED_S = 1.0  # for a camera to close; chosen by hand

Opener = Callable[[Viewer, Playback, SourceRate], Iterator[Frame]]


class _Stopped(Exception):
    """Ends a camera that waits to be opened again."""


class LiveCamera:
    """One camera, from `start` to `stop`.  A video file is played in real time, for ever if `loop`.

    epoch_ns: capture time of the first frame of a file.  failure: of the last try to open it.  All methods are thread-safe.
    """

    def __init__(self, viewer: Viewer, epoch_ns: int, *, loop: bool = True, opener: Opener = live_images) -> None:
        self.viewer, self.name = viewer, viewer.camera.name
        self.failure: UserError | None = None
        self.looks = 0  # images so far
        self.ended = False  # of a file
        self._epoch_ns, self._loop, self._opener = epoch_ns, loop, opener
        self._lock, self._stop, self._again = threading.Lock(), threading.Event(), threading.Event()
        self._frames: deque[Frame] = deque()
        self._times_s: deque[float] = deque()
        self._cells: deque[Floats] = deque()
        self._received_s = 0.0
        self._note = ""
        self._rate = SourceRate()
        self._best_focus = 0.0
        self._thread = threading.Thread(target=self._run, name=f"camera-{viewer.id}", daemon=True)

    @property
    def is_live(self) -> bool:
        """Whether it is a camera or stream."""
        return self.viewer.source.live

    @property
    def newest(self) -> Frame | None:
        """The newest image; None before the first."""
        with self._lock:
            return self._frames[-1] if self._frames else None

    @property
    def recent(self) -> list[Frame]:
        """The images of the last KEPT_S, the oldest first."""
        with self._lock:
            return list(self._frames)

    @property
    def period_s(self) -> float:
        """Time between two images: as measured, else as requested."""
        rate = self._rate.counts().get("source_frames_per_1000_s", 0)
        return 1000.0 / rate if rate else 1.0 / self.viewer.fps

    @property
    def problem(self) -> str:
        """Why there is no image now; "" while there are images."""
        if self.ended:
            return "the video has ended"
        if self.newest is not None and time.monotonic() - self._received_s < LATE_S:
            return ""
        if self.failure is not None:
            return str(self.failure)
        if self.newest is None:
            return "opening: automatic exposure and focus settle for some seconds" if self.is_live else "opening"
        return self._note or f"no image for {time.monotonic() - self._received_s:.0f} s"

    def start(self) -> None:
        self._thread.start()

    def stop(self, wait_s: float = STOPPED_S) -> None:
        """Close the camera; a thread that is blocked in a driver is abandoned.  wait_s: 0 to begin only."""
        self._stop.set()
        if self._thread.ident is not None and wait_s > 0:
            self._thread.join(wait_s)

    def settle(self) -> None:
        """Open the camera again, whose automatic exposure, white balance and focus then settle anew; measure anew."""
        self._again.set()
        self.measure_anew()

    def measure_anew(self) -> None:
        """Forget the best focus and the brightness so far."""
        with self._lock:
            self._best_focus = 0.0
            self._times_s.clear()
            self._cells.clear()

    def measures(self) -> Measures:
        """Measures of the newest images."""
        with self._lock:
            frames, times, cells = list(self._frames)[-2:], list(self._times_s), list(self._cells)
        counts = self._rate.counts()
        rate, jitter_us = counts.get("source_frames_per_1000_s"), counts.get("source_jitter_us")
        found = Measures(
            rate=rate / 1000.0 if rate else None,
            requested_rate=self.viewer.fps,
            jitter_s=jitter_us / 1e6 if jitter_us is not None else None,
            best_focus=self._best_focus,
        )
        if len(frames) < 2 or self.problem or frames[0].image.shape != frames[1].image.shape:
            return found
        image, grey = frames[1].image, grey_of(frames[1].image)
        noisy = noise(grey_of(frames[0].image), grey)
        focused = focus(grey, noisy if noisy == noisy else 0.0)
        with self._lock:
            best = self._best_focus = max(self._best_focus, focused)
        exposed, changing = exposure(image), light(times, cells)
        return replace(found, focus=focused, best_focus=best, exposure=exposed, noise=noisy, light=changing)

    def _run(self) -> None:
        with suppress(_Stopped):
            while not self._stop.is_set() and not self.ended:
                self._again.clear()
                if self.failure is None or not self._is_missing():
                    self._read()
                if self.failure is not None:
                    self._pause(RETRY_S)

    def _is_missing(self) -> bool:
        """Whether it is a camera of Linux that is not plugged in."""
        source = self.viewer.source
        return sys.platform == "linux" and isinstance(source, Device) and not source.file.exists()

    def _read(self) -> None:
        """Read until the end of a file, a failure, or `settle`."""
        playback = Playback(self._epoch_ns, RealClock(), loop=self._loop, sleep=self._pause, report=self._report)
        frames = self._opener(self.viewer, playback, self._rate)
        try:
            for frame in frames:
                self.failure = None
                self._add(frame)
                if self._stop.is_set() or self._again.is_set():
                    return
            self.ended = True
        except _Stopped:
            raise
        except UserError as error:
            self.failure = error
        except Exception as error:  # any error of a driver is shown on the page instead of ending this thread
            logger.exception("%s: failed", self.name)
            self.failure = UserError(f"{self.name}: {error}")
        finally:
            close = getattr(frames, "close", None)
            if callable(close):
                close()

    def _add(self, frame: Frame) -> None:
        cells, time_s = brightness(frame.image), frame.captured_ns / 1e9
        if not self.is_live:
            self._rate.add(frame.captured_ns)
        with self._lock:
            if self._frames and self._frames[-1].image.shape != frame.image.shape:
                self._frames.clear()
            self.looks += 1
            self._received_s = time.monotonic()
            self._frames.append(frame)
            while len(self._frames) > 2 and frame.captured_ns - self._frames[0].captured_ns > KEPT_S * 1e9:
                self._frames.popleft()
            self._times_s.append(time_s)
            self._cells.append(cells)
            while time_s - self._times_s[0] > ADVICE_LIGHT_S:
                self._times_s.popleft()
                self._cells.popleft()

    def _pause(self, seconds: float) -> None:
        if self._stop.wait(seconds):
            raise _Stopped

    def _report(self, text: str) -> None:
        self._note = text
        logger.warning("%s", text)


def first_epoch_ns(delay_s: float) -> int:
    """Capture time of the first frame of all files."""
    return time.time_ns() + round(delay_s * 1e9)


def stop_all(cameras: Sequence[LiveCamera]) -> None:
    """Close all cameras at once; see `LiveCamera.stop`."""
    end_s = time.monotonic() + STOPPED_S
    for wait in (False, True):
        for camera in cameras:
            camera.stop(max(0.0, end_s - time.monotonic()) if wait else 0.0)
