"""Flashes and switched lights in videos: steps of the image's brightness.

A person who moves changes some of the image, a flash all of it: the median over cells of the image is compared.  Within a
frame the time of a change is known only as far as the light falls into two exposures: see `LightChange.error_periods`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.lags.pairs import Curve, Lag, Limits
from zenocap.tools.setup.sync.videos import Brightness

# Chosen by hand and checked with `python -m benchmarks flashes`, unless another source is given.
SETTLING_S = 0.7  # at the beginning, in which the exposure of a camera settles: changes there do not count
LEAST_CHANGE = 1.5  # grey levels of 255, from one frame to the next
LEAST_NOISES = 8.0  # standard deviations of the ordinary change
ALIKE = 0.7  # share of the cells that change in the same direction
LONGEST_S = 0.4  # of a flash; a longer one is two changes
RETURNED = 0.3  # of a flash's height: remaining change after it, above which the light was switched
STRONGEST = 40.0  # noises; stronger changes count as this
STEP_S = 1 / 240  # of the curve of lags
# Standard deviation of a time within a frame, in frame periods: the light is in one exposure (uniform), or in several.
# These are shorter than the period by an unknown part.
ONE_EXPOSURE, SEVERAL_EXPOSURES = 0.29, 0.15
SHARED = 0.08  # of a flash's light, from which an exposure has part in it
FLASH_LIMITS = Limits(margin=8.0, ratio=1.3, apart_s=0.12, error_s=0.03)


@dataclass(frozen=True)
class LightChange:
    """time_s: its middle.  strength: in noises, negative for darker.  flash: whether the light returned.

    error_periods: standard deviation of the time, frame periods.  period_s: frame period.
    """

    time_s: float
    strength: float
    flash: bool
    error_periods: float
    period_s: float


def light_changes(brightness: Brightness) -> list[LightChange]:
    """Changes of the light in the order of their times."""
    times, cells = brightness.times_s, brightness.cells
    if len(times) < 5:
        return []
    steps = np.diff(cells, axis=0)
    change = np.median(steps, axis=1)
    noise = 1.4826 * float(np.median(np.abs(change - np.median(change))))
    least = max(LEAST_CHANGE, LEAST_NOISES * noise)
    alike = np.mean(np.sign(steps) == np.sign(change)[:, None], axis=1)
    sudden = (np.abs(change) >= least) & (alike >= ALIKE) & (times[1:] >= SETTLING_S)
    period_s = float(np.median(np.diff(times)))
    level = np.median(cells, axis=1)
    found, rows = [], np.flatnonzero(sudden).tolist()  # change k is that from frame k to k + 1
    while rows:
        first = last = rows.pop(0)
        while rows and times[rows[0]] - times[first] <= LONGEST_S and _goes_on(change, (first, last), rows[0], least):
            last = rows.pop(0)
        found.append(_change(times, level, change, (first, last), (least, period_s)))
    return found


def _goes_on(change: Floats, rows: tuple[int, int], row: int, least: float) -> bool:
    """Whether a sudden change belongs to the event of `rows`, first and last: next to it, or the light has not returned."""
    return row == rows[1] + 1 or abs(float(change[rows[0] : row].sum())) >= least


def _change(times: Floats, level: Floats, change: Floats, rows: tuple[int, int], scale: tuple[float, float]) -> LightChange:
    """The event of the changes `rows`, first and last.  scale: least change of a sudden one, frame period."""
    (first, last), (least, period_s) = rows, scale
    first, last = max(0, first - 1), min(len(change) - 1, last + 1)  # with the weak ends of split light
    before, after = float(np.median(level[max(0, first - 2) : first + 1])), float(np.median(level[last + 1 : last + 4]))
    excess = level[first + 1 : last + 1] - before
    height = float(excess[np.argmax(np.abs(excess))]) if len(excess) else 0.0
    flash = bool(len(excess)) and abs(after - before) <= RETURNED * abs(height)
    if flash:
        light = (excess - np.linspace(0.0, after - before, len(excess) + 2)[1:-1]) / height
        light, at = np.maximum(light, 0.0), times[first + 1 : last + 1]
    else:
        height = after - before if abs(after - before) >= least else float(change[first : last + 1].sum())
        light, at = np.maximum(change[first : last + 1] / (height or 1.0), 0.0), times[first + 1 : last + 2]
    total = float(light.sum())
    time_s = float(light @ at) / total if total > 0 else float(times[last])
    shared = np.count_nonzero(light > SHARED * total) > 1
    strength = float(np.clip(height / least * LEAST_NOISES, -STRONGEST, STRONGEST))
    return LightChange(time_s, strength, flash, SEVERAL_EXPOSURES if shared else ONE_EXPOSURE, period_s)


@dataclass(frozen=True)
class FlashPair:
    """Changes of the light in two videos.  max_lag_s: range of the search."""

    one: Sequence[LightChange]
    other: Sequence[LightChange]
    max_lag_s: float

    @cached_property
    def _matches(self) -> list[tuple[float, float, float]]:
        """Lag, strength, and standard error of the lag of each two changes of the same kind."""
        return [
            (
                a.time_s - b.time_s,
                min(abs(a.strength), abs(b.strength)),
                float(np.hypot(a.error_periods * a.period_s, b.error_periods * b.period_s)),
            )
            for a in self.one
            for b in self.other
            if a.flash == b.flash and a.strength * b.strength > 0
        ]

    @property
    def _width_s(self) -> float:
        """Difference of lags that the frames explain."""
        return 1.5 * max((change.period_s for change in (*self.one, *self.other)), default=STEP_S)

    @cached_property
    def curve(self) -> Curve:
        """Strength of the changes that a lag brings together, noises."""
        half = int(self.max_lag_s / STEP_S)
        lags = np.arange(-half, half + 1) * STEP_S
        values = np.zeros(len(lags))
        for lag_s, strength, _ in self._matches:
            values += strength * np.maximum(0.0, 1.0 - np.abs(lags - lag_s) / self._width_s)
        return Curve(STEP_S, values)

    def refined(self, lag_s: float) -> Lag | None:
        """Weighted mean of the lags near `lag_s`.  residual: their RMS difference, ms."""
        near = np.array([(lag, error) for lag, _, error in self._matches if abs(lag - lag_s) <= self._width_s])
        if not len(near):
            return None
        weights = near[:, 1] ** -2.0
        mean = float(weights @ near[:, 0] / weights.sum())
        spread = float(np.sqrt(np.mean((near[:, 0] - mean) ** 2)))
        return Lag(mean, max(float(weights.sum() ** -0.5), spread / np.sqrt(len(near))), 1e3 * spread)
