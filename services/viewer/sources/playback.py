"""Playback settings of a frame source."""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass

from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.frame_rate import FrameChoice
from zenocap.common.video.reader import VideoSummary

Size = tuple[int, int]


@dataclass(frozen=True)
class Playback:
    """Playback settings of a source.

    epoch_ns: capture time of frame 0 of a file or of the simulated person, equal in all viewers and some seconds in the
    future, so that every viewer is ready by then.  live: in real time, late frames are dropped; otherwise every frame
    without delay.  loop: a file is repeated, with rising frame numbers and times.  report: receives the state of a camera.
    choice: of the frames of a live source that are processed; None for all.  finished: receives what a video was, at its
    end.
    """

    epoch_ns: int
    clock: Clock
    live: bool = True
    loop: bool = False
    sleep: Callable[[float], None] = time.sleep
    report: Callable[[str], None] = logging.getLogger(__name__).warning
    choice: FrameChoice | None = None
    finished: Callable[[VideoSummary], None] = lambda _: None

    def time_of(self, index: int, fps: float) -> int:
        """Capture time of frame `index`, nanoseconds; frames before the first have negative numbers."""
        return self.epoch_ns + round(index * 1e9 / fps)

    def wants(self, captured_ns: int) -> bool:
        """Whether the next frame of the source is to be processed: all, except under overload."""
        return self.choice is None or self.choice.wants(captured_ns)

    def next_index(self, index: int, fps: float) -> int:
        """Number of the next frame of a live source, `index` or later; late frames are skipped."""
        due = max(index, int((self.clock.now_ns() - self.epoch_ns) * fps / 1e9))
        return due if self.choice is None else self.choice.next_index(index, due, self.epoch_ns, fps)

    def count_late(self) -> None:
        """Count a frame that the source drops because it is late."""
        if self.choice is not None:
            self.choice.late += 1

    def wait_until(self, when_ns: int) -> None:
        while (left_ns := when_ns - self.clock.now_ns()) > 0:
            self.sleep(left_ns / 1e9)
