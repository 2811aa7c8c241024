"""One video that is being recorded: any thread gives images, another writes them."""

import queue
import shutil
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from zenocap.common.arrays import Image
from zenocap.common.video.parameters import DISK_HANGS, ENDS_S, LOOK_S, RESERVE_BYTES, RESERVE_S
from zenocap.common.video.video_writer import VideoWriter, queue_length


def free_bytes_of(path: Path) -> int:
    """Free space of the disk that has `path`, bytes."""
    return shutil.disk_usage(path).free


class Recorder:
    """Writes the images captured in [begin_ns, end_ns); nothing before `begin`.

    failure: why it ended early: the disk is nearly full, or cannot be written.  ready: whether an image has come.
    complete: whether an image of after the end has come.  writer: has numbers and times of what is written.
    """

    def __init__(
        self, video: Path, times: Path, size: tuple[int, int], fps: float, free_bytes: Callable[[Path], int] = free_bytes_of
    ) -> None:
        """size: (width, height), px.  Raises UserError when the files cannot be written."""
        self.writer = VideoWriter(video, times, size, fps)
        self._folder, self._free_bytes = video.parent, free_bytes
        self._interval: tuple[int, int | None] | None = None
        self._queue: queue.Queue[tuple[Image, int] | None] = queue.Queue(queue_length(size))
        self._closed = threading.Event()
        self.ready, self.complete, self.failure, self.lost = False, False, "", 0
        self._thread = threading.Thread(target=self._write, name="film-writer", daemon=True)
        self._thread.start()

    def begin(self, begin_ns: int, duration_ns: int) -> None:
        """Record from `begin_ns` on, for `duration_ns`, 0 for until `end`."""
        self._interval = begin_ns, begin_ns + duration_ns if duration_ns else None

    def offer(self, image: Image, captured_ns: int) -> None:
        """An image at the size of the video; never waits."""
        self.ready = True
        interval = self._interval
        if interval is None or captured_ns < interval[0] or self.failure or self._closed.is_set():
            return
        if interval[1] is not None and captured_ns >= interval[1]:
            self.complete = True
            return
        try:
            self._queue.put_nowait((image, captured_ns))
        except queue.Full:
            self.lost += 1

    def end(self) -> None:
        """End the file; one without frames is removed, and one on a disk that does not respond is left."""
        if self._closed.is_set():
            return
        self._closed.set()
        end_s = time.monotonic() + ENDS_S
        with suppress(queue.Full):
            self._queue.put(None, timeout=ENDS_S)
        self._thread.join(max(0.0, end_s - time.monotonic()))
        if self._thread.is_alive():
            self.failure = self.failure or DISK_HANGS
            self.lost += self._queue.qsize()  # with the end in place of the frame that is being written
            return
        try:
            self.writer.close()
        except Exception as error:  # of FFmpeg, a full disk among them
            self.failure = self.failure or f"{error}"
        if not self.writer.frames:
            self.writer.remove()

    def _write(self) -> None:
        begin_s = looked_s = time.monotonic()
        try:
            while (item := self._queue.get()) is not None:
                if self.failure:
                    self.lost += 1
                    continue
                self.writer.write(*item)
                now_s = time.monotonic()
                if now_s - looked_s >= LOOK_S:
                    looked_s, free = now_s, self._free_bytes(self._folder)
                    if free < RESERVE_BYTES + RESERVE_S * self.writer.bytes / (now_s - begin_s):
                        self.failure = f"the disk is nearly full: {free / 1e6:.0f} MB are left"
        except Exception as error:  # of FFmpeg and of the disk: reported to who films
            self.failure = f"{error}"
            while self._queue.get() is not None:
                self.lost += 1
