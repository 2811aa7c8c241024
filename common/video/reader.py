"""Decoding of a video file: its frames in order, each with the time that its container gives."""

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice, pairwise
from pathlib import Path
from typing import TypeVar

import av
import cv2
import numpy as np
from av.codec.hwaccel import HWAccel
from av.container import InputContainer
from av.error import FFmpegError, InvalidDataError
from av.video.stream import VideoStream

from zenocap.common.arrays import Image
from zenocap.common.closable import Closable
from zenocap.common.errors import AccessDenied, EndedEarly, OpenError
from zenocap.common.video.frame_times import FrameTimes, Timing, timing_of

MISCOUNTED = 0.01  # greatest relative error of a container's frame count
MAX_FPS = 1000.0
MIN_PX = 16  # least width and height of images
PROBED_FRAMES = 240  # whose intervals are compared with the mean rate
MISSING_RATIO = Fraction(105, 100)  # of the median rate to the mean one, from which frames are missing
THREADS = 4  # of one decoder at most; views are decoded beside each other
# By the turn, counterclockwise in degrees, that a file asks for.
QUARTER_TURNS = {90: cv2.ROTATE_90_COUNTERCLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_CLOCKWISE}
T = TypeVar("T")


@dataclass(frozen=True)
class VideoFrame:
    """A decoded frame.  time_ns: from the first frame of the file on."""

    index: int
    time_ns: int
    _decoded: av.VideoFrame

    def image(self) -> Image:
        """(height, width, 3) blue, green, red; turned as the file asks for."""
        image = self._decoded.to_ndarray(format="bgr24")
        turn = QUARTER_TURNS.get(round(self._decoded.rotation) % 360)
        return np.asarray(image if turn is None else cv2.rotate(image, turn), dtype=np.uint8)


def is_known(stream: VideoStream) -> bool:
    """Whether FFmpeg knows the codec; without one PyAV's streams have no context, of which its stub says nothing."""
    return getattr(stream, "codec_context", None) is not None


def _open(path: Path, device: HWAccel | None = None) -> InputContainer:
    return av.open(str(path), metadata_errors="replace", hwaccel=device)


def opened(path: Path) -> tuple[InputContainer, str]:
    """The file with a hardware decoder; else with that in software, and the reason in words.  Raises as `av.open`."""
    container = _open(path)
    if not container.streams.video or not is_known(container.streams.video[0]):
        return container, ""
    codec = container.streams.video[0].codec_context.codec
    kinds = [config.device_type.name for config in codec.hardware_configs or () if config.is_supported]
    reasons = []
    for kind in kinds:
        try:
            by_hardware = _open(path, HWAccel(kind, allow_software_fallback=True))
        except (FFmpegError, NotImplementedError, ValueError, RuntimeError) as error:
            reasons.append(f"{kind}: {getattr(error, 'strerror', None) or error}")
            continue
        if by_hardware.streams.video[0].codec_context.is_hwaccel:
            container.close()
            return by_hardware, ""
        by_hardware.close()
        reasons.append(f"{kind}: not for this video")
    return container, "; ".join(reasons) or f"this FFmpeg has no hardware decoder for {codec.name}"


