"""A simulated search of a board: stretches of views of a rig without images."""

from collections.abc import Sequence

from tests.support.board_views import BOARD, board_views, room
from zenocap.tools.setup.calibration.board_views import CameraViews
from zenocap.tools.setup.calibration.parameters import BURST_S
from zenocap.tools.setup.page.board_guide import BoardGuide, CameraProgress
from zenocap.tools.setup.page.board_search import Burst

FPS = 15.0


class SimulatedSearch:
    """Stands for `searched`: call number k gives the views of second k, up to `end`; none until `end` is later."""

    def __init__(self, seen: Sequence[CameraViews], end: int | None = None) -> None:
        self.seen, self.end, self.second = seen, end, 0

    def __call__(self, *_: object) -> Burst:
        if self.end is not None and self.second >= self.end:
            return Burst({}, {}, {})
        self.second += 1
        return burst_of(self.seen, self.second - 1)


def burst_of(seen: Sequence[CameraViews], second: int) -> Burst:
    """The views of the first BURST_S of a second."""
    views, moment = {}, {}
    for number, one in enumerate(seen):
        found = tuple(view for view in one.views if 0 <= view.time_s - second < BURST_S)
        middle = [view for view in found if abs(view.time_s - second - BURST_S / 2) < 0.6 / FPS]
        if middle:
            views[number], moment[number] = found, middle[0]
    return Burst(views, moment, dict.fromkeys(range(len(seen)), 6))


def simulated(count: int, seconds: float, seed: int = 0, size: tuple[int, int] = (1280, 720)) -> list[CameraViews]:
    return board_views(room(count, seed, size), fps=FPS, seconds=seconds, seed=seed)[0]


def guide_of(seen: Sequence[CameraViews]) -> BoardGuide:
    return BoardGuide(BOARD.corners, [CameraProgress(one.name, one.size) for one in seen])


def add_second(guide: BoardGuide, seen: Sequence[CameraViews], second: int) -> None:
    """As the live page does it."""
    burst = burst_of(seen, second)
    for number, views in burst.views.items():
        for view in views:
            guide.add_cells(number, view)
    guide.add(burst.moment)
