"""Camera delays from a walk: poses and delays adjusted together.

`common.lags` needs calibrated cameras, whose baselines give the angles that it compares; here poses are unknown.
The ways over the floor that two cameras see are registered at every lag of a grid; the lag at which they agree best starts
an adjustment of all poses and delays, in which each camera's silhouettes are interpolated in time.  Standard errors are
those of a jackknife over stretches of time.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import jackknife_error
from zenocap.tools.setup.calibration.silhouettes import Hulls
from zenocap.tools.setup.calibration.walk import parameters as p
from zenocap.tools.setup.calibration.walk.adjustment import Walk, adjusted
from zenocap.tools.setup.calibration.walk.registration import registered
from zenocap.tools.setup.calibration.walk.single_view import SingleView, Track, smooth, track_of


@dataclass(frozen=True)
class Series:
    """Silhouettes of one camera at the times of its own images.

    times: (n,) s, increasing.  points: (n, d, 3) unit rays in the camera's frame, the silhouette's farthest in each of d
    directions of the image plane.  cut: (n, d).
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
        known = (share >= 0.0) & (share <= 1.0) & (gap <= p.LONGEST_GAP_S)
        local = (1.0 - share)[:, None, None] * self.points[before] + share[:, None, None] * self.points[later]
        local /= np.linalg.norm(local, axis=2, keepdims=True)
        local[~known] = np.nan
        return Hulls(local, self.cut[before] | self.cut[later])


def series_of(times: Sequence[float] | Floats, hulls: Hulls) -> Series:
    """Series of hulls at n times, those without a silhouette left out."""
    seen = np.isfinite(hulls.local[..., 0]).any(axis=1)
    local, cut = hulls.local[seen], hulls.cut[seen]
    flat = local[..., :2] / local[..., 2:]
    angles = np.linspace(0.0, 2.0 * np.pi, p.DIRECTIONS, endpoint=False)
    along = flat @ np.stack([np.cos(angles), np.sin(angles)])
    farthest = np.where(np.isfinite(along), along, -np.inf).argmax(axis=1)
    rows = np.arange(len(local))[:, None]
    return Series(np.asarray(times, dtype=np.float64)[seen], local[rows, farthest], cut[rows, farthest])


@dataclass(frozen=True)
class Delay:
    """Delay of a camera's images against the first camera, seconds.  error_s: standard error."""

    seconds: float
    error_s: float

    @property
    def is_certain(self) -> bool:
        return abs(self.seconds) > p.DELAY_ERRORS * self.error_s


@dataclass(frozen=True)
class SilhouetteSeries:
    """Silhouettes of all cameras as functions of time.  series: by camera.  instants: (n,) of the first camera, s."""

    series: Mapping[str, Series]
    instants: Floats

    def hulls(self, delays: Mapping[str, float]) -> dict[str, Hulls]:
        """Hulls of all cameras at the instants.  delays: s."""
        return {name: one.at(self.instants - delays[name]) for name, one in self.series.items()}

    def part(self, kept: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> "SilhouetteSeries":
        return SilhouetteSeries(self.series, self.instants[kept])


def coarse_delays(views: Mapping[str, SingleView], timing: SilhouetteSeries, height_m: float) -> dict[str, float]:
    """Delays of the cameras that can be joined to the first one by their tracks, s, to a fraction of a step."""
    grid = np.arange(timing.instants[0] - p.MOST_DELAY_S, timing.instants[-1] + p.MOST_DELAY_S, p.LAG_STEP_S)
    window = 2 * round(0.5 * p.TRACK_SMOOTHING_S / p.LAG_STEP_S) + 1
    tracks = {
        name: smooth(track_of(timing.series[name].at(grid), view.rotation[:, 1], height_m), window)
        for name, view in views.items()
    }
    lags = {}
    for one, other in combinations(tracks, 2):
        found = best_lag(tracks[one], tracks[other])
        if found is not None:
            lags[one, other] = found
    first = next(iter(views))
    known = {first: 0.0}
    both = lags | {(other, one): (-lag, agreeing) for (one, other), (lag, agreeing) in lags.items()}
    while True:
        open_pairs = [pair for pair in both if pair[0] in known and pair[1] not in known]
        if not open_pairs:
            return known
        one, other = max(open_pairs, key=lambda pair: both[pair][1])
        known[other] = known[one] + both[one, other][0]


def best_lag(one: Track, other: Track) -> tuple[float, int] | None:
    """Delay s of `other` against `one`, tracks on the same grid, and the number of agreeing instants; None without any."""
    most = round(p.MOST_DELAY_S / p.LAG_STEP_S)
    scores = np.full(2 * most + 1, np.inf)
    agreeing = np.zeros(2 * most + 1, dtype=np.int64)
    for k, steps in enumerate(range(-most, most + 1)):
        # At equal times of the scene: an image of `other` at t shows what `one` shows at t + steps.
        count = len(one) - abs(steps)
        motion = registered(one[max(0, steps) :][:count], other[max(0, -steps) :][:count])
        if motion is not None and motion.agreeing >= p.LEAST_AGREEING * motion.common and not motion.mirrored:
            scores[k], agreeing[k] = motion.error_m, motion.agreeing
    k = int(scores.argmin())
    if not np.isfinite(scores[k]):
        return None
    shift = 0.0
    if 0 < k < 2 * most and np.isfinite(scores[k - 1 : k + 2]).all():
        before, here, after = scores[k - 1 : k + 2] ** 2
        shift = 0.5 * (before - after) / max(1e-12, before - 2.0 * here + after)
    return (k - most + float(np.clip(shift, -0.5, 0.5))) * p.LAG_STEP_S, int(agreeing[k])


def adjusted_delays(
    start: Mapping[str, Camera],
    timing: SilhouetteSeries,
    stature_m: float,
    coarse: Mapping[str, float],
    on_step: Callable[[str], None] = lambda _: None,
) -> dict[str, Delay]:
    """Delays with their standard errors, from cameras near to the truth and delays right to a fraction of a step."""

    def walk_at(part: SilhouetteSeries) -> Callable[[Mapping[str, float]], Walk]:
        kept: dict[str, tuple[float, Hulls]] = {}

        def at(delays: Mapping[str, float]) -> Walk:
            hulls = {}
            for name, series in part.series.items():
                before = kept.get(name)
                if before is None or before[0] != delays[name]:
                    kept[name] = delays[name], series.at(part.instants - delays[name])
                hulls[name] = kept[name][1]
            return Walk(hulls, stature_m)

        return at

    on_step("delays")
    cameras, delays = adjusted(start, walk_at(timing), coarse)
    parts = []
    blocks = np.array_split(np.arange(len(timing.instants)), p.DELAY_BLOCKS)
    for k, block in enumerate(blocks):
        on_step(f"errors of the delays, {k + 1} of {len(blocks)}")
        kept = np.setdiff1d(np.arange(len(timing.instants)), block)
        parts.append(list(adjusted(cameras, walk_at(timing.part(kept)), delays, 1)[1].values()))
    spread = jackknife_error(np.array(parts) - np.mean(parts, axis=0))
    first = next(iter(delays))
    return {
        name: Delay(seconds, 0.0 if name == first else float(np.hypot(error, p.DELAY_BIAS_S)))
        for (name, seconds), error in zip(delays.items(), spread, strict=True)
    }
