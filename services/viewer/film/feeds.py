"""Image feeds of a film: the source of a running viewer, or a camera opened for it."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from typing import Protocol

from zenocap.common.arrays import Image
from zenocap.common.messages import FilmQuery
from zenocap.common.rig.camera_settings import LOCKED, CameraSettings, Setting
from zenocap.common.rig.sources import Device, Stream
from zenocap.common.runtime.clock import RealClock
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import images_of

logger = logging.getLogger(__name__)

Receive = Callable[[Image, int], None]
Opener = Callable[[Device | Stream, tuple[int, int], float, Playback], Iterator[Frame]]


class Feed(Protocol):
    """Images for one film at a time.  away: how often the camera failed since `open`.  failure: why no more images come."""

    away: int
    failure: str

    def size_and_rate(self, query: FilmQuery) -> tuple[tuple[int, int], float]:
        """Size (width, height) of the images, px, and their nominal rate, frames/s."""

    def open(self, query: FilmQuery, receive: Receive) -> None:
        """Pass all images to `receive`, from another thread, until `close`."""

    def close(self) -> None: ...


class Tap:
    """Passes the images of a running source on, at the calibrated size and not rectified, while a film is open."""

    def __init__(self, size: tuple[int, int], fps: float) -> None:
        """size: calibrated (width, height), px.  fps: of the viewer."""
        self._size, self._fps = size, fps
        self._receive: Receive | None = None
        self.away, self.failure = 0, ""

    @property
    def is_open(self) -> bool:
        return self._receive is not None

    def offer(self, image: Image, captured_ns: int) -> None:
        """Called by the source for every frame."""
        receive = self._receive
        if receive is not None:
            receive(image, captured_ns)

    def lost(self) -> None:
        """Called by the source when its camera fails and will be opened again."""
        self.away += self.is_open

    def size_and_rate(self, query: FilmQuery) -> tuple[tuple[int, int], float]:
        return self._size, self._fps

    def open(self, query: FilmQuery, receive: Receive) -> None:
        self.away = 0
        self._receive = receive

    def close(self) -> None:
        self._receive = None


class _Closed(Exception):
    """Ends a camera that waits to be opened again."""


class CameraFeed:
    """A camera of this machine that is opened for each film and given back afterwards.  opener: see `images_of`."""

    def __init__(self, source: Device | Stream, opener: Opener = images_of) -> None:
        self._source, self._opener = source, opener
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self.away, self.failure = 0, ""

    def size_and_rate(self, query: FilmQuery) -> tuple[tuple[int, int], float]:
        return query.size, query.fps

    def open(self, query: FilmQuery, receive: Receive) -> None:
        self.away, self.failure, self._stop = 0, "", threading.Event()
        self._thread = threading.Thread(
            target=self._take, args=(query, receive, self._stop), name="film-camera", daemon=True
        )  # fmt: skip
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join(10.0)

    def _take(self, query: FilmQuery, receive: Receive, stop: threading.Event) -> None:
        def pause(seconds: float) -> None:
            if stop.wait(seconds):
                raise _Closed

        def report(text: str) -> None:
            self.away += "trying again" in text
            logger.warning(text)

        source = self._source
        if isinstance(source, Device):
            source = Device(source.number, source.link, settings_in(query))
        playback = Playback(time.time_ns(), RealClock(), sleep=pause, report=report)
        frames = self._opener(source, query.size, query.fps, playback)
        try:
            for frame in frames:
                if stop.is_set():
                    return
                receive(frame.image, frame.captured_ns)
            self.failure = "the camera gives no more images"
        except _Closed:
            return
        except Exception as error:  # any error of a driver must reach who films
            self.failure = f"{error}"
        finally:
            close = getattr(frames, "close", None)
            if callable(close):
                close()


def settings_in(query: FilmQuery) -> CameraSettings:
    """Camera settings of a query; others than those of a camera are ignored."""

    def setting(key: str) -> Setting:
        text = query.settings.get(key, LOCKED)
        return int(text) if text.removeprefix("-").isdecimal() else text

    return CameraSettings(
        query.settings.get("format"), setting("exposure"), setting("gain"), setting("white_balance"), setting("focus")
    )
