"""Decoding of a video file: its frames in order, each with the time that its container gives."""

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice, pairwise
from math import inf
from pathlib import Path
from typing import TypeVar

import av
import cv2
import numpy as np
from av.codec.hwaccel import HWAccel
from av.container import InputContainer
from av.error import FFmpegError, InvalidDataError
from av.sidedata.sidedata import SideData
from av.sidedata.sidedata import Type as SideDataType
from av.stream import Disposition
from av.video.stream import VideoStream

from zenocap.common.arrays import LARGEST_PX, Image
from zenocap.common.closable import Closable
from zenocap.common.errors import AccessDenied, EndedEarly, OpenError
from zenocap.common.video.frame_times import FrameTimes, Timing, timing_of

MISCOUNTED = 0.01  # greatest relative error of a container's frame count
MAX_FPS = 1000.0
MIN_PX = 16  # least width and height of images
PROBED_FRAMES = 240  # whose intervals are compared with the mean rate
MISSING_RATIO = Fraction(105, 100)  # of the median rate to the mean one, from which frames are missing
THREADS = 4  # of one decoder at most; views are decoded beside each other
RAW_TIME_BASE = Fraction(1, 1_200_000)  # of FFmpeg's readers of bare streams, whose rate is its own, 25/s
# Seconds from the beginning of a file to its first frame that give a note, also in frame periods, as decoders delay by a
# few; and from which on the times are those of a camera that ran long before.  Chosen by hand.
LATE_S, LATE_PERIODS, LATEST_S = 0.1, 4, 60.0
FROM_ZERO = ("avi", "matroska", "mov")  # parts of the names of formats whose times begin at 0
CAPTURE_RATE = "com.android.capture.fps"
# In the XML of Sony's cameras at either end of a file, which FFmpeg does not read: name, rate, i for fields; bytes read.
SONY_RATE, SONY_BYTES = re.compile(rb'\b(captureFps)="([\d.]+)(i?)'), 1 << 20
OTHER_RATE = 0.1  # least relative difference of the rates of capture and of the times that gives a note; by hand
UNDECODABLE = "no picture of it can be decoded: damaged, or without a key frame: allowed: a film that begins with one"
# By the turn, counterclockwise in degrees, that a file asks for.
QUARTER_TURNS = {90: cv2.ROTATE_90_COUNTERCLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_CLOCKWISE}
# Of a JPEG, which has it near its beginning, in either order of bytes; PyAV does not give it.
ORIENTATION = re.compile(rb"Exif\0\0(?:II.*?\x12\x01\x03\0\x01\0{3}|MM.*?\x01\x12\0\x03\0{3}\x01\0)(.)", re.DOTALL)
EXIF_BYTES = 1 << 16
MIRRORS = {2: 1, 4: 0, 5: 1, 7: 1}  # by EXIF orientation: axis of `cv2.flip` that takes OpenCV's mirror out of a picture
MIRRORED = "asks for a mirrored picture: not mirrored, as cameras see it"
T = TypeVar("T")


@dataclass(frozen=True)
class VideoFrame:
    """A decoded frame.  time_ns: from the first frame of the file on, decoded or not."""

    index: int
    time_ns: int
    _decoded: av.VideoFrame
    _turn: int

    def image(self) -> Image:
        """(height, width, 3) blue, green, red; turned as the file asks for."""
        return turned_picture(self._decoded, self._turn)


def turned_picture(frame: av.VideoFrame, degrees: int) -> Image:
    """(height, width, 3) blue, green, red, of a decoded frame.  degrees: `display_turn` of it."""
    image, turn = frame.to_ndarray(format="bgr24"), QUARTER_TURNS.get(degrees)
    return np.asarray(image if turn is None else cv2.rotate(image, turn), dtype=np.uint8)


def exif_orientation(jpeg: bytes) -> int:
    """Orientation that the EXIF data of a JPEG picture ask for, 1 (none) to 8."""
    found = ORIENTATION.search(jpeg, 0, EXIF_BYTES)
    return found[1][0] if found else 1


