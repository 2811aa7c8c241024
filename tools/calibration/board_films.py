"""Videos, or folders of images, of a board: which belong to which camera, and the views of the board in them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.errors import EndedEarly, UserError
from zenocap.common.rig.folder import IMAGE_SUFFIXES, SYNC_FILE, read_offsets
from zenocap.common.rig.sources import VIDEO_SUFFIXES
from zenocap.common.video.reader import VideoReader
from zenocap.tools.calibration.board import Board
from zenocap.tools.calibration.board_detection import BoardDetector, board_variant, why_not_found
from zenocap.tools.calibration.board_views import CameraViews, View, with_velocities
from zenocap.tools.calibration.parameters import BURST_S, MAX_LOOKS, PROBED_FRAMES
from zenocap.tools.film.away import require_copied

LAYOUT = "a folder with videos, or with videos/, or with a folder of images for each camera; or the videos themselves"

OnProgress = Callable[[int, int, str], None]
"""Called with the number of read images, that of all, and the camera's name."""


@dataclass(frozen=True)
class BoardFilm:
    """A camera's video, or its folder of images.  offset_s: when the video begins."""

    name: str
    path: Path
    offset_s: float = 0.0

    @property
    def still(self) -> bool:
        """Whether these are single images of a board at rest; equal names of several cameras are one moment."""
        return self.path.is_dir()


def board_films(paths: Sequence[Path]) -> tuple[list[BoardFilm], list[str]]:
    """The cameras' videos or image folders, by name, and notes for the user.  Raises UserError."""
    offsets: dict[str, float] = {}
    found = list(paths)
    if len(paths) == 1 and paths[0].is_dir():
        folder = paths[0]
        require_copied(folder)
        places = [place for place in (folder / "videos", folder) if place.is_dir()]
        found = next((videos for place in places if (videos := _with_suffix(place, VIDEO_SUFFIXES))), [])
        found = found or [one for one in sorted(folder.iterdir()) if one.is_dir() and _with_suffix(one, IMAGE_SUFFIXES)]
        if not found:
            raise UserError(f"{folder}: no videos and no folders of images in it: allowed: {LAYOUT}")
        offsets = read_offsets(folder / SYNC_FILE, [one.stem for one in found])
    names: dict[str, Path] = {}
    for path in found:
        if not path.exists():
            raise UserError(f"{path}: no such file or folder: allowed: {LAYOUT}")
        name = path.name if path.is_dir() else path.stem
        if name in names:
            raise UserError(f"{path}: {names[name]} exists too: allowed: one video per camera")
        names[name] = path
    films = [BoardFilm(name, path, offsets.get(name, 0.0)) for name, path in names.items()]
    if len({film.still for film in films}) > 1:
        raise UserError(f"{found[0]}: videos and folders of images together: allowed: one kind for all cameras")
    notes = [f"{SYNC_FILE}: {', '.join(f'{name} {time:+.3f} s' for name, time in offsets.items())}"] if offsets else []
    return films, notes


def board_views(
    board: Board, films: Sequence[BoardFilm], on_progress: OnProgress = lambda *_: None
) -> tuple[Board, list[CameraViews]]:
    """The board as it was found (older pattern, exchanged colours), and what each camera saw.  Raises UserError."""
    probes = {}
    for film in films:
        on_progress(0, 0, film.name)
        probes[film.name] = _probes(film)
        if not probes[film.name]:
            raise UserError(f"{film.path}: no images in it: allowed: {LAYOUT}")
    # All cameras see the same board: the one with the most corners tells its variant.
    chosen, _ = max((board_variant(board, images) for images in probes.values()), key=lambda one: one[1])
    # Names of stills number the moments; of equal names all cameras saw the board in one place.
    stems = sorted({path.stem for film in films if film.still for path in _with_suffix(film.path, IMAGE_SUFFIXES)})
    return chosen, [_views(chosen, film, stems, on_progress) for film in films]


def _with_suffix(folder: Path, suffixes: Sequence[str]) -> list[Path]:
    """Files, by name, without hidden ones such as the ._NAME that macOS writes beside files."""
    found = (path for path in folder.iterdir() if path.suffix.lower() in suffixes and not path.name.startswith("."))
    return sorted(path for path in found if path.is_file())


