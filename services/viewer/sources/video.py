"""Video files as a source: every frame without delay, or in real time."""

import os
from collections.abc import Generator, Iterator
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.rig.sources import VideoFile
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import AccessDenied, EndedEarly, OpenError, Playback, Size
from zenocap.services.viewer.sources.resize import Fit

MISCOUNTED = 0.01  # share by which the frame count of a container may be wrong
LATE_FRAMES = 1.0  # frames by which a live file may be late before frames are dropped


class _Reader:
    """One pass through a file.  Raises OpenError, AccessDenied, SizeMismatch, EndedEarly."""

    def __init__(self, path: Path, fit: Fit) -> None:
        self._path, self._fit, self._read = path, fit, 0
        if not path.is_file():
            raise OpenError(f"{path}: no such video file")
        if not os.access(path, os.R_OK):
            raise AccessDenied(f"{path}: no permission to read this video file")
        self._capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
        if not self._capture.isOpened():
            raise OpenError(f"{path}: not a video that can be decoded: the file is damaged or its codec is unknown")
        self.declared = max(0, int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT)))
        self.fps = float(self._capture.get(cv2.CAP_PROP_FPS))
        if not 0 < self.fps <= 1000:
            self.close()
            raise OpenError(f"{path}: frame rate {self.fps}: allowed: above 0 to 1000 a second; convert the video")

    def next(self, decode: bool) -> tuple[bool, Image | None]:
        """Return whether there is another frame, and, with `decode`, its image at the working size."""
        if not self._capture.grab():
            self._check_length()
            return False, None
        self._read += 1
        if not decode:
            return True, None
        decoded, image = self._capture.retrieve()
        if not decoded:
            raise EndedEarly(f"{self._path}: frame {self._read - 1} of {self.declared} cannot be decoded")
        return True, self._fit(np.asarray(image, dtype=np.uint8))

    def _check_length(self) -> None:
        missing = self.declared - self._read
        if self._read == 0 or missing > max(1.0, MISCOUNTED * self.declared):
            problem = "the file is empty or damaged" if self._read == 0 else "the file is cut or damaged"
            raise EndedEarly(f"{self._path}: {self._read} frames read, {self.declared} declared: {problem}")

    @property
    def read(self) -> int:
        return self._read

    def close(self) -> None:
        self._capture.release()


def taken(index: int, fps: float, own_fps: float) -> bool:
    """True for the first frame of each period of 1/fps s; `index`: frame of a file with rate `own_fps`."""
    return index == 0 or int(index * fps / own_fps + 1e-6) > int((index - 1) * fps / own_fps + 1e-6)


def video_frames(
    source: VideoFile, fps: float, calibrated: Size, working: Size, playback: Playback, preroll: int = 0
) -> Iterator[Frame]:
    """Yield the frames of a file, at most `fps` per second, preceded by those of its T-pose video, if any.

    preroll: number of first frames that are never dropped, for the background model.  Raises SourceError.
    The first frame of the file has number 0 and the time `epoch_ns`; the times of the T-pose video are earlier.
    """
    if source.initial is not None:
        yield from _initial(source.initial, fps, calibrated, working, playback)
    first = 0
    while True:
        count = yield from _pass(source.path, fps, Fit(str(source.path), calibrated, working), playback, first, preroll)
        if not playback.loop:
            return
        first += count


def median_picture(path: Path, fit: Fit, count: int = 41) -> Image:
    """Median of `count` frames spread over a file, at the working size.  Raises SourceError."""
    reader = _Reader(path, fit)
    try:
        every = max(1, reader.declared // count)
        pictures = []
        while True:
            has_frame, image = reader.next(reader.read % every == every // 2)
            if image is not None:
                pictures.append(image)
            if not has_frame:
                return np.asarray(np.median(np.stack(pictures), axis=0), dtype=np.uint8)
    finally:
        reader.close()


def _initial(path: Path, fps: float, calibrated: Size, working: Size, playback: Playback) -> Iterator[Frame]:
    reader = _Reader(path, Fit(str(path), calibrated, working))
    try:
        index = 0
        while True:
            has_frame, image = reader.next(taken(index, fps, reader.fps))
            if not has_frame:
                return
            if image is not None:
                captured_ns = playback.time_of(index - reader.declared, reader.fps)
                if playback.live:
                    playback.wait_until(captured_ns)
                yield Frame(index, captured_ns, image, initial=True)
            index += 1
    finally:
        reader.close()


def _pass(path: Path, fps: float, fit: Fit, playback: Playback, first: int, preroll: int) -> Generator[Frame, None, int]:
    """Yield the frames of one pass, numbered from `first`; returns the number of frames of the file."""
    reader = _Reader(path, fit)
    try:
        taken_frames = 0
        while True:
            index = first + reader.read
            captured_ns = playback.time_of(index, reader.fps)
            decode = taken(reader.read, fps, reader.fps)
            if decode and playback.live and taken_frames >= preroll:
                late = playback.clock.now_ns() - captured_ns > LATE_FRAMES * 1e9 / min(fps, reader.fps)
                wanted = playback.wants(captured_ns)
                if late and wanted and taken_frames:
                    playback.count_late()
                decode = wanted and not late
            has_frame, image = reader.next(decode)
            if not has_frame:
                return reader.read
            if image is not None:
                if playback.live:
                    playback.wait_until(captured_ns)
                taken_frames += 1
                yield Frame(index, captured_ns, image)
    finally:
        reader.close()


def declared_frames(path: Path, fps: float) -> int:
    """Number of frames that a file declares, at most `fps` per second; 0 when unknown."""
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    count, own_fps = capture.get(cv2.CAP_PROP_FRAME_COUNT), capture.get(cv2.CAP_PROP_FPS)
    capture.release()
    return max(0, int(count * min(1.0, fps / own_fps))) if own_fps > 0 else 0
