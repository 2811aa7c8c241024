"""Silhouettes of one camera at the times of its own images, and what they would be at any other time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.tools.setup.calibration.silhouettes import Hulls
from zenocap.tools.setup.calibration.walk.parameters import DIRECTIONS, LONGEST_GAP_S


@dataclass(frozen=True)
class Series:
    """times: (n,) s, increasing.  points: (n, d, 3) unit rays, camera's frame.  cut: (n, d).

    points are the silhouette's farthest in each of d directions of the image plane.
    """

    times: Floats
    points: Floats
    cut: Bools

    def at(self, times: Floats) -> Hulls:
        """Hulls at times (m,), between two images interpolated point by point; NaN where neither is near.

        The support function of the interpolated hull is that of both, interpolated: the hull moves as its extremes do.
        """
        later = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        before = later - 1
        gap = self.times[later] - self.times[before]
        share = (times - self.times[before]) / gap
        known = (share >= 0.0) & (share <= 1.0) & (gap <= LONGEST_GAP_S)
        local = (1.0 - share)[:, None, None] * self.points[before] + share[:, None, None] * self.points[later]
        local /= np.linalg.norm(local, axis=2, keepdims=True)
        local[~known] = np.nan
        return Hulls(local, self.cut[before] | self.cut[later])


def series_of(times: Sequence[float] | Floats, hulls: Hulls) -> Series:
    """Series of hulls at n times, those without a silhouette left out."""
    seen = np.isfinite(hulls.local[..., 0]).any(axis=1)
    local, cut = hulls.local[seen], hulls.cut[seen]
    flat = local[..., :2] / local[..., 2:]
    angles = np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False)
    along = flat @ np.stack([np.cos(angles), np.sin(angles)])
    farthest = np.where(np.isfinite(along), along, -np.inf).argmax(axis=1)
    rows = np.arange(len(local))[:, None]
    return Series(np.asarray(times, dtype=np.float64)[seen], local[rows, farthest], cut[rows, farthest])
