"""The search of a board in the film of one camera: which images are searched, and the corners in them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.rig.folder import IMAGE_SUFFIXES, with_suffix
from zenocap.common.video.reader import VideoReader, until_cut
from zenocap.services.viewer.sources.images import read_picture
from zenocap.tools.setup.calibration.board import Board
from zenocap.tools.setup.calibration.board_detection import BoardDetector
from zenocap.tools.setup.calibration.board_views import View
from zenocap.tools.setup.calibration.parameters import BURST_S, MAX_LOOKS, PROBED_FRAMES

OnProgress = Callable[[int, int, str], None]
"""Called with the number of read images, that of all, and the camera's name."""


@dataclass(frozen=True)
class Searched:
    """Views of a board in one camera's film.

    size: (width, height) px, (0, 0) where no image was searched.  period_s: between images.  looks: searched images.
    views: for each searched board, by time; times are seconds from the beginning of the film, or the numbers of pictures
    of a board at rest from 0.  Velocities are unknown.
    """

    size: tuple[int, int]
    period_s: float
    looks: int
    views: tuple[tuple[View, ...], ...]


def searched(boards: Sequence[Board], path: Path, name: str, on_progress: OnProgress = lambda *_: None) -> Searched:
    """Search boards in a video, or in a folder of images.  name: of the camera, for `on_progress`.  Raises UserError."""
    detectors = [BoardDetector(board) for board in boards]
    views: list[list[View]] = [[] for _ in boards]
    times: list[float] = []
    looks, size, fps = 0, (0, 0), 1.0
    if not (still := path.is_dir()):
        with VideoReader(path) as reader:
            fps = reader.fps
    for k, (time_s, grey, total) in enumerate(_images(path, _in_burst(fps))):
        on_progress(k + 1, total, name)
        times.append(time_s)
        if grey is None:
            continue
        looks += 1
        size = (grey.shape[1], grey.shape[0])
        for detector, found_views in zip(detectors, views, strict=True):
            if (found := detector.corners(grey)) is not None:
                found_views.append(View(time_s, found[0], found[1], np.full_like(found[1], np.nan)))
    period_s = float(np.median(np.diff(times))) if len(times) > 1 and not still else 1.0 / fps
    return Searched(size, period_s, looks, tuple(tuple(one) for one in views))


def _images(path: Path, wanted: Callable[[float, float], bool]) -> Iterator[tuple[float, Image | None, int]]:
    """Times (s from its beginning), grey images or None where not `wanted`(time, duration), and the declared number.

    Raises UserError where the size changes.
    """
    size: tuple[int, int] | None = None
    if path.is_dir():
        files = with_suffix(path, IMAGE_SUFFIXES)
        for k, file in enumerate(files):
            picture = read_picture(file, cv2.IMREAD_GRAYSCALE)
            size = _checked_size(file, picture, size)
            yield float(k), picture, len(files)
        return
    with VideoReader(path) as reader:
        duration_s = reader.declared / reader.fps
        for frame in until_cut(iter(reader.next, None)):
            time_s = frame.time_ns / 1e9
            grey: Image | None = None
            if wanted(time_s, duration_s):
                grey = np.asarray(cv2.cvtColor(frame.image(), cv2.COLOR_BGR2GRAY), dtype=np.uint8)
                size = _checked_size(path, grey, size)
            yield time_s, grey, reader.declared


def _checked_size(path: Path, grey: cv2.typing.MatLike, size: tuple[int, int] | None) -> tuple[int, int]:
    found = (grey.shape[1], grey.shape[0])
    if size is not None and found != size:
        raise UserError(
            f"{path}: the size of the images changes from {size[0]} x {size[1]} to {found[0]} x {found[1]} px: "
            "allowed: one size"
        )
    return found


def probes(path: Path) -> list[Image]:
    """A few images, evenly spread."""
    if path.is_dir():
        files = with_suffix(path, IMAGE_SUFFIXES)
        return [read_picture(file, cv2.IMREAD_GRAYSCALE) for file in files[:: max(1, len(files) // PROBED_FRAMES)]]
    next_s = 0.0

    def wanted(time_s: float, duration_s: float) -> bool:
        nonlocal next_s
        if time_s < next_s:
            return False
        next_s = time_s + duration_s / (2 * PROBED_FRAMES)
        return True

    kept = [grey for _, grey, _ in _images(path, wanted) if grey is not None]
    return kept[:: max(1, len(kept) // PROBED_FRAMES)]


def _in_burst(fps: float) -> Callable[[float, float], bool]:
    """Whether an image is searched: all of a short video, stretches of a long one."""

    def wanted(time_s: float, duration_s: float) -> bool:
        every_s = BURST_S * max(1.0, duration_s * fps / MAX_LOOKS)
        return every_s == BURST_S or (time_s + 1e-6) % every_s < BURST_S

    return wanted
