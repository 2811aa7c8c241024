"""Corners of a board in the film of one camera."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from zenocap.common.errors import UserError
from zenocap.common.rig.folder import IMAGE_SUFFIXES, with_suffix
from zenocap.tools.setup.calibration.board import Board
from zenocap.tools.setup.calibration.board_detection import best_variant, variant_counts, why_not_found
from zenocap.tools.setup.calibration.board_views import CameraViews, View, with_velocities
from zenocap.tools.setup.calibration.film_search import OnProgress, Searched, probes, searched


@dataclass(frozen=True)
class Detection:
    """Corners of a board in the film of one camera.

    camera: its name.  source: name of the video or of the folder of images.  board: as described by the user.
    size, period_s, looks: see `Searched`.  names: of the images of a folder; () for a video.  counts: of corners in the
    probed images by variant of the board, see `variant_counts`.  views: by number of the variant, see `Searched`; of those
    that the probed images show, of all where they show none.
    """

    camera: str
    source: str
    board: Board
    size: tuple[int, int]
    period_s: float
    looks: int
    names: tuple[str, ...]
    counts: tuple[int, ...]
    views: Mapping[int, tuple[View, ...]]

    @property
    def still(self) -> bool:
        """Whether these are single images of a board at rest."""
        return bool(self.names)

    def searched(self, variant: Board) -> Searched | None:
        """Views of a variant of the board; None where unknown or none."""
        views = self.views.get(self.board.variants().index(variant), ())
        return Searched(self.size, self.period_s, self.looks, (views,)) if views else None

    @property
    def most(self) -> CameraViews:
        """Views of the variant with most of them."""
        best = max(self.views.values(), key=len, default=())
        return CameraViews(self.camera, self.size, self.period_s, self.looks, best, self.still)


def detected(board: Board, path: Path, camera: str, on_progress: OnProgress = lambda *_: None) -> Detection:
    """Detect a board in a video, or in a folder of images.  Raises UserError, with the reason where it is not found."""
    on_progress(0, 0, camera)
    if not (images := probes(path)):
        raise UserError(f"{path}: no images in it")
    counts, variants = variant_counts(board, images), board.variants()
    numbers = [k for k, count in enumerate(counts) if count] or list(range(len(variants)))
    found = searched([variants[k] for k in numbers], path, camera, on_progress)
    views = {k: one for k, one in zip(numbers, found.views, strict=True) if one}
    if not views:
        raise not_found(path, best_variant(board, counts)[0])
    names = tuple(one.stem for one in with_suffix(path, IMAGE_SUFFIXES)) if path.is_dir() else ()
    return Detection(camera, path.name, board, found.size, found.period_s, found.looks, names, tuple(counts), views)


def not_found(path: Path, board: Board) -> UserError:
    """The error of a film without the board."""
    return UserError(f"{path}: the board is not found: {why_not_found(board, probes(path))}")


def camera_views(name: str, found: Searched, offset_s: float, numbers: Sequence[float] | None) -> CameraViews:
    """Views of a camera from those in its film.  offset_s: when the video begins.  numbers: of the moments of its pictures;
    None for a video."""
    (views,) = found.views
    if numbers is None:
        moved = [replace(one, time_s=one.time_s + offset_s) for one in views]
        return CameraViews(name, found.size, found.period_s, found.looks, with_velocities(moved, found.period_s))
    resting = [replace(one, time_s=numbers[round(one.time_s)], velocities=np.zeros_like(one.pixels)) for one in views]
    return CameraViews(name, found.size, found.period_s, found.looks, tuple(resting), True)
