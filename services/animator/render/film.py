"""`zenocap animator TAKE --render FILE`: the poses of a take as a film or a picture."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from common.body.anatomy import Floats
from common.body.kinematics import joint_centres, part_frames
from common.body.limbs import limbs_of
from common.camera.pinhole import Camera
from common.conversion import camera_of
from common.formats.poses import Poses, read_poses
from common.formats.resampling import resampled
from common.formats.track import Bound, PoseTrack, between
from common.formats.trc import FormatError
from common.formats.whole import whole_file
from common.messages import CameraInfo
from services.animator.render.caption import Caption, write
from services.animator.render.labels import label_at, read_labels
from services.animator.render.look import LOOKS
from services.animator.render.path import Shot, path_of
from services.animator.render.scene import Image, Stage
from services.animator.render.solids import Surface, joined, posed, solids
from services.animator.render.trails import trails

Codec = Literal["vp9", "mpeg4"]

FILMS, PICTURES = (".mp4",), (".png", ".jpg")
CODECS: Mapping[Codec, str] = {"vp9": "vp09", "mpeg4": "mp4v"}
EXTREMITIES = ("LWrist", "RWrist", "LAnkle", "RAnkle")
PICTURE_SAMPLES, FILM_SAMPLES = 4, 2


@dataclass(frozen=True)
class Wishes:
    """first, last: of the take's frames, both included.  fps: of a film; None for the take's.  size: width, height, px.

    poses: how many a picture shows together, evenly spread.  trails_s: how long hands and feet leave a trail, 0 for none.
    """

    first: Bound | None = None
    last: Bound | None = None
    fps: float | None = None
    size: tuple[int, int] = (1280, 720)
    shot: Shot = field(default_factory=Shot)
    look: str = "light"
    poses: int = 1
    trails_s: float = 0.0
    captions: bool = True
    codec: Codec = "vp9"


@dataclass(frozen=True)
class Rendered:
    """pictures: that were drawn.  lost: without a person among them.  cut: what is missing of the take, None if whole."""

    pictures: int
    lost: int
    cut: str | None


def render(take: Path, output: Path, wishes: Wishes, watch: Callable[[int, int], None] = lambda done, of: None) -> Rendered:
    """Write `output`, a film or a picture by its suffix, which appears whole or not at all.

    watch: told how many pictures of how many are drawn.  Raises FormatError and TakeError.
    """
    suffix = output.suffix.lower()
    if suffix not in (*FILMS, *PICTURES):
        raise FormatError(f"--render {output}: allowed: a file that ends in {', '.join((*FILMS, *PICTURES))}")
    poses = read_poses(take)
    track = between(poses.track(), wishes.first, wishes.last)
    if not track.known.any():
        raise FormatError(f"{take}: the person is lost in every frame that is wanted: nothing to draw")
    try:
        if suffix in PICTURES:
            return _picture(output, poses, track, wishes, watch)
        return _film(output, poses, track, wishes, watch)
    except OSError as error:
        raise FormatError(f"{output}: cannot be written: {error.strerror or error}") from error


def _picture(output: Path, poses: Poses, track: PoseTrack, wishes: Wishes, watch: Callable[[int, int], None]) -> Rendered:
    """The poses that are wanted, all in one picture, from the first that is known to the last."""
    known = np.flatnonzero(track.known)
    chosen = known[np.unique(np.round(np.linspace(0, len(known) - 1, wishes.poses)).astype(int))]
    drawing = Drawing(poses, track, wishes, track.rows(chosen), PICTURE_SAMPLES)
    surfaces = [*(drawing.body(int(row)) for row in chosen), drawing.trail(int(chosen[-1]))]
    image = drawing.stage(0).picture(joined([one for one in surfaces if one is not None]))
    if wishes.captions:
        first, last = int(chosen[0]), int(chosen[-1])
        write(image, drawing.caption_of_picture(first, last), LOOKS[wishes.look])
    with whole_file(output) as unfinished:
        if not cv2.imwrite(str(unfinished), image):
            raise FormatError(f"{output}: cannot be written")
    watch(1, 1)
    return Rendered(1, 0, poses.cut)


def _film(output: Path, poses: Poses, track: PoseTrack, wishes: Wishes, watch: Callable[[int, int], None]) -> Rendered:
    fps = wishes.fps or round(track.rate, 3)
    if fps <= 0:
        raise FormatError(f"{output}: one frame has no frame rate: allowed: two frames or more, or a picture (.png)")
    even = resampled(track, fps)  # a film's pictures are evenly spaced, those of a live take are not
    if not even.known.any():
        raise FormatError(f"{output}: at --fps {fps:g} no picture has a pose: allowed: a higher rate")
    drawing = Drawing(poses, even, wishes, even, FILM_SAMPLES)
    count = len(even.frames)
    with whole_file(output) as unfinished:
        film = opened_film(unfinished, wishes.codec, fps, wishes.size)
        try:
            for row in range(count):
                film.write(drawing.drawn(row))
                watch(row + 1, count)
        finally:
            film.release()
    return Rendered(count, int(np.count_nonzero(~even.known)), poses.cut)


def opened_film(path: Path, codec: Codec, fps: float, size: tuple[int, int]) -> cv2.VideoWriter:
    """A film to write to.  Raises FormatError."""
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*CODECS[codec]), fps, size)
    if not film.isOpened():
        others = ", ".join(other for other in CODECS if other != codec)
        raise FormatError(f"--codec {codec}: this OpenCV cannot write it: allowed: {others}")
    return film


class Drawing:
    """Draws rows of a track.  seen: the rows that are to be in the picture."""

    def __init__(self, poses: Poses, track: PoseTrack, wishes: Wishes, seen: PoseTrack, samples: int) -> None:
        """Raises FormatError for a view that the take does not have."""
        self._track, self._wishes, self._samples = track, wishes, samples
        self._title, self._start_ns = poses.path.stem, poses.start_ns
        self._labels = read_labels(poses.path) if wishes.captions else ()
        self._solids = solids(track.anatomy, track.bdp)
        self._limbs = {limb.name: {limb.upper, limb.lower} for limb in limbs_of(track.anatomy)}
        self._names = [marker.name for marker in track.anatomy.markers]
        self._centres = self._all_centres(track)
        self._look = LOOKS[wishes.look]
        viewers = _usable(poses.cameras)
        try:
            self._path = path_of(self._all_centres(seen), seen.times_s, wishes.shot, wishes.size, viewers)
        except ValueError as error:
            raise FormatError(f"--{error}") from error
        self._stage: Stage | None = None

    def drawn(self, row: int) -> Image:
        """The picture of one row, (h, w, 3)."""
        body, trail = self.body(row), self.trail(row)
        there = [one for one in (body, trail) if one is not None]
        image = self.stage(row).picture(joined(there) if there else None)
        if self._wishes.captions:
            write(image, self.caption(row), self._look)
        return image

    def stage(self, row: int) -> Stage:
        """The floor that the camera of a row sees; the same while it stands still."""
        if self._stage is None or self._path.moving:
            camera, ground, sun = self._path.at(row)
            self._stage = Stage(camera, ground, self._look, sun, self._samples)
        return self._stage

    def body(self, row: int) -> Surface | None:
        """The body of a row in the world; None while the person is lost."""
        track = self._track
        if not track.known[row]:
            return None
        searched = {part for limb in track.lost[row].split() for part in self._limbs.get(limb, ())}
        return posed(self._solids, part_frames(track.anatomy, track.bdp, track.pose(row)), searched)

    def caption(self, row: int) -> Caption:
        """Of a film's picture."""
        times_s = self._track.times_s
        share = float((times_s[row] - times_s[0]) / max(times_s[-1] - times_s[0], 1e-9))
        warning = "" if self._track.known[row] else "person lost"
        return Caption(self._title, f"{times_s[row]:.2f} s", self.label(row), warning, share)

    def label(self, row: int) -> str:
        """The posture that was recognised then; "" for none."""
        return label_at(self._labels, self._start_ns + round(float(self._track.times_s[row]) * 1e9))

    def caption_of_picture(self, first: int, last: int) -> Caption:
        """Of a picture that shows a row, or several from the first to the last."""
        times_s = self._track.times_s
        until = f" to {times_s[last]:.2f} s" if last > first else " s"
        return Caption(self._title, f"{times_s[first]:.2f}{until}", "" if last > first else self.label(first))

    def trail(self, row: int) -> Surface | None:
        """Where hands and feet were before a row; None without trails."""
        if self._wishes.trails_s <= 0:
            return None
        rows = self._rows_since(row, self._wishes.trails_s)
        return trails({name: self._centres[rows, self._names.index(name)] for name in EXTREMITIES})

    def _rows_since(self, row: int, seconds: float) -> slice:
        first = int(np.searchsorted(self._track.times_s, self._track.times_s[row] - seconds))
        return slice(first, row + 1)

    def _all_centres(self, track: PoseTrack) -> Floats:
        """(n, markers, 3) metres, NaN while the person is lost."""
        centres = np.full((len(track.frames), len(track.anatomy.markers), 3), np.nan)
        for row in np.flatnonzero(track.known):
            centres[row] = joint_centres(track.anatomy, track.bdp, track.pose(int(row)))
        return centres


def _usable(cameras: Mapping[str, CameraInfo]) -> dict[str, Camera]:
    """By viewer; from one that says what no camera can be there is no view."""
    found = {}
    for viewer, info in cameras.items():
        with suppress(ValueError):
            found[viewer] = camera_of(info)
    return found
