"""Search of a board in short stretches of images of live cameras.

The speed of the corners, from which delays follow, needs neighbouring images; all images of all cameras are more than a
machine can search.  In every BURST_PERIOD_S, the images of the last KEPT_S are searched in the cameras that see the board.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.vision.image_measures import grey_of
from zenocap.services.viewer.frame import Frame
from zenocap.tools.setup.calibration.board import Board
from zenocap.tools.setup.calibration.board_detection import BoardDetector, board_variant
from zenocap.tools.setup.calibration.board_views import View
from zenocap.tools.setup.calibration.parameters import PAIRED_PERIODS
from zenocap.tools.setup.page.parameters import VARIANT_IMAGES

THREADS = 2  # that search at the same time; chosen by hand


@dataclass(frozen=True)
class Burst:
    """A stretch of images.  views: found ones by camera, those of the moment in the middle among them.

    moment: the views of that moment, by camera.  looks: number of searched images, by camera.
    """

    views: Mapping[int, tuple[View, ...]]
    moment: Mapping[int, View]
    looks: Mapping[int, int]


class VariantSearch:
    """Tells the variant of a board (older pattern, exchanged colours) from the first images that show it."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.known = len(board.variants()) == 1
        self._images: list[Image] = []

    def add(self, grey: Image) -> bool:
        """Use an image, unless the variant is known; returns whether it has become known."""
        if self.known or not board_variant(self.board, [grey])[1]:
            return False
        self._images.append(grey)
        if len(self._images) < VARIANT_IMAGES:
            return False
        self.board, _ = board_variant(self.board, self._images)
        self.known, self._images = True, []
        return True


def view_of(detector: BoardDetector, frame: Frame, epoch_ns: int) -> View | None:
    """The board in an image; None where it is not found.  epoch_ns: time 0."""
    found = detector.corners(grey_of(frame.image))
    if found is None:
        return None
    ids, pixels = found
    return View((frame.captured_ns - epoch_ns) / 1e9, ids, pixels, np.full_like(pixels, np.nan))


def searched(board: Board, recent: Sequence[Sequence[Frame]], periods_s: Sequence[float], epoch_ns: int) -> Burst:
    """Search the recent images of all cameras, oldest first, at one moment, and around it where the board is seen.

    periods_s: between the images of each camera.  Where one camera alone sees the board, the next images suffice.
    """
    live = [k for k, frames in enumerate(recent) if frames]
    if not live:
        return Burst({}, {}, {})
    # Common to all cameras: the middle between the latest first and the earliest last image.
    begin_ns, end_ns = max(recent[k][0].captured_ns for k in live), min(recent[k][-1].captured_ns for k in live)
    at_ns = (begin_ns + end_ns) // 2
    middles: dict[int, int] = {}
    for k in live:
        nearest = min(range(len(recent[k])), key=lambda n: abs(recent[k][n].captured_ns - at_ns))
        if abs(recent[k][nearest].captured_ns - at_ns) <= PAIRED_PERIODS * periods_s[k] * 1e9:
            middles[k] = nearest
    with ThreadPoolExecutor(THREADS) as pool:
        work = [(k, recent[k][n]) for k, n in middles.items()]
        found = pool.map(lambda one: view_of(BoardDetector(board), one[1], epoch_ns), work)
        moment = {k: view for (k, _), view in zip(work, found, strict=True) if view is not None}
        reach = 1 if len(moment) == 1 else len(max(recent, key=len))
        others = [
            (k, frame)
            for k in moment
            for n, frame in enumerate(recent[k])
            if n != middles[k] and abs(n - middles[k]) <= reach
        ]
        more = list(pool.map(lambda one: view_of(BoardDetector(board), one[1], epoch_ns), others))
    views = {k: [view] for k, view in moment.items()}
    looks = dict.fromkeys(middles, 1)
    for (k, _), view in zip(others, more, strict=True):
        looks[k] += 1
        if view is not None:
            views[k].append(view)
    ordered = {k: tuple(sorted(each, key=lambda view: view.time_s)) for k, each in views.items()}
    return Burst(ordered, moment, looks)
