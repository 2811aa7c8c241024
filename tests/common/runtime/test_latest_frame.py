"""The newest frame is delivered once; replaced frames are counted."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass

from zenocap.common.runtime.latest_frame import NewestFrame


@dataclass(frozen=True)
class Image:
    frame: int
    captured_ns: int = 0


def read_all(frames: NewestFrame[Image]) -> None:
    frames.start()
    frames._thread.join(60.0)


def test_the_newest_frame_is_kept_and_replaced_frames_are_counted() -> None:
    """The callback is called for each frame and at the end."""
    calls = []
    frames = NewestFrame(iter(Image(frame) for frame in range(5)), lambda: calls.append(1))
    read_all(frames)
    assert len(calls) == 6
    assert not frames.ended
    assert frames.counts() == (4, 4)
    assert frames.take() == Image(4)
    assert frames.take() is None
    assert frames.counts() == (5, 4)
    assert frames.dropped == 4
    assert frames.ended


def test_the_failure_of_a_source_is_available() -> None:
    def broken() -> Iterator[Image]:
        yield Image(0)
        raise OSError("gone")

    frames = NewestFrame(broken(), lambda: None)
    read_all(frames)
    assert isinstance(frames.failure, OSError)


def test_stopping_closes_the_source() -> None:
    closed = threading.Event()
    taken = threading.Semaphore(0)

    def endless() -> Iterator[Image]:
        try:
            while True:
                taken.acquire(timeout=60.0)
                yield Image(0)
        finally:
            closed.set()

    frames = NewestFrame(endless(), lambda: None)
    frames.start()
    frames._stop.set()
    taken.release()
    frames.stop(5.0)
    assert closed.is_set()