def _nominal_rate(path: Path, mean: Fraction) -> Fraction:
    """The mean rate, or that of the median interval of the first frames where it is much higher: frames are missing."""
    try:
        with _open(path) as container:
            packets = container.demux(container.streams.video[0])
            stamps = sorted(one.pts for one in islice(packets, PROBED_FRAMES) if one.pts is not None)
            base = container.streams.video[0].time_base or Fraction(0)
    except FFmpegError:
        return mean
    intervals = sorted(b - a for a, b in pairwise(stamps) if b > a)
    if not intervals or not base:
        return mean
    median = 1 / (intervals[len(intervals) // 2] * base)
    return median if median > mean * MISSING_RATIO else mean


def until_cut(frames: Iterable[T]) -> Iterator[T]:
    """Frames up to where their file is cut or cannot be read further: what was read of it counts."""
    with suppress(EndedEarly):
        yield from frames


@dataclass(frozen=True)
class VideoSummary:
    """Counts of a file that was read.  damaged: frames that could not be decoded.  estimated: frames without an own time.

    software: why it was decoded in software although hardware was asked for, in words; empty otherwise.
    """

    timing: Timing
    damaged: int
    estimated: int
    software: str = ""


class VideoReader(Closable):
    """One pass through a video file.

    fps: frames/s, the mean that the file declares, or where frames are missing that of its intervals.
    declared: number of frames, 0 when unknown.  size: (width, height) of the images, px.
    A damaged frame is left out and counted; the others keep their times.
    """

    def __init__(self, path: Path, hardware: bool = False) -> None:
        """hardware: whether to decode by hardware where that is possible.  Raises OpenError, AccessDenied."""
        self.path, self.damaged = path, 0
        if not path.is_file():
            raise OpenError(f"{path}: no such video file")
        if not os.access(path, os.R_OK):
            raise AccessDenied(f"{path}: no permission to read this video file")
        try:
            self._container, self._software = opened(path) if hardware else (_open(path), "")
        except (FFmpegError, ValueError) as error:
            raise OpenError(f"{path}: not a video that can be decoded: the file is damaged or no video") from error
        if not self._container.streams.video:
            self.close()
            raise OpenError(f"{path}: has no video stream: allowed: a video file")
        self._stream = self._container.streams.video[0]
        if not is_known(self._stream):
            self.close()
            raise OpenError(f"{path}: a codec that this FFmpeg does not know: allowed: a video in another codec")
        self._stream.thread_type = "AUTO"
        self._stream.codec_context.thread_count = min(THREADS, os.cpu_count() or 1)
        rate = _nominal_rate(path, self._stream.average_rate or self._stream.guessed_rate or Fraction(0))
        self.fps, self._duration_ns = float(rate), self._declared_duration_ns()
        self.declared = self._stream.frames or round(self._duration_ns * self.fps / 1e9)
        self.codec, self.format = self._stream.codec_context.name, self._stream.codec_context.pix_fmt or ""
        if not 0 < self.fps <= MAX_FPS:
            self.close()
            raise OpenError(f"{path}: frame rate {self.fps}: allowed: above 0 to {MAX_FPS:g} a second; convert the video")
        self._times = FrameTimes(self._stream.time_base or 1 / rate, round(1e9 / rate))
        self._frames = self._decoded()
        self._waiting = self._first()
        self.size = self._size()
        if min(self.size) < MIN_PX:
            self.close()
            raise OpenError(f"{path}: images of {self.size[0]} x {self.size[1]} px: allowed: at least {MIN_PX} x {MIN_PX}")

    def next(self) -> VideoFrame | None:
        """The next frame, None after the last.  Raises EndedEarly where the file is cut or cannot be read further."""
        decoded, self._waiting = self._waiting or next(self._frames, None), None
        if decoded is None:
            self._check_length()
            return None
        return VideoFrame(self.read, self._times.next(decoded.pts), decoded)

    @property
    def read(self) -> int:
        """Number of frames so far."""
        return len(self._times.times_ns)

    @property
    def end_ns(self) -> int:
        """One frame period after the last frame so far, nanoseconds from the first one on."""
        times = self._times.times_ns
        return (times[-1] if times else -self._times.period_ns) + self._times.period_ns

    def summary(self) -> VideoSummary:
        """Counts so far."""
        return VideoSummary(timing_of(self._times.times_ns), self.damaged, self._times.estimated, self._software)

    def close(self) -> None:
        self._container.close()

    def _first(self) -> av.VideoFrame | None:
        """The first frame, with the size after the turn; None without one."""
        try:
            return next(self._frames, None)
        except EndedEarly as error:
            self.close()
            raise OpenError(f"{self.path}: not a video that can be decoded: {error}") from error

    def _size(self) -> tuple[int, int]:
        if self._waiting is None:
            return self._stream.codec_context.width, self._stream.codec_context.height
        width, height = self._waiting.width, self._waiting.height
        return (height, width) if round(self._waiting.rotation) % 180 else (width, height)

    def _decoded(self) -> Iterator[av.VideoFrame]:
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets, None)
            except FFmpegError as error:
                raise EndedEarly(f"{self.path}: {self.read} frames read, then: {error.strerror}") from error
            if packet is None:
                return
            try:
                frames = packet.decode()
            except InvalidDataError:
                self.damaged += 1
                continue
            except FFmpegError as error:
                raise EndedEarly(f"{self.path}: {self.read} frames read, then: {error.strerror}") from error
            for frame in frames:
                if frame.is_corrupt:
                    self.damaged += 1
                else:
                    yield frame

    def _declared_duration_ns(self) -> int:
        """Duration of the video stream as declared; 0 when unknown.  That of the container may be of its sound."""
        if self._stream.duration is not None and self._stream.time_base is not None:
            return round(self._stream.duration * self._stream.time_base * 10**9)
        hours, minutes, seconds = (["0", "0", *self._stream.metadata.get("DURATION", "0").split(":")])[-3:]
        try:
            return round((int(hours) * 3600 + int(minutes) * 60 + float(seconds)) * 1e9)
        except ValueError:
            return 0

    def _check_length(self) -> None:
        """Raise EndedEarly when there are fewer frames than declared, or the last one is long before the declared end."""
        read = self.read + self.damaged
        if self._stream.frames:
            cut = self.declared - read > max(1.0, MISCOUNTED * self.declared)
        else:
            end_ns = self.end_ns + max(0, self._times.first_ns)  # Matroska counts the duration from time 0
            cut = self._duration_ns - end_ns > max(MISCOUNTED * self._duration_ns, 2e9 / self.fps)
        if self.read == 0 or cut:
            problem = "the file is empty or damaged" if self.read == 0 else "the file is cut or damaged"
            raise EndedEarly(f"{self.path}: {self.read} frames read, {self.declared} declared: {problem}")
