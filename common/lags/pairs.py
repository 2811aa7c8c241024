"""Camera offsets from pairs: search, certainty, weighted least squares over all pairs.

The lag of a pair (a, b) is the time at which the video of b begins minus that at which the video of a begins.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from zenocap.common.arrays import Floats

LOOP_SIGMA = 4.0  # standard errors of a pair's lag from that of all pairs, beyond which it counts less; chosen by hand
ROUNDS = 20  # of the reweighted least squares; converges in about five


@dataclass(frozen=True)
class Curve:
    """Evidence for each lag.  values: (2 n + 1,), of the lags -n to n times `step_s`; additive over pairs."""

    step_s: float
    values: Floats

    @property
    def lags_s(self) -> Floats:
        """Lags of the values, seconds."""
        half = len(self.values) // 2
        return np.asarray(np.arange(-half, half + 1) * self.step_s, dtype=np.float64)

    def mirrored(self) -> "Curve":
        """The curve of the pair in the other order."""
        return Curve(self.step_s, self.values[::-1])


@dataclass(frozen=True)
class Lag:
    """Refined lag of a pair.  error_s: standard error.  residual: RMS of what was compared, in its own unit."""

    lag_s: float
    error_s: float
    residual: float


class Comparison(Protocol):
    """What two cameras have in common."""

    @property
    def curve(self) -> Curve: ...

    def refined(self, lag_s: float) -> Lag | None:
        """The lag near a coarse one; None where the two have too little in common there."""
        ...


Pairs = Mapping[tuple[str, str], Comparison]


@dataclass(frozen=True)
class Limits:
    """What counts as certain.

    margin: of the best lag's evidence over that of the next.  ratio: of the two.  apart_s: from the best lag to the next
    one at least.  error_s: largest standard error.  max_lag_s: largest lag; curves reach farther (`reach_s`), so that a
    true lag beyond it is found out.
    """

    margin: float
    ratio: float
    apart_s: float
    error_s: float
    max_lag_s: float = inf


@dataclass(frozen=True)
class VideoOffset:
    """Time at which a camera's video begins, from that of the reference camera on.

    margin: of the evidence, see `Limits`.  error_s: standard error.  pairs: number of pairs that it was found from.
    reason: why the offset is not certain; empty where it is.
    """

    offset_s: float
    error_s: float
    margin: float
    residual: float
    pairs: int
    reason: str = ""


@dataclass(frozen=True)
class Peak:
    """Best lag of a curve.  value: its evidence; second: that of the next one.  edge: whether it is out of range."""

    lag_s: float
    value: float
    second: float
    edge: bool

    def is_certain(self, limits: Limits) -> bool:
        return not self.edge and self.margin >= limits.margin and self.value >= limits.ratio * self.second

    @property
    def margin(self) -> float:
        return self.value - self.second


def jackknife_error(deviations: ArrayLike) -> Floats:
    """Standard errors from the deviations (n, ...) of n results without one block each."""
    values = np.asarray(deviations, dtype=np.float64)
    return np.asarray(np.sqrt((len(values) - 1) / len(values) * np.sum(values**2, axis=0)))


def reach_s(max_lag_s: float) -> float:
    """Range of lags to compare for a largest lag that is allowed, seconds."""
    return 1.25 * max_lag_s + 1.0


def peak_of(lags_s: Floats, values: Floats, limits: Limits) -> Peak:
    """The best lag, and the evidence of the best one that is at least `limits.apart_s` away."""
    best = int(np.argmax(values))
    others = values[np.abs(lags_s - lags_s[best]) >= limits.apart_s]
    second = max(0.0, float(others.max())) if len(others) else 0.0
    return Peak(float(lags_s[best]), float(values[best]), second, abs(float(lags_s[best])) > limits.max_lag_s)


def offsets_of(names: Sequence[str], pairs: Pairs, limits: Limits, known: Mapping[str, float]) -> dict[str, VideoOffset]:
    """Offset of each camera, certain or not; the group of certain ones grows by one camera at a time.

    known: offsets in seconds of the first members of the group; empty to begin with the most certain pair.
    A camera outside is compared with all members at once: their curves are added.
    """
    group, found, margins = _grouped(names, pairs, limits, known)
    found |= _adjusted(names, group, known, pairs, margins, limits)
    return {name: found[name] for name in names}


def coarse_lags(names: Sequence[str], pairs: Pairs, limits: Limits) -> dict[tuple[str, str], float]:
    """Lag in seconds near which `offsets_of` refines each pair of certain cameras, from the curves alone."""
    group, _, _ = _grouped(names, pairs, limits, {})
    if len(group) < 2:
        return {}
    group = _from_reference(group, next(name for name in names if name in group))
    return {(a, b): group[b] - group[a] for a, b in pairs if a in group and b in group}


def _from_reference(group: Mapping[str, float], reference: str) -> dict[str, float]:
    return {name: offset_s - group[reference] for name, offset_s in group.items()}


def _grouped(
    names: Sequence[str], pairs: Pairs, limits: Limits, known: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, VideoOffset], dict[str, float]]:
    """Coarse offsets of the certain cameras, what is found of the others, and the margins of the certain ones."""
    group = dict(known)
    found = {name: VideoOffset(offset_s, 0.0, 0.0, 0.0, 0) for name, offset_s in group.items()}
    if not group:
        group[_first(names, pairs, limits)] = 0.0
    margins: dict[str, float] = {}
    while outside := [name for name in names if name not in group]:
        peaks = {name: peak for name in outside if (peak := _peak_to_group(name, group, pairs, limits)) is not None}
        if not peaks:
            break
        name = max(peaks, key=lambda one: (peaks[one].is_certain(limits), peaks[one].margin))
        if not peaks[name].is_certain(limits):
            for other, peak in peaks.items():
                found[other] = VideoOffset(peak.lag_s, float("nan"), peak.margin, float("nan"), 0, _reason(peak, limits))
            break
        group[name], margins[name] = peaks[name].lag_s, peaks[name].margin
    for name in names:
        if name not in group and name not in found:
            found[name] = VideoOffset(float("nan"), float("nan"), 0.0, float("nan"), 0, "nothing in common with the others")
    return group, found, margins


def _first(names: Sequence[str], pairs: Pairs, limits: Limits) -> str:
    """A camera of the pair with the largest margin, the first camera without pairs."""
    peaks = {pair: peak_of(one.curve.lags_s, one.curve.values, limits) for pair, one in pairs.items()}
    return max(peaks, key=lambda pair: (not peaks[pair].edge, peaks[pair].margin))[0] if peaks else names[0]


def _peak_to_group(name: str, group: Mapping[str, float], pairs: Pairs, limits: Limits) -> Peak | None:
    """Peak of the offset of a camera outside; None for one that has nothing in common with the group."""
    curves = []
    for member, offset_s in group.items():
        if (member, name) in pairs:
            curves.append((offset_s, pairs[member, name].curve))
        elif (name, member) in pairs:
            curves.append((offset_s, pairs[name, member].curve.mirrored()))
    if not curves:
        return None
    step_s = curves[0][1].step_s
    first, last = (round(pick(o + c.lags_s[k] for o, c in curves) / step_s) for pick, k in ((min, 0), (max, -1)))
    lags = np.arange(first, last + 1) * step_s
    total = sum(np.interp(lags, offset_s + curve.lags_s, curve.values, 0.0, 0.0) for offset_s, curve in curves)
    peak = peak_of(lags, np.asarray(total), limits)
    return replace(peak, edge=any(abs(peak.lag_s - offset_s) > limits.max_lag_s for offset_s, _ in curves))


def _reason(peak: Peak, limits: Limits) -> str:
    if peak.edge:
        return "the best offset is larger than --max-offset"
    if peak.value < limits.margin:
        return "the videos have too little in common"
    return "other offsets fit nearly as well"


def _adjusted(
    names: Sequence[str],
    group: Mapping[str, float],
    known: Mapping[str, float],
    pairs: Pairs,
    margins: Mapping[str, float],
    limits: Limits,
) -> dict[str, VideoOffset]:
    """Offsets of the group by weighted least squares over the refined lags of all its pairs; `known` ones stay.

    Lags that contradict the others (loops that do not close) lose weight: Cauchy weights.
    """
    reference = [] if known else [next(name for name in names if name in group)]
    fixed = set(known) or set(reference)
    group = dict(group) if known else _from_reference(group, reference[0])
    free = [name for name in group if name not in fixed]
    lags = {
        (a, b): lag
        for (a, b), one in pairs.items()
        if a in group and b in group and (a in free or b in free)
        if (lag := one.refined(group[b] - group[a])) is not None and abs(lag.lag_s - group[b] + group[a]) < limits.apart_s
    }
    if not free:
        return {name: VideoOffset(0.0, 0.0, 0.0, 0.0, 0, "no other camera is certain") for name in reference}
    columns = {name: k for k, name in enumerate(free)}
    design, target = np.zeros((len(lags), len(free))), np.zeros(len(lags))
    for row, ((a, b), lag) in enumerate(lags.items()):
        target[row] = lag.lag_s
        for name, sign in ((b, 1.0), (a, -1.0)):
            if name in columns:
                design[row, columns[name]] = sign
            else:
                target[row] -= sign * group[name]
    errors = np.array([lag.error_s for lag in lags.values()])
    weights, solution = errors**-2.0, np.zeros(len(free))
    for _ in range(ROUNDS):
        normal = design.T @ (weights[:, None] * design)
        solution = np.linalg.pinv(normal) @ (design.T @ (weights * target))
        misfit = (design @ solution - target) / errors
        weights = errors**-2.0 / (1.0 + (misfit / LOOP_SIGMA) ** 2)
    spare = max(1, len(lags) - len(free))
    scale = max(1.0, float(np.sqrt(np.sum(weights * errors**2 * misfit**2) / spare))) if len(lags) > len(free) else 1.0
    covariance = np.linalg.pinv(design.T @ (weights[:, None] * design))
    first_margin = max(margins.values())  # of the camera that the group began with
    adjusted = {}
    for name, k in columns.items():
        own = [lag for pair, lag in lags.items() if name in pair]
        error_s = scale * float(np.sqrt(covariance[k, k])) if own else float("nan")
        reason = "" if own and error_s <= limits.error_s else f"the offset is inexact: ± {1e3 * error_s:.0f} ms"
        residual = float(np.median([lag.residual for lag in own])) if own else float("nan")
        adjusted[name] = VideoOffset(
            float(solution[k]), error_s, margins.get(name, first_margin), residual, len(own), reason
        )
    best = max((one.margin for one in adjusted.values()), default=0.0)
    residual = float(np.median([lag.residual for lag in lags.values()])) if lags else float("nan")
    return adjusted | {name: VideoOffset(0.0, 0.0, best, residual, len(group) - 1) for name in reference}
