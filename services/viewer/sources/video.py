"""Video files as a source: every frame without delay, or in real time."""

from collections.abc import Generator, Iterator
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.errors import EndedEarly, SourceError
from zenocap.common.rig.sources import VideoFile, empty_frames
from zenocap.common.rig.viewers import Viewer
from zenocap.common.video.reader import VideoReader
from zenocap.common.vision.empty_scene import LEAST_EMPTY, with_people
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import LATE_FRAMES
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import Fit, fit_of

MEDIAN_OF = 41  # frames of a video, whose median is its background; chosen by hand


class Thinning:
    """Choice of frames at a lower rate: of every period of 1 / fps s, the frame nearest to its beginning.

    own_fps: rate of the frames; at most `fps`: all are chosen.
    """

    def __init__(self, fps: float, own_fps: float) -> None:
        self._period_ns = None if fps >= own_fps * (1.0 - 1e-6) else 1e9 / fps
        self._half_ns = 0.5e9 / own_fps
        self._next = 0

    def takes(self, time_ns: int) -> bool:
        """Whether to take the frame at this time from the beginning; times increase."""
        if self._period_ns is None:
            return True
        if time_ns + self._half_ns < self._next * self._period_ns:
            return False
        self._next = int((time_ns + self._half_ns) / self._period_ns) + 1
        return True


def frames_of(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    """`video_frames` of a viewer; those of an empty scene are not dropped."""
    assert isinstance(viewer.source, VideoFile)
    return video_frames(viewer.source, viewer.fps, fit_of(viewer), playback, empty_frames(viewer.background))


def video_frames(source: VideoFile, fps: float, fit: Fit, playback: Playback, preroll: int = 0) -> Iterator[Frame]:
    """Yield the frames of a file, at most `fps` per second, preceded by those of its T-pose video, if any.

    preroll: number of first frames that are never dropped, for the background model.  Raises SourceError.
    The first frame of the file has number 0 and the time `epoch_ns` plus the file's offset; the times of the T-pose video
    are earlier than `epoch_ns`.
    """
    if source.initial is not None:
        yield from _initial(source.initial, source.hardware, fps, fit.named(source.initial), playback)
    first, first_ns, fit = 0, source.offset_ns, fit.named(source.path)
    while True:
        count, duration_ns = yield from _pass(source, fps, fit, playback, first, first_ns, preroll)
        if not playback.loop:
            return
        first, first_ns = first + count, first_ns + duration_ns
        if count == 1 and playback.live:
            yield from _still(source, fps, fit, playback, first)


def median_picture(path: Path, fit: Fit, *, hardware: bool = False) -> Image:
    """Median of MEDIAN_OF frames spread over a file, at the working size; of those of the empty scene where it has some.

    hardware: see `VideoReader`.  Raises SourceError.
    """
    with VideoReader(path, hardware) as reader:
        every = max(1, reader.declared // MEDIAN_OF)
        pictures = []
        while (frame := reader.next()) is not None:
            if frame.index % every == every // 2:
                pictures.append(fit(frame.image()))
        people = with_people(pictures)
        if np.count_nonzero(~people) >= LEAST_EMPTY:
            pictures = [picture for picture, seen in zip(pictures, people, strict=True) if not seen]
        return np.asarray(np.median(np.stack(pictures), axis=0), dtype=np.uint8)


def _initial(path: Path, hardware: bool, fps: float, fit: Fit, playback: Playback) -> Iterator[Frame]:
    """The frames of a T-pose video, which ends one period before the file begins."""
    length_ns = duration_ns(path)
    with VideoReader(path, hardware) as reader:
        thinning = Thinning(fps, reader.fps)
        while (frame := reader.next()) is not None:
            if thinning.takes(frame.time_ns):
                captured_ns = playback.epoch_ns + frame.time_ns - length_ns
                if playback.live:
                    playback.wait_until(captured_ns)
                yield Frame(frame.index, captured_ns, fit(frame.image()), initial=True)


def _pass(
    source: VideoFile, fps: float, fit: Fit, playback: Playback, first: int, first_ns: int, preroll: int
) -> Generator[Frame, None, tuple[int, int]]:
    """Yield the frames of one pass, numbered from `first` and with times from `first_ns`; returns number and duration."""
    with VideoReader(source.path, source.hardware) as reader:
        thinning, taken_frames = Thinning(fps, reader.fps), 0
        while (frame := reader.next()) is not None:
            captured_ns = playback.epoch_ns + first_ns + frame.time_ns
            wanted = thinning.takes(frame.time_ns)
            if wanted and playback.live and taken_frames >= preroll:
                late = playback.clock.now_ns() - captured_ns > LATE_FRAMES * 1e9 / min(fps, reader.fps)
                wanted = playback.wants(captured_ns)
                if late and wanted and taken_frames:
                    playback.count_late()
                wanted = wanted and not late
            if wanted:
                if playback.live:
                    playback.wait_until(captured_ns)
                taken_frames += 1
                yield Frame(first + frame.index, captured_ns, fit(frame.image()))
        playback.finished(reader.summary())
        return reader.read, reader.end_ns


def _still(source: VideoFile, fps: float, fit: Fit, playback: Playback, first: int) -> Iterator[Frame]:
    """Yield the one frame of a picture for ever, numbered from `first`.

    Opening the file for each would take longer than a frame period on a busy machine, and every frame would be late.
    """
    with VideoReader(source.path, source.hardware) as reader:
        frame = reader.next()
        if frame is None:
            raise EndedEarly(f"{source.path}: no picture in it any more")
        image, rate, index = fit(frame.image()), min(fps, reader.fps), first
    while True:
        index = playback.next_index(index, rate)
        captured_ns = playback.time_of(index, rate) + source.offset_ns
        playback.wait_until(captured_ns)
        yield Frame(index, captured_ns, image)
        index += 1


def duration_ns(path: Path) -> int:
    """Duration of a file from the times of all its frames.  Raises SourceError."""
    with VideoReader(path) as reader:
        while reader.next() is not None:
            pass
        return reader.end_ns


def declared_frames(path: Path, fps: float) -> int:
    """Number of frames that a file declares, at most `fps` per second; 0 when unknown."""
    try:
        with VideoReader(path) as reader:
            return int(reader.declared * min(1.0, fps / reader.fps))
    except SourceError:
        return 0
