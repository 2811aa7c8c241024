"""A video file with the capture time of every frame."""

import csv
from fractions import Fraction
from pathlib import Path

import av
from av.error import FFmpegError
from av.video.stream import VideoStream

from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.video.parameters import CODEC, PIXELS, QP2LAMBDA, QUALITY, QUEUE, QUEUE_PX

TICKS = 1000  # a second; Matroska stores milliseconds
# What is lost at most when the process is killed: a second; FFmpeg's own limit is 5 s.
MATROSKA = {"cluster_time_limit": "1000", "flush_packets": "1"}


def queue_length(size: tuple[int, int]) -> int:
    """Number of images of `size`, (width, height) px, that may wait for a writer."""
    return max(1, min(QUEUE, QUEUE_PX // (size[0] * size[1])))


class VideoWriter:
    """Writes images with their capture times; the file, and a table with the exact times beside it.

    The container has the times in milliseconds from the first frame on, which `zenocap track` uses.
    """

    def __init__(self, path: Path, times: Path, size: tuple[int, int], fps: float) -> None:
        """size: (width, height), px.  fps: nominal.  Raises UserError."""
        self.path, self.frames, self.bytes, self.first_ns, self.last_ns = path, 0, 0, 0, 0
        self._last_tick, self._times = -1, times
        try:
            self._table = times.open("w", newline="", encoding="ascii")
            self._container = av.open(str(path), "w", container_options=MATROSKA)
        except (OSError, FFmpegError) as error:
            raise UserError(f"{path}: cannot be written: {error.strerror}") from error
        self._rows = csv.writer(self._table)
        self._rows.writerow(("frame", "captured_ns"))
        options = {"flags": "+qscale", "global_quality": str(QUALITY * QP2LAMBDA)}
        stream = self._container.add_stream(CODEC, rate=Fraction(fps).limit_denominator(1000), options=options)
        assert isinstance(stream, VideoStream)
        stream.width, stream.height = size
        stream.pix_fmt = PIXELS
        stream.codec_context.time_base = Fraction(1, TICKS)
        stream.codec_context.qmin = stream.codec_context.qmax = QUALITY
        self._stream = stream

    def write(self, image: Image, captured_ns: int) -> None:
        """Raises OSError when the disk is full."""
        if self.frames == 0:
            self.first_ns = captured_ns
        tick = max(round((captured_ns - self.first_ns) * TICKS / 1e9), self._last_tick + 1)
        frame = av.VideoFrame.from_ndarray(image, format="bgr24")
        frame.pts, frame.time_base = tick, Fraction(1, TICKS)
        packets = self._stream.encode(frame)
        self._container.mux(packets)
        self.bytes += sum(packet.size for packet in packets)
        self._rows.writerow((self.frames, captured_ns))
        self._last_tick, self.last_ns = tick, captured_ns
        self.frames += 1

    def remove(self) -> None:
        """Remove both files."""
        self.path.unlink(missing_ok=True)
        self._times.unlink(missing_ok=True)

    def close(self) -> None:
        """End the file so that players know its length."""
        try:
            self._container.mux(self._stream.encode())
        finally:
            self._container.close()
            self._table.close()
