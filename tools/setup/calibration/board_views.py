"""Views of a board: corners that a camera saw at a time, and how fast they moved."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.tools.setup.calibration.parameters import CELLS, NEIGHBOUR_PERIODS


@dataclass(frozen=True)
class View:
    """Corners of the board in one image.

    time_s: of the image, from the beginning that is common to all cameras.  ids: (n,) of the corners, ascending.
    pixels: (n, 2).  velocities: (n, 2) px/s; NaN where unknown.
    """

    time_s: float
    ids: Ints
    pixels: Floats
    velocities: Floats

    @property
    def speed(self) -> float:
        """Mean speed of the corners, px/s; NaN where unknown."""
        return float(np.hypot(*self.velocities.T).mean())

    def cells(self, size: tuple[int, int]) -> Bools:
        """Cells of the image that corners are in, (cells,)."""
        across = np.clip(self.pixels[:, 0] * CELLS[0] / size[0], 0, CELLS[0] - 1).astype(int)
        down = np.clip(self.pixels[:, 1] * CELLS[1] / size[1], 0, CELLS[1] - 1).astype(int)
        covered = np.zeros(CELLS[0] * CELLS[1], dtype=np.bool_)
        covered[down * CELLS[0] + across] = True
        return covered


@dataclass(frozen=True)
class CameraViews:
    """Views of one camera.  size: (width, height) px.  period_s: between images.  looks: searched images.

    views: by time.  still: pictures of a board at rest, whose times only number them.
    """

    name: str
    size: tuple[int, int]
    period_s: float
    looks: int
    views: tuple[View, ...]
    still: bool = False

    @property
    def coverage(self) -> float:
        """Share of the cells of the image in which corners were seen, 0 to 1."""
        if not self.views:
            return 0.0
        return float(np.any([view.cells(self.size) for view in self.views], axis=0).mean())


def with_velocities(views: Sequence[View], period_s: float) -> tuple[View, ...]:
    """Views by time with the velocities of corners from the views before and after; NaN without a near one."""
    ordered = sorted(views, key=lambda view: view.time_s)
    found, span_s = [], NEIGHBOUR_PERIODS * period_s
    for k, view in enumerate(ordered):
        near = [one for one in ordered[max(0, k - 1) : k + 2] if abs(one.time_s - view.time_s) < span_s]
        velocities = np.full(view.pixels.shape, np.nan)
        for early, late in ((near[0], near[-1]), (near[0], view), (view, near[-1])):
            if early.time_s == late.time_s:
                continue
            _, first, second = np.intersect1d(early.ids, late.ids, return_indices=True)
            shared, at, _ = np.intersect1d(view.ids, early.ids[first], return_indices=True)
            places = np.searchsorted(early.ids[first], shared)
            motion = (late.pixels[second] - early.pixels[first])[places] / (late.time_s - early.time_s)
            unknown = np.isnan(velocities[at, 0])
            velocities[at[unknown]] = motion[unknown]
        if np.isnan(velocities).any() and not np.isnan(velocities).all():
            velocities[np.isnan(velocities[:, 0])] = np.nanmean(velocities, axis=0)
        found.append(replace(view, velocities=velocities))
    return tuple(found)