def _still(path: Path) -> Image:
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        raise UserError(f"{path}: not an image that can be read: allowed: {', '.join(IMAGE_SUFFIXES)}")
    return np.asarray(picture, dtype=np.uint8)


def _images(film: BoardFilm, wanted: Callable[[float, float], bool]) -> Iterator[tuple[float, Image | None, int]]:
    """Times (s from its beginning), grey images or None where not `wanted`(time, duration), and the declared number.

    Raises UserError where the size changes.
    """
    size: tuple[int, int] | None = None
    if film.still:
        files = _with_suffix(film.path, IMAGE_SUFFIXES)
        for k, path in enumerate(files):
            picture = _still(path)
            size = _checked_size(path, picture, size)
            yield float(k), picture, len(files)
        return
    with VideoReader(film.path) as reader:
        duration_s = reader.declared / reader.fps
        while True:
            try:
                frame = reader.next()
            except EndedEarly:
                return  # a cut file: what was read of it counts
            if frame is None:
                return
            time_s = frame.time_ns / 1e9
            grey: Image | None = None
            if wanted(time_s, duration_s):
                grey = np.asarray(cv2.cvtColor(frame.image(), cv2.COLOR_BGR2GRAY), dtype=np.uint8)
                size = _checked_size(film.path, grey, size)
            yield time_s, grey, reader.declared


def _checked_size(path: Path, grey: cv2.typing.MatLike, size: tuple[int, int] | None) -> tuple[int, int]:
    found = (grey.shape[1], grey.shape[0])
    if size is not None and found != size:
        raise UserError(
            f"{path}: the size of the images changes from {size[0]} x {size[1]} to {found[0]} x {found[1]} px: "
            "allowed: one size"
        )
    return found


def _probes(film: BoardFilm) -> list[Image]:
    """A few images, evenly spread."""
    if film.still:
        files = _with_suffix(film.path, IMAGE_SUFFIXES)
        return [_still(path) for path in files[:: max(1, len(files) // PROBED_FRAMES)]]
    next_s = 0.0

    def wanted(time_s: float, duration_s: float) -> bool:
        nonlocal next_s
        if time_s < next_s:
            return False
        next_s = time_s + duration_s / (2 * PROBED_FRAMES)
        return True

    kept = [grey for _, grey, _ in _images(film, wanted) if grey is not None]
    return kept[:: max(1, len(kept) // PROBED_FRAMES)]


def _in_burst(fps: float) -> Callable[[float, float], bool]:
    """Whether an image is searched: all of a short video, stretches of a long one."""

    def wanted(time_s: float, duration_s: float) -> bool:
        every_s = BURST_S * max(1.0, duration_s * fps / MAX_LOOKS)
        return every_s == BURST_S or (time_s + 1e-6) % every_s < BURST_S

    return wanted


def _views(board: Board, film: BoardFilm, stems: Sequence[str], on_progress: OnProgress) -> CameraViews:
    detector, views, times, looks, size = BoardDetector(board), [], [], 0, (0, 0)
    fps = 1.0
    if film.still:
        numbers = [float(stems.index(path.stem)) for path in _with_suffix(film.path, IMAGE_SUFFIXES)]
    else:
        with VideoReader(film.path) as reader:
            fps = reader.fps
    for k, (time_s, grey, total) in enumerate(_images(film, _in_burst(fps))):
        on_progress(k + 1, total, film.name)
        times.append(time_s)
        if grey is None:
            continue
        looks += 1
        size = (grey.shape[1], grey.shape[0])
        if (found := detector.corners(grey)) is not None:
            at_s = numbers[k] if film.still else time_s + film.offset_s
            velocities = np.zeros_like(found[1]) if film.still else np.full_like(found[1], np.nan)
            views.append(View(at_s, found[0], found[1], velocities))
    period_s = float(np.median(np.diff(times))) if len(times) > 1 and not film.still else 1.0 / fps
    if not views:
        raise UserError(f"{film.path}: the board is not found: {why_not_found(board, _probes(film))}")
    moving = tuple(views) if film.still else with_velocities(views, period_s)
    return CameraViews(film.name, size, period_s, looks, moving, film.still)
