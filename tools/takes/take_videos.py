"""Pictures of a tracked take: frames of its videos at any time."""

from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import av
from av.error import FFmpegError

from zenocap.common.arrays import Image
from zenocap.common.errors import OpenError, SourceError, UserError
from zenocap.common.formats.file_warnings import warn_of_file
from zenocap.common.recording.setup_file import RecordedRig, setup_of
from zenocap.common.recording.summary import read_summary
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.rig import Viewer, load_rig
from zenocap.common.rig.sources import VideoFile
from zenocap.common.video.reader import VideoReader, turned_picture, video_stream
from zenocap.common.vision.pictures import jpeg
from zenocap.services.viewer.sources.resize import Fit, fit_of
from zenocap.tools.parameters import EPOCH_NS, SHOWN_PICTURE_PX, SHOWN_PICTURE_QUALITY, SOUGHT_S

TRACKED_NS = 366 * 86_400_000_000_000  # from EPOCH_NS on: takes of cameras are later


class SeekableVideo:
    """Video file with access to frames at any time.  Not for results: a frame may be one beside the wanted one."""

    def __init__(self, path: Path) -> None:
        """Raises OpenError."""
        self._path, self._start, self._turn = path, 0, 0
        self._open()
        with suppress(SourceError), VideoReader(path) as reader:  # the first frames may be missing
            reader.next()
            self._start, self._turn = round(reader.begin_s / self._base), reader.turn

    def _open(self) -> None:
        try:
            self._container = av.open(str(self._path), metadata_errors="replace")
        except (FFmpegError, ValueError, OSError) as error:
            raise OpenError(f"{self._path}: not a video that can be decoded") from error
        self._stream = video_stream(self._path, self._container)
        self._stream.thread_type = "AUTO"
        self._base = self._stream.time_base or Fraction(1, 1000)
        rate = self._stream.codec_context.framerate or self._stream.guessed_rate
        self._period_s = float(1 / rate) if rate else 0.0
        self._frames: Iterator[av.VideoFrame] = self._container.decode(self._stream)
        self._last: tuple[float, av.VideoFrame] | None = None

    def at(self, time_s: float) -> Image | None:
        """The frame that is shown at a time from the first one on, (height, width, 3) BGR; None outside of the file."""
        if time_s < 0:
            return None
        decoded_s = 0.0 if self._last is None else self._last[0]
        try:
            if not decoded_s - self._period_s <= time_s < decoded_s + SOUGHT_S:
                self._seek(time_s)
            while self._last is None or self._last[0] < time_s:
                frame = next(self._frames, None)
                if frame is None:
                    break
                self._last = self._time_of(frame), frame
            if self._last is None or abs(self._last[0] - time_s) > SOUGHT_S:
                return None
            return turned_picture(self._last[1], self._turn)
        except (FFmpegError, ValueError, OpenError):  # damaged there, or gone
            return None

    def close(self) -> None:
        self._container.close()

    def _seek(self, time_s: float) -> None:
        try:
            self._container.seek(self._start + int(time_s / self._base), stream=self._stream, backward=True)
        except FFmpegError:  # a bare stream, which has no times
            if self._last is not None and time_s < self._last[0]:
                self.close()
                self._open()
            return
        self._frames, self._last = self._container.decode(self._stream), None

    def _time_of(self, frame: av.VideoFrame) -> float:
        if frame.pts is not None:
            return float((frame.pts - self._start) * self._base)
        return 0.0 if self._last is None else self._last[0] + self._period_s  # of a bare stream, which is not sought


class TakeVideos:
    """The videos of a take that `zenocap track` made from a folder."""

    def __init__(self, viewers: tuple[Viewer, ...]) -> None:
        """viewers: of the folder's rig; those without a video file are left out.  Raises SourceError."""
        self._videos: dict[str, tuple[SeekableVideo, VideoFile, Fit]] = {}
        for viewer in viewers:
            if isinstance(viewer.source, VideoFile):
                source = viewer.source
                fit = fit_of(viewer).named(source.path)
                self._videos[viewer.id] = SeekableVideo(source.path), source, fit

    def at(self, take_ns: int) -> Iterator[tuple[str, bytes]]:
        """Viewer and picture (JPEG) of every video that has a frame at a time of the take's log, ns."""
        for id, (video, source, fit) in self._videos.items():
            image = video.at((take_ns - EPOCH_NS - source.offset_ns) / 1e9)
            if image is not None:
                yield id, jpeg(fit(image), SHOWN_PICTURE_PX, SHOWN_PICTURE_QUALITY)

    def close(self) -> None:
        for video, _, _ in self._videos.values():
            video.close()


def take_of(path: Path) -> Path:
    """The take that is meant: the path, or for a folder the FOLDER.mcap here, beside it or in it.  Raises UserError."""
    if not path.is_dir():
        return path
    name = f"{path.absolute().name}.mcap"
    places = [Path(name), path.absolute().parent / name, path / name]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        raise UserError(
            f"{path}: no {name} here, beside the folder or in it: allowed: a take, or a folder that was tracked"
        )
    return found


def videos_of(take: Path, folder: Path | None, shown: Path | None = None) -> TakeVideos | None:
    """The videos of a take; None for a recorded one, and, with a warning, where there are none.

    folder: in the Pose2Sim layout; None: searched beside the take.  shown: folder that was given instead of the take.
    Raises UserError for a given folder that is not that of the take, and SourceError for a video that cannot be read.
    """
    if not take.is_file():  # reported where it is played
        return None
    recorded, summary = setup_of(take), read_summary(take)
    live = summary is not None and summary.start_ns > EPOCH_NS + TRACKED_NS
    if recorded is None or live:
        if folder is not None:
            reason = "was recorded from cameras" if live else "does not say which cameras it is of"
            raise UserError(f"--videos {folder}: {take}: the take {reason}")
        return None
    if folder is not None:
        return _videos_in(folder, recorded)
    beside = (one.parent for one in sorted(take.parent.glob("*/videos")))
    places = (one for one in (shown or take.parent, take.parent, *beside) if (one / "videos").is_dir())
    found = next((one for one in places if plain_name(one.absolute().name) == recorded.name), None)
    try:
        if found is None:
            raise UserError(f"no folder {recorded.name} with videos/ beside it: allowed: --videos FOLDER")
        return _videos_in(found, recorded)
    except UserError as error:
        warn_of_file(take, f"no pictures: {error}")
        return None


def _videos_in(folder: Path, recorded: RecordedRig) -> TakeVideos:
    """Raises as `videos_of`."""
    rig, viewers = load_rig(folder, recorded.method), {viewer.id for viewer in recorded.viewers}
    if not viewers <= {viewer.id for viewer in rig.viewers}:
        names = [", ".join(sorted(some)) for some in ({viewer.id for viewer in rig.viewers}, viewers)]
        raise UserError(f"--videos {folder}: cameras {names[0]}: allowed: a folder with those of the take: {names[1]}")
    return TakeVideos(tuple(viewer for viewer in rig.viewers if viewer.id in viewers))