def display_turn(frame: av.VideoFrame, orientation: int = 1) -> tuple[int, bool]:
    """Turn in degrees, counterclockwise, that a frame's display matrix asks for, and whether it asks for a mirror too.

    A mirror along an axis of the image is no turn: FFmpeg's formula gives 180 degrees for one of them.
    orientation: of its EXIF data, beside which PyAV does not give the matrix.
    """
    turn = 90 * round(frame.rotation / 90) % 360
    found: SideData | None = None
    with suppress(ValueError):  # where PyAV does not know one of them, such as the EXIF data of JPEG
        data: Iterable[SideData] = frame.side_data  # type: ignore[assignment]  # PyAV annotates a mapping of names
        found = next((one for one in data if one.type == SideDataType.DISPLAYMATRIX), None)
    if found is None:
        return (0 if orientation == 2 else turn), orientation in MIRRORS
    a, b, _, c, d = np.frombuffer(memoryview(found), dtype=np.int32)[:5].astype(np.float64)
    mirrored = bool(a * d - b * c < 0.0)
    return (0 if mirrored and abs(a) > abs(b) else turn), mirrored


def is_known(stream: VideoStream) -> bool:
    """Whether FFmpeg knows the codec; without one PyAV's streams have no context, of which its stub says nothing."""
    return getattr(stream, "codec_context", None) is not None


def films(container: InputContainer) -> list[VideoStream]:
    """The video streams, without covers and thumbnails."""
    return [one for one in container.streams.video if not one.disposition & Disposition.attached_pic]


def video_stream(path: Path, container: InputContainer) -> VideoStream:
    """The first of the `films`, of which nothing is decoded yet.

    Raises OpenError, with the container closed, without one, for an unknown codec, and for images above LARGEST_PX.
    """
    stream = next(iter(films(container)), None)
    if stream is None:
        problem = "has no video stream: allowed: a video file"
    elif not is_known(stream):
        problem = "a codec that this FFmpeg does not know: allowed: a video in another codec"
    elif (width := stream.codec_context.width) * (height := stream.codec_context.height) > LARGEST_PX:
        problem = f"images of {width} x {height} px: allowed: at most {LARGEST_PX} pixels"
    else:
        return stream
    container.close()
    raise OpenError(f"{path}: {problem}")


def _open(path: Path, device: HWAccel | None = None) -> InputContainer:
    return av.open(str(path), metadata_errors="replace", hwaccel=device)


def opened(path: Path) -> tuple[InputContainer, str]:
    """The file with a hardware decoder; else with that in software, and the reason in words.  Raises as `av.open`."""
    container = _open(path)
    if not (found := films(container)) or not is_known(found[0]):
        return container, ""
    codec = found[0].codec_context.codec
    kinds = [config.device_type.name for config in codec.hardware_configs or () if config.is_supported]
    reasons = []
    for kind in kinds:
        try:
            by_hardware = _open(path, HWAccel(kind, allow_software_fallback=True))
        except (FFmpegError, NotImplementedError, ValueError, RuntimeError) as error:
            reasons.append(f"{kind}: {getattr(error, 'strerror', None) or error}")
            continue
        if films(by_hardware)[0].codec_context.is_hwaccel:
            container.close()
            return by_hardware, ""
        by_hardware.close()
        reasons.append(f"{kind}: not for this video")
    return container, "; ".join(reasons) or f"this FFmpeg has no hardware decoder for {codec.name}"


