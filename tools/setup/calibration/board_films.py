"""Views of a board in videos, folders of images or corner files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX, IMAGE_SUFFIXES, SYNC_FILE, read_offsets, with_suffix
from zenocap.common.rig.sources import VIDEO_SUFFIXES
from zenocap.common.video.reader import VideoReader
from zenocap.tools.setup.calibration.board import Board
from zenocap.tools.setup.calibration.board_detection import best_variant, board_variant
from zenocap.tools.setup.calibration.board_views import CameraViews
from zenocap.tools.setup.calibration.corners_file import check_board, read_corners
from zenocap.tools.setup.calibration.detection import Detection, camera_views, not_found
from zenocap.tools.setup.calibration.film_search import OnProgress, Searched, probes, searched
from zenocap.tools.setup.calibration.parameters import FLOOR_S
from zenocap.tools.setup.cameras.away import require_copied

LAYOUT = "a folder with videos, or with videos/, or with a folder of images for each camera; or the videos themselves"
FILE_LAYOUT = f"{LAYOUT}; {CORNERS_SUFFIX} files of `zenocap calibrate detect` in place of videos"


@dataclass(frozen=True)
class BoardFilm:
    """A camera's video, its folder of images, or its corner file.  offset_s: when the video begins.

    detection: content of a corner file; None where images are searched.
    """

    name: str
    path: Path
    offset_s: float = 0.0
    detection: Detection | None = None

    @property
    def still(self) -> bool:
        """Whether these are single images of a board at rest; equal names of several cameras are one moment."""
        return self.path.is_dir() if self.detection is None else self.detection.still

    @property
    def source(self) -> str:
        """Name of the video or folder of images that it is, or that its corners were detected in."""
        return self.path.name if self.detection is None else self.detection.source

    @property
    def end_s(self) -> float:
        """End of a video, s; infinite of anything else, and where the file does not state it."""
        if self.still or self.detection is not None:
            return math.inf
        with VideoReader(self.path) as reader:
            return self.offset_s + reader.declared / reader.fps if reader.declared else math.inf

    @property
    def stems(self) -> list[str]:
        """Names of its images."""
        if self.detection is not None:
            return list(self.detection.names)
        return [path.stem for path in with_suffix(self.path, IMAGE_SUFFIXES)]


def board_films(paths: Sequence[Path]) -> tuple[list[BoardFilm], list[str]]:
    """The cameras' videos, image folders or corner files, by name, and notes for the user.  Raises UserError."""
    if not (len(paths) == 1 and paths[0].is_dir()):
        return _checked([_film(path) for path in paths]), []
    folder = paths[0]
    require_copied(folder, corners=True)
    films, notes = [_film(path) for path in _with_images(folder)], []
    names = {film.name for film in films}
    for path in _first_found((folder / CORNERS, folder), (CORNERS_SUFFIX,)):
        film = _film(path)
        if film.name in names:
            notes.append(f"{path}: not used: the images of {film.name} are here")
        else:
            films.append(film)
    if not films:
        raise UserError(f"{folder}: no videos and no folders of images in it: allowed: {FILE_LAYOUT}")
    films = _checked(sorted(films, key=lambda film: film.source))  # the order that the videos have
    offsets = read_offsets(folder / SYNC_FILE, [film.name for film in films])
    if offsets:
        notes.append(f"{SYNC_FILE}: {', '.join(f'{name} {time:+.3f} s' for name, time in offsets.items())}")
    return [replace(film, offset_s=offsets.get(film.name, 0.0)) for film in films], notes


def searchable_films(paths: Sequence[Path]) -> list[BoardFilm]:
    """The cameras' videos or image folders, by name, without the times at which they begin.  Raises UserError."""
    found = _with_images(paths[0]) if len(paths) == 1 and paths[0].is_dir() else list(paths)
    if not found:
        raise UserError(f"{paths[0]}: no videos and no folders of images in it: allowed: {LAYOUT}")
    films = _checked([_film(path) for path in found])
    if detected := [film for film in films if film.detection is not None]:
        raise UserError(f"{detected[0].path}: corners and no images: allowed: {LAYOUT}")
    return films


