"""The ways a source of frames can fail, and how it is played."""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from services.viewer.frame import Frame as Frame
from services.viewer.frame import Image as Image

Size = tuple[int, int]


class SourceError(RuntimeError):
    """A source that cannot go on; the text names it and says what is the matter."""


class OpenError(SourceError):
    """There is nothing to open, or it is no camera, video or picture."""


class AccessDenied(SourceError):
    """It is there, but this user may not read it."""


class SizeMismatch(SourceError):
    """Its images are not those that the calibration is for."""


class EndedEarly(SourceError):
    """It ended, or broke, before the frames it declares; the ones before were good."""


class Clock(Protocol):
    """Nanoseconds since the Unix epoch."""

    def now_ns(self) -> int: ...


@dataclass(frozen=True)
class Playback:
    """How a source is played.

    epoch_ns: capture time of a file's or the actor's frame 0, the same in every viewer; some seconds ahead, so that
    every viewer is ready by then.  live: at the source's pace, leaving out what is late; otherwise every frame, at
    once.  loop: a file starts again at its end, its frame numbers and times going on.  report: gets news of a camera.
    """

    epoch_ns: int
    clock: Clock
    live: bool = True
    loop: bool = False
    sleep: Callable[[float], None] = time.sleep
    report: Callable[[str], None] = logging.getLogger(__name__).warning

    def time_of(self, index: int, fps: float) -> int:
        """Capture time of frame `index`, nanoseconds; frames before the first have negative numbers."""
        return self.epoch_ns + round(index * 1e9 / fps)

    def wait_until(self, when_ns: int) -> None:
        while (left_ns := when_ns - self.clock.now_ns()) > 0:
            self.sleep(left_ns / 1e9)
