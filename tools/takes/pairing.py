"""Rows of two series that belong to the same instants, and changes of one after which the two agree."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Ints

CLOCK_S = 1e-6  # added to half an interval, for times rounded to decimals
BETTER = 0.5  # of the error, below which a change of the truth is named; chosen by hand
LEAST_OVERLAP = 0.5  # of the compared rows
SEARCHED_ROWS, MOST_OFFSETS = 100, 20_000

Distance = Callable[[Floats, Floats], Floats]  # (n, values) of (n, values, ...) found and expected, NaN where unknown


@dataclass(frozen=True)
class TimedValues:
    """Values (n, names, ...) at n rising times, seconds.  rate: rows per second of a series that leaves rows out."""

    names: tuple[str, ...]
    times_s: Floats
    values: Floats
    rate: float


@dataclass(frozen=True)
class Change:
    """A change of the truth, in words.  mean: distance after it, in the unit of the values.  cause: what it suggests."""

    words: str
    mean: float
    cause: str

    def text(self, unit: str, mean: float) -> str:
        """mean: the distance without the change."""
        instead = f" instead of {mean:.0f}" if np.isfinite(mean) else ""
        return f"{self.words} the mean error is {self.mean:.0f} {unit}{instead}: {self.cause}"


def better_changes(
    take: TimedValues, truth: TimedValues, shift_s: float, mean: float, distance: Distance, units: Mapping[str, float],
    turns: Mapping[str, Floats] | None = None,
) -> list[Change]:  # fmt: skip
    """Changes of the truth that leave less than half of the mean distance, the best first.

    take, truth: with the same names.  shift_s: time of the take minus that of the truth.  units: factors by their name.
    turns: rotations (3, 3) of points, by their words.
    """
    if not len(truth.times_s) or not len(take.times_s):
        return []
    take_at, truth_at = paired_rows(take.times_s - shift_s, truth.times_s, take.rate)
    both = (take_at >= 0) & (truth_at >= 0)
    found, expected = take.values[take_at[both]], truth.values[truth_at[both]]
    changes = [*_offset(take, truth, mean, distance)]
    if both.any():
        swapped = [truth.names.index(other) for other in map(_other_side, truth.names) if other in truth.names]
        if len(swapped) == len(truth.names) and swapped != list(range(len(swapped))):
            words, cause = "with left and right of the truth exchanged", "is one side mirrored, or front and back mistaken?"
            changes.append(Change(words, _mean(distance(found, expected[:, swapped])), cause))
        for name, factor in units.items():
            words, cause = f"with the truth times {factor:.4g}", f"are its numbers in {name}?"
            changes.append(Change(words, _mean(distance(found, expected * factor)), cause))
        for words, turn in (turns or {}).items():
            mean_after = _mean(distance(found, expected @ turn.T))
            changes.append(Change(f"with the truth turned by {words}", mean_after, "has it other axes?"))
    return sorted((one for one in changes if one.mean < BETTER * mean), key=lambda one: one.mean)


def _other_side(name: str) -> str:
    """Name of the same joint or angle of the other side: RKnee and LKnee, knee_flexion_r and knee_flexion_l."""
    ends = {"_r": "_l", "_l": "_r"}
    if name[-2:] in ends:
        return name[:-2] + ends[name[-2:]]
    sides = {"R": "L", "L": "R"}
    return sides[name[0]] + name[1:] if name[:1] in sides and name[1:2].isupper() else name


def _mean(distance: Floats) -> float:
    return float(np.nanmean(distance)) if np.isfinite(distance).any() else float("inf")


def _offset(take: TimedValues, truth: TimedValues, mean: float, distance: Distance) -> Iterator[Change]:
    """The best other offset."""
    step_s = period(take.times_s)
    rows = slice(None, None, -(-len(truth.times_s) // SEARCHED_ROWS))
    if not step_s or not take.rate:
        return
    expected, times_s = truth.values[rows], truth.times_s[rows]
    steps = np.round((times_s - times_s[0]) / step_s).astype(np.int64)  # in rows of the take
    best = (BETTER * mean, 0)
    for start in range(-int(steps[-1]), len(take.times_s))[:MOST_OFFSETS]:
        at = steps + start
        inside = (at >= 0) & (at < len(take.times_s))
        if np.count_nonzero(inside) >= LEAST_OVERLAP * len(at):
            found = distance(take.values[at[inside]], expected[inside])
            if np.count_nonzero(np.isfinite(found)) > LEAST_OVERLAP * found.size:
                best = min(best, (float(np.nanmean(found)), start))
    if best[0] < BETTER * mean:
        offset = round((take.times_s[0] + best[1] * step_s - times_s[0]) * take.rate)
        yield Change(f"with --offset {offset}", best[0], "do numbers and times of the truth begin again?")


def paired_rows(one_s: Floats, other_s: Floats, one_rate: float = 0.0) -> tuple[Ints, Ints]:
    """Rows (m,) of both rising series of times (n,), seconds, at the m instants of the slower one within the other's time.

    -1 in the faster series where it has no time within half of its interval.  At equal rates, every instant of `other_s`.
    one_rate: of a series that leaves rows out, per second; 0: that of its median interval.
    """
    one_period, other_period = 1.0 / one_rate if one_rate else period(one_s), period(other_s)
    if one_period > other_period * 1.001:  # rates of live takes are not exact
        half = 0.5 * other_period + CLOCK_S
        inner = np.flatnonzero((one_s >= other_s[0] - half) & (one_s <= other_s[-1] + half))
        return inner, _nearest(other_s, one_s[inner], half)
    rows = np.arange(len(other_s), dtype=np.int64)
    return _nearest(one_s, other_s, 0.5 * (one_period or other_period) + CLOCK_S), rows


def _nearest(times_s: Floats, wanted_s: Floats, tolerance_s: float) -> Ints:
    """Row (m,) of `times_s` (n,) nearest to each of `wanted_s` (m,), -1 farther away than the tolerance."""
    right = np.clip(np.searchsorted(times_s, wanted_s), 0, len(times_s) - 1)
    left = np.clip(right - 1, 0, None)
    nearest = np.where(np.abs(times_s[left] - wanted_s) < np.abs(times_s[right] - wanted_s), left, right)
    return np.where(np.abs(times_s[nearest] - wanted_s) <= tolerance_s, nearest, -1).astype(np.int64)


def period(times_s: Floats) -> float:
    """Median interval, seconds; 0 for one row."""
    return float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