def _with_images(folder: Path) -> list[Path]:
    """Videos in a folder or its videos/; without any, its folders of images."""
    images = (one for one in sorted(folder.iterdir()) if one.is_dir() and with_suffix(one, IMAGE_SUFFIXES))
    return _first_found((folder / "videos", folder), VIDEO_SUFFIXES) or list(images)


def _first_found(folders: Sequence[Path], suffixes: Sequence[str]) -> list[Path]:
    """The files of the first folder that has such files."""
    return next((files for one in folders if one.is_dir() and (files := with_suffix(one, suffixes))), [])


def _film(path: Path) -> BoardFilm:
    if not path.exists():
        raise UserError(f"{path}: no such file or folder: allowed: {FILE_LAYOUT}")
    if path.suffix == CORNERS_SUFFIX and path.is_file():
        detection = read_corners(path)
        return BoardFilm(detection.camera, path, detection=detection)
    return BoardFilm(path.name if path.is_dir() else path.stem, path)


def _checked(films: Sequence[BoardFilm]) -> list[BoardFilm]:
    """The films, when each camera has one and all are of one kind.  Raises UserError."""
    names: dict[str, Path] = {}
    for film in films:
        if film.name in names:
            raise UserError(f"{film.path}: {names[film.name]} exists too: allowed: one video per camera")
        names[film.name] = film.path
    if len({film.still for film in films}) > 1:
        raise UserError(f"{films[0].path}: videos and folders of images together: allowed: one kind for all cameras")
    return list(films)


def check_floor(films: Sequence[BoardFilm], floor_s: Sequence[float]) -> None:
    """Raise UserError for a time of the board on the floor outside of all videos, before their search."""
    if not floor_s:
        return
    begin_s, end_s = min(film.offset_s for film in films), max(film.end_s for film in films)
    for time_s in floor_s:
        if not begin_s - FLOOR_S <= time_s <= end_s + FLOOR_S:
            raise UserError(f"--floor {time_s:g}: allowed: {begin_s:.1f} to {end_s:.1f}, seconds of the videos")


def board_views(
    board: Board, films: Sequence[BoardFilm], on_progress: OnProgress = lambda *_: None
) -> tuple[Board, list[CameraViews]]:
    """The board as it was found (older pattern, exchanged colours), and what each camera saw.  Raises UserError."""
    for film in films:
        if film.detection is not None:
            check_board(film.path, film.detection.board, board)
    probed = []
    for film in films:
        on_progress(0, 0, film.name)
        if film.detection is not None:
            probed.append(best_variant(board, film.detection.counts))
        elif images := probes(film.path):
            probed.append(board_variant(board, images))
        else:
            raise UserError(f"{film.path}: no images in it: allowed: {LAYOUT}")
    # All cameras see the same board: the one with the most corners shows its variant.
    chosen, most = max(probed, key=lambda one: one[1])
    if not most and all(film.detection is None for film in films):  # nor would a search of all images find enough views
        raise not_found(films[0].path, chosen)
    # Names of stills number the moments; of equal names all cameras saw the board in one place.
    stems = sorted({stem for film in films if film.still for stem in film.stems})
    moments = {stem: float(k) for k, stem in enumerate(stems)}
    seen = []
    for film in films:
        numbers = [moments[stem] for stem in film.stems] if film.still else None
        seen.append(camera_views(film.name, _searched(chosen, film, on_progress), film.offset_s, numbers))
    return chosen, seen


def _searched(board: Board, film: BoardFilm, on_progress: OnProgress) -> Searched:
    """Views of the board in a film.  Raises UserError where there are none."""
    if film.detection is None:
        found = searched([board], film.path, film.name, on_progress)
        if not found.views[0]:
            raise not_found(film.path, board)
        return found
    found_there = film.detection.searched(board)
    if found_there is None:
        raise UserError(
            f"{film.path}: the board is seen with another pattern or with exchanged colours than by the other cameras: "
            f"allowed: one board; or {film.source} itself"
        )
    return found_there
