"""`zenocap render`: the poses of a take as a film or a picture."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image
from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.kinematics import joint_centres, part_frames
from zenocap.common.body.segments import limbs_of
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import camera_of
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import Bound, PoseTrack, between
from zenocap.common.formats.resampling import resampled
from zenocap.common.formats.smoothing import smoothed
from zenocap.common.formats.take_poses import TakePoses, read_poses
from zenocap.common.messages import CameraInfo
from zenocap.common.session.lookahead import available_cores
from zenocap.common.video.film_writer import CODECS, Codec, FilmWriter, codec_of
from zenocap.services.animator.parameters import FILM_SAMPLES, MAX_DRAWING_THREADS, PICTURE_SAMPLES
from zenocap.tools.takes.render.camera_path import Shot, camera_path
from zenocap.tools.takes.render.caption import Caption, label_at, read_labels, write
from zenocap.tools.takes.render.scene import Scene
from zenocap.tools.takes.render.surfaces import Surface, body_surface, concatenated, posed_surface, trails
from zenocap.tools.takes.render.theme import THEMES

FILMS, PICTURES = tuple(CODECS), (".png", ".jpg")
EXTREMITIES = ("LWrist", "RWrist", "LAnkle", "RAnkle")


@dataclass(frozen=True)
class RenderOptions:
    """Options of a picture or film.

    first, last: frames of the take, inclusive.  fps: of a film; None for that of the take.  size: width, height, px.
    poses: number of poses in one picture, evenly spaced.  trails_s: length of the trails of hands and feet, 0 for none.
    codec: of a film; None for that of the suffix.
    smooth: cut-off frequency (Hz) of `smoothed`; None for the poses as they are.
    raw: poses of the forward pass also where the take was tracked both ways.
    """

    first: Bound | None = None
    last: Bound | None = None
    fps: float | None = None
    size: tuple[int, int] = (1280, 720)
    shot: Shot = field(default_factory=Shot)
    theme: str = "light"
    poses: int = 1
    trails_s: float = 0.0
    captions: bool = True
    codec: Codec | None = None
    smooth: float | None = None
    raw: bool = False


@dataclass(frozen=True)
class RenderedFilm:
    """Result of rendering.

    pictures: number drawn.  lost: those without a person.  cut: missing content of the take, None if complete.
    """

    pictures: int
    lost: int
    cut: str | None


def render(
    take: Path, output: Path, options: RenderOptions, on_progress: Callable[[int, int], None] = lambda done, total: None
) -> RenderedFilm:
    """Write a film or a picture, by the suffix of `output`; an incomplete file never appears there.

    on_progress: called with the number of drawn pictures and their total.  Raises UserError.
    """
    suffix = output.suffix.lower()
    if suffix not in (*FILMS, *PICTURES):
        raise UserError(f"--output {output}: allowed: a file name that ends in {', '.join((*FILMS, *PICTURES))}")
    if suffix in FILMS:
        codec_of(output, options.codec)
    poses = read_poses(take, raw=options.raw)
    whole = poses.track() if options.smooth is None else smoothed(poses.track(), options.smooth)
    track = between(whole, options.first, options.last)
    if not track.known.any():
        raise UserError(f"{take}: the person is lost in every selected frame: nothing to draw")
    try:
        if suffix in PICTURES:
            return _picture(output, poses, track, options, on_progress)
        return _film(output, poses, track, options, on_progress)
    except OSError as error:
        raise UserError(f"{output}: cannot be written: {error.strerror or error}") from error


def _picture(
    output: Path, poses: TakePoses, track: PoseTrack, options: RenderOptions, on_progress: Callable[[int, int], None]
) -> RenderedFilm:
    """Draw poses from the first known to the last known one into one picture."""
    known = np.flatnonzero(track.known)
    chosen = known[np.unique(np.round(np.linspace(0, len(known) - 1, options.poses)).astype(int))]
    drawing = Drawing(poses, track, options, track.rows(chosen), PICTURE_SAMPLES)
    surfaces = [*(drawing.body(int(row)) for row in chosen), drawing.trail(int(chosen[-1]))]
    image = drawing.scene(0).picture(concatenated([one for one in surfaces if one is not None]))
    if options.captions:
        write(image, drawing.caption_of_picture(int(chosen[0]), int(chosen[-1])), THEMES[options.theme])
    with atomic_file(output) as unfinished:
        if not cv2.imwrite(str(unfinished), image):
            raise UserError(f"{output}: cannot be written")
    on_progress(1, 1)
    return RenderedFilm(1, 0, poses.cut)


def _film(
    output: Path, poses: TakePoses, track: PoseTrack, options: RenderOptions, on_progress: Callable[[int, int], None]
) -> RenderedFilm:
    fps = options.fps or round(track.rate, 3)
    if fps <= 0:
        raise UserError(f"{output}: a film needs two frames or more; allowed: a longer range, or a picture (.png)")
    even = resampled(track, fps)  # pictures of a film are evenly spaced, frames of a live take are not
    if not even.known.any():
        raise UserError(f"{output}: at --fps {fps:g} no picture has a pose; allowed: a higher rate")
    drawing = Drawing(poses, even, options, even, FILM_SAMPLES)
    count = len(even.frames)
    with atomic_file(output) as unfinished:
        film = FilmWriter(unfinished, options.size, fps, options.codec)
        try:
            for row, picture in enumerate(drawing.pictures(count)):
                film.write(picture)
                on_progress(row + 1, count)
        finally:
            film.close()
    return RenderedFilm(count, int(np.count_nonzero(~even.known)), poses.cut)


class Drawing:
    """Draws rows of a track.  framed: the rows that the camera must have in the picture."""

    def __init__(self, poses: TakePoses, track: PoseTrack, options: RenderOptions, framed: PoseTrack, samples: int) -> None:
        """Raises UserError for an unknown view."""
        self._track, self._options, self._samples = track, options, samples
        self._title, self._start_ns = poses.path.stem, poses.start_ns
        self._labels = read_labels(poses.path) if options.captions else ()
        self._body = body_surface(track.anatomy, track.bdp)
        self._limbs = {limb.name: {limb.upper, limb.lower} for limb in limbs_of(track.anatomy)}
        self._names = [marker.name for marker in track.anatomy.markers]
        self._centres = self._all_centres(track)
        self._theme = THEMES[options.theme]
        viewers = _usable(poses.cameras)
        try:
            self._path = camera_path(self._all_centres(framed), framed.times_s, options.shot, options.size, viewers)
        except ValueError as error:
            raise UserError(f"--{error}") from error
        self._still = None if self._path.moving else self._scene_of(0)

    def picture(self, row: int) -> Image:
        """Return the picture of one row, (h, w, 3)."""
        surfaces = [one for one in (self.body(row), self.trail(row)) if one is not None]
        image = self.scene(row).picture(concatenated(surfaces) if surfaces else None)
        if self._options.captions:
            write(image, self.caption(row), self._theme)
        return image

    def pictures(self, count: int) -> Iterator[Image]:
        """Yield the pictures of the first `count` rows, drawn by several threads: compiled functions run side by side."""
        threads = min(available_cores(), MAX_DRAWING_THREADS)
        with ThreadPoolExecutor(threads) as pool:
            waiting: deque[Future[Image]] = deque()
            try:
                for row in range(count):
                    waiting.append(pool.submit(self.picture, row))
                    if len(waiting) > 2 * threads:
                        yield waiting.popleft().result()
                while waiting:
                    yield waiting.popleft().result()
            finally:
                pool.shutdown(wait=True, cancel_futures=True)

    def scene(self, row: int) -> Scene:
        """Return the empty scene as the camera of a row sees it; the same one while the camera stands still."""
        return self._still or self._scene_of(row)

    def _scene_of(self, row: int) -> Scene:
        camera, ground, sun = self._path.at(row)
        return Scene(camera, ground, self._theme, sun, self._samples, once=self._path.moving)

    def body(self, row: int) -> Surface | None:
        """Return the body surface of a row in the world; None while the person is lost."""
        track = self._track
        if not track.known[row]:
            return None
        lost_parts = {part for limb in track.lost[row].split() for part in self._limbs.get(limb, ())}
        return posed_surface(self._body, part_frames(track.anatomy, track.bdp, track.pose(row)), lost_parts)

    def caption(self, row: int) -> Caption:
        """Return the caption of one picture of a film."""
        times_s = self._track.times_s
        share = float((times_s[row] - times_s[0]) / max(times_s[-1] - times_s[0], 1e-9))
        warning = "" if self._track.known[row] else "person lost"
        return Caption(self._title, f"{times_s[row]:.2f} s", self.label(row), warning, share)

    def label(self, row: int) -> str:
        """Return the posture that was recognized at a row; "" for none."""
        return label_at(self._labels, self._start_ns + round(float(self._track.times_s[row]) * 1e9))

    def caption_of_picture(self, first: int, last: int) -> Caption:
        """Return the caption of a picture with poses from the first row to the last."""
        times_s = self._track.times_s
        until = f" to {times_s[last]:.2f} s" if last > first else " s"
        return Caption(self._title, f"{times_s[first]:.2f}{until}", "" if last > first else self.label(first))

    def trail(self, row: int) -> Surface | None:
        """Return the trails of hands and feet up to a row; None without trails."""
        if self._options.trails_s <= 0:
            return None
        first = int(np.searchsorted(self._track.times_s, self._track.times_s[row] - self._options.trails_s))
        return trails({name: self._centres[first : row + 1, self._names.index(name)] for name in EXTREMITIES})

    def _all_centres(self, track: PoseTrack) -> Floats:
        """Return joint centres (n, markers, 3), metres, NaN while the person is lost."""
        centres = np.full((len(track.frames), len(track.anatomy.markers), 3), np.nan)
        for row in np.flatnonzero(track.known):
            centres[row] = joint_centres(track.anatomy, track.bdp, track.pose(int(row)))
        return centres


def _usable(cameras: Mapping[str, CameraInfo]) -> dict[str, Camera]:
    """Return the cameras by viewer, without impossible ones."""
    found = {}
    for viewer, info in cameras.items():
        with suppress(ValueError):
            found[viewer] = camera_of(info)
    return found