def _nominal_rate(path: Path, mean: Fraction) -> Fraction:
    """The mean rate, or that of the median interval of the first frames where it is much higher: frames are missing."""
    try:
        with _open(path) as container:
            stream = films(container)[0]
            packets, base = container.demux(stream), stream.time_base or Fraction(0)
            stamps = sorted(one.pts for one in islice(packets, PROBED_FRAMES) if one.pts is not None)
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
    notes: what the file states about its time and pictures and does not hold, or is not followed.
    """

    timing: Timing
    damaged: int
    estimated: int
    software: str = ""
    notes: tuple[str, ...] = ()


class VideoReader(Closable):
    """One pass through a video file.

    fps: frames/s, the mean that the file declares, or where frames are missing that of its intervals.
    declared: number of frames, 0 when unknown.  size: (width, height) of the images, px.  turn: see `display_turn`.
    A damaged frame is left out and counted; the others keep their times.
    """

    def __init__(self, path: Path, hardware: bool = False) -> None:
        """hardware: whether to decode by hardware where that is possible.  Raises OpenError, AccessDenied."""
        self.path, self.damaged, self._trimmed, self._undecodable, self._orientation = path, 0, 0, 0, 1
        self._joined, self._end_of_part = False, inf  # time stamp of the first packet that is cut away behind others
        if not path.is_file():
            raise OpenError(f"{path}: no such video file")
        if not os.access(path, os.R_OK):
            raise AccessDenied(f"{path}: no permission to read this video file")
        try:
            self._container, self._software = opened(path) if hardware else (_open(path), "")
        except (FFmpegError, ValueError) as error:
            raise OpenError(f"{path}: not a video that can be decoded: the file is damaged or no video") from error
        self._stream = video_stream(path, self._container)
        self._stream.thread_type = "AUTO"
        self._stream.codec_context.thread_count = min(THREADS, os.cpu_count() or 1)
        self._bare = self._stream.time_base == RAW_TIME_BASE
        stated = self._stream.codec_context.framerate if self._bare else None
        rate = stated or _nominal_rate(path, self._stream.average_rate or self._stream.guessed_rate or Fraction(0))
        self.fps, self._duration_ns = float(rate), self._declared_duration_ns()
        self._from_zero = any(name in self._container.format.name for name in FROM_ZERO)
        shown = round(self._duration_ns * self.fps / 1e9)
        self.declared = self._stream.frames or shown
        if (
            "mov" in self._container.format.name and shown
        ):  # an edit list shows fewer; of a cut AVI the duration is shorter too
            self.declared = min(self.declared, shown)
        self.codec, self.format = self._stream.codec_context.name, self._stream.codec_context.pix_fmt or ""
        if not 0 < self.fps <= MAX_FPS:
            rate_allowed = f"frame rate {self.fps}: allowed: above 0 to {MAX_FPS:g} a second; convert the video"
            raise self._refused(rate_allowed if self._stream.codec_context.width else UNDECODABLE)
        self._times = FrameTimes(self._stream.time_base or 1 / rate, round(1e9 / rate))
        self._frames = self._decoded()
        self._waiting = self._first()
        if self._from_zero and not self._stream.frames and self._waiting:  # the duration is from time 0 on
            self.declared -= min(self.declared, round((self._waiting.pts or 0) * self._times.time_base * rate))
        self.turn, self._mirrored = display_turn(self._waiting, self._orientation) if self._waiting else (0, False)
        self._interlaced = bool(self._waiting and self._waiting.interlaced_frame)
        self.size = self._size()
        if min(self.size) < MIN_PX:
            size_allowed = f"images of {self.size[0]} x {self.size[1]} px: allowed: at least {MIN_PX} x {MIN_PX}"
            raise self._refused(size_allowed if min(self.size) else UNDECODABLE)

    def next(self) -> VideoFrame | None:
        """The next frame, None after the last.  Raises EndedEarly where the file is cut or cannot be read further."""
        decoded, self._waiting = self._waiting or next(self._frames, None), None
        if decoded is None:
            self._check_length()
            return None
        return VideoFrame(self.read, self._times.next(decoded.pts), decoded, self.turn)

    @property
    def read(self) -> int:
        """Number of frames so far."""
        return len(self._times.times_ns)

    @property
    def begin_s(self) -> float:
        """Time stamp in the file, seconds, of time 0 of its frames; known from the first frame on."""
        return self._times.begin_ns / 1e9

    @property
    def end_ns(self) -> int:
        """One frame period after the last frame so far, nanoseconds from the first one on."""
        times = self._times.times_ns
        return (times[-1] if times else -self._times.period_ns) + self._times.period_ns

    def summary(self) -> VideoSummary:
        return VideoSummary(
            timing_of(self._times.times_ns), self.damaged, self._times.estimated, self._software, tuple(self._notes())
        )

    def close(self) -> None:
        self._container.close()

    def _refused(self, problem: str) -> OpenError:
        """The error to raise for a file, which is closed."""
        self.close()
        return OpenError(f"{self.path}: {problem}")

    def _first(self) -> av.VideoFrame | None:
        """The first frame, with the size after the turn; None without one."""
        try:
            return next(self._frames, None)
        except EndedEarly as error:
            raise self._refused(f"not a video that can be decoded: {error}") from error

    def _size(self) -> tuple[int, int]:
        if self._waiting is None:
            return self._stream.codec_context.width, self._stream.codec_context.height
        width, height = self._waiting.width, self._waiting.height
        return (height, width) if self.turn % 180 else (width, height)

    def _notes(self) -> Iterator[str]:
        """Lines on contradictions within the file."""
        if (count := len(films(self._container))) > 1:
            yield f"has {count} films: the first, of {self.size[0]} x {self.size[1]} px, is used"
        yield from self._rate_notes()
        if self._trimmed:
            cut = max(self._trimmed, self._stream.frames - self.read - self.damaged - self._undecodable)
            yield f"{cut} frames are in the file and cut away by its edit list: they are left out"
        if self._joined:
            yield "its edit list joins parts of the film: their times follow each other, without what was between them"
        late_s, least_s = self._times.begin_ns / 1e9, max(LATE_S, LATE_PERIODS / self.fps)
        if self._from_zero and least_s < late_s < LATEST_S:
            yield f"its first frame is at {late_s:.2f} s: what came before is missing; times count from that frame"
        if self._undecodable:
            lost_s = self._times.start_ns / 1e9
            yield (
                f"begins between two key frames: the first {self._undecodable} frames ({lost_s:.2f} s) cannot be decoded; "
                "times count from the first of them"
            )
        if self._interlaced:
            yield "states that its pictures are interlaced, of two moments: deinterlace it, unless filmed progressively"
        if self._mirrored:
            yield MIRRORED
        ratios = (self._stream.sample_aspect_ratio, self._stream.codec_context.sample_aspect_ratio)
        shapes = list(dict.fromkeys(f"{ratio.numerator}:{ratio.denominator}" for ratio in ratios if ratio))
        if shapes not in ([], ["1:1"]):
            shape = " in the container, in its headers ".join(shapes)
            yield f"its pixels are not square ({shape}): used as stored, as in a calibration"
        if self._stream.frames and self.read - self.declared > max(1.0, MISCOUNTED * self.declared):
            yield f"{self.declared} frames declared, {self.read} read: all are used"

    def _rate_notes(self) -> Iterator[str]:
        """Lines on rates that are stated and not those of the times."""
        if self._bare and not self._stream.codec_context.framerate:
            yield f"states no frame rate: {self.fps:g}/s assumed; put it into a container with its rate, such as .mp4"
        elif self._bare:
            yield f"has no times: {self.fps:g} frames/s, as its headers state"
        name, captured = self._capture_rate()
        if captured and abs(captured / self.fps - 1.0) > OTHER_RATE:
            slow, times = captured > self.fps, max(captured / self.fps, self.fps / captured)
            yield (
                f"{name} = {captured:g}/s when it was filmed, its times have {self.fps:.4g}/s: they are used; "
                f"as {'slow motion' if slow else 'a time lapse'} it is {times:.3g} times {'slower' if slow else 'faster'}"
            )
        if self._container.format.name == "avi":
            with self.path.open("rb") as file:  # dwMicroSecPerFrame
                stated = 1e6 / max(1, int.from_bytes(file.read(36)[32:], "little"))
            if stated <= MAX_FPS and abs(stated / self.fps - 1.0) > OTHER_RATE:
                yield f"{stated:.4g}/s in the file's header, {self.fps:.4g}/s in the film's: the latter is used"

    def _capture_rate(self) -> tuple[str, float]:
        """Frames/s at which a camera filmed, as slow motion and time lapses state, and its name; 0 where none is stated."""
        tags = {key.lower(): value for key, value in (self._container.metadata | self._stream.metadata).items()}
        name, text, fields = CAPTURE_RATE, tags.get(CAPTURE_RATE, ""), ""
        with suppress(OSError), self.path.open("rb") as file:
            content = file.read(SONY_BYTES)
            file.seek(max(SONY_BYTES, self.path.stat().st_size - SONY_BYTES))
            if not text and (found := SONY_RATE.search(content + file.read())):
                name, text, fields = (one.decode() for one in found.groups())
        with suppress(ValueError):
            if 0 < (rate := float(text) / (2.0 if fields else 1.0)) < inf:
                return name, rate
        return name, 0.0

    def _decoded(self) -> Iterator[av.VideoFrame]:
        packets = self._container.demux(self._stream)
        stamps: list[int | None] | None = []  # of the packets before the first frame
        keyless = 0  # of them, before the first key frame
        while True:
            try:
                packet = next(packets, None)
            except FFmpegError as error:
                raise EndedEarly(f"{self.path}: {self.read} frames read, then: {error.strerror}") from error
            if packet is None:
                return
            self._trimmed += packet.is_discard
            self._joined |= self._is_of_later_part(packet, stamps is None)
            if stamps is not None and packet.size and not packet.is_discard:
                keyless += not packet.is_keyframe and keyless == len(stamps)
                stamps.append(packet.pts)
                self._orientation = exif_orientation(bytes(packet)) if self.codec == "mjpeg" else 1
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
                    if stamps is not None:
                        self._begin(stamps, keyless, frame.pts)
                    stamps = None
                    yield frame

    def _is_of_later_part(self, packet: "av.Packet[VideoStream]", begun: bool) -> bool:
        """Whether a packet is shown after one that the edit list cut away behind the first frame."""
        if packet.pts is not None and packet.is_discard and begun:
            self._end_of_part = min(packet.pts, self._end_of_part)
        return packet.pts is not None and not packet.is_discard and packet.pts >= self._end_of_part

    def _begin(self, stamps: Sequence[int | None], keyless: int, first: int | None) -> None:
        """Count what comes before the first frame: after a cut, also pictures that refer to one before a key frame.

        stamps: time stamps of the packets so far, none of which a bare stream has.  first: of the first frame.
        """
        before = [stamp for stamp in stamps if stamp is not None and first is not None and stamp < first]
        count = keyless if all(stamp is None for stamp in stamps) else len(before)
        self._times.start_ns = count * self._times.period_ns
        if first is not None and before:
            self._times.start_ns = round((first - min(before)) * self._times.time_base * 10**9)
        self.damaged -= min(self.damaged, keyless)
        self._undecodable = max(0, count - self.damaged)

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
        read = self.read + self.damaged + self._undecodable
        if self._container.format.name == "avi":  # it counts frames that were dropped when it was written; times skip them
            read = max(read, round((self.end_ns + max(0, self._times.begin_ns)) * self.fps / 1e9))
        if self._stream.frames:
            cut = self.declared - read > max(1.0, MISCOUNTED * self.declared)
        else:
            end_ns = self.end_ns + max(0, self._times.begin_ns)  # Matroska counts the duration from time 0
            cut = self._duration_ns - end_ns > max(MISCOUNTED * self._duration_ns, 2e9 / self.fps)
        if self.read == 0 or cut:
            problem = "the file is empty or damaged" if self.read == 0 else "the file is cut or damaged"
            raise EndedEarly(f"{self.path}: {self.read} frames read, {self.declared} declared: {problem}")
