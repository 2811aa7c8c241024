"""Comparison of cameras in parts of bounded length, for steps of a service."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import Curve, Lag, Limits, coarse_lags, reach_s
from zenocap.common.lags.tangents import (
    COARSE_STEPS,
    STEP_S,
    Baseline,
    Outline,
    Refinement,
    SilhouettePair,
    Tangents,
    baseline_of,
    pair_of,
    scene_centre,
    tangents,
)

# Parts of 8 to 16 ms of processor time each (`python -m benchmarks live-delays`).
OUTLINES_AT_ONCE = 150
LAGS_AT_ONCE = 20
STEPS_AT_ONCE = 3  # of a refinement


@dataclass(frozen=True)
class PairProgress:
    """What is done of the comparison of two cameras, whose `outlines` are given in the order of time.

    found: tangents of each part so far, by camera.  values: of the curve so far.  ended: no part is left;
    then `pair` is None where the two cannot be compared.
    """

    cameras: tuple[Camera, Camera]
    outlines: tuple[Sequence[Outline], Sequence[Outline]]
    max_lag_s: float
    baseline: Baseline | None = None
    found: tuple[tuple[Tangents, ...], tuple[Tangents, ...]] = ((), ())
    pair: SilhouettePair | None = None
    values: tuple[float, ...] = ()
    ended: bool = False


@dataclass(frozen=True)
class ComparedPair:
    """A pair whose curve is known, and later its lag, refined near that of `coarse_lags`.  A `Comparison` of `pairs`."""

    pair: SilhouettePair
    curve: Curve
    refinement: Refinement | None = None

    def refined(self, lag_s: float) -> Lag | None:
        return None if self.refinement is None else self.refinement.lag

    def refined_further(self, lag_s: float) -> "ComparedPair":
        """The pair after the next part of its refinement near the lag of `coarse_lags`."""
        return replace(self, refinement=self.pair.refine(self.refinement or Refinement(lag_s), STEPS_AT_ONCE))

    @property
    def is_refined(self) -> bool:
        return self.refinement is not None and self.refinement.ended


def advance(progress: PairProgress) -> PairProgress:
    """Do the next part."""
    if progress.baseline is None:
        scene = scene_centre(progress.cameras, progress.outlines)
        baseline = baseline_of(*progress.cameras, scene)
        return replace(progress, baseline=baseline, ended=baseline is None)
    if progress.pair is not None:
        first = len(progress.values)
        values = (*progress.values, *progress.pair.evidence(first, first + LAGS_AT_ONCE))
        return replace(progress, values=values, ended=len(values) == progress.pair.lags)
    one, other = progress.found
    for k, (outlines, found) in enumerate(zip(progress.outlines, progress.found, strict=True)):
        first = OUTLINES_AT_ONCE * len(found)
        if first < len(outlines):
            more = (*found, tangents(outlines[first : first + OUTLINES_AT_ONCE], progress.baseline))
            return replace(progress, found=(more, other) if k == 0 else (one, more))
    pair = pair_of(progress.cameras, [_joined(parts) for parts in progress.found], progress.max_lag_s)
    return replace(progress, pair=pair, ended=pair is None)


def compared(progress: PairProgress) -> ComparedPair | None:
    """The pair whose comparison has ended; None where the two cannot be compared."""
    if progress.pair is None:
        return None
    return ComparedPair(progress.pair, Curve(STEP_S * COARSE_STEPS, np.array(progress.values)))


def _joined(parts: Sequence[Tangents]) -> Tangents:
    return Tangents(
        np.concatenate([one.times for one in parts]),
        np.concatenate([one.angles for one in parts]),
        np.concatenate([one.rays for one in parts]),
        np.concatenate([one.sines for one in parts]),
    )


PairNames = tuple[str, str]


@dataclass(frozen=True)
class PairsProgress:
    """What is done of the comparison of pairs of cameras.

    cameras: by name, in the order of the rig.  left: pairs to compare; the first is the one of `progress`.
    outlines: by camera, in the order of time.  fewest: outlines of a camera that is compared.
    compared: pairs that were.  coarse: lags of pairs that are to be refined, None before all pairs were compared.
    silhouettes: since the last part.
    """

    cameras: Mapping[str, Camera]
    left: tuple[PairNames, ...]
    outlines: Mapping[str, tuple[Outline, ...]]
    limits: Limits
    fewest: int
    progress: PairProgress | None = None
    compared: Mapping[PairNames, ComparedPair] = field(default_factory=dict)
    coarse: Mapping[PairNames, float] | None = None
    silhouettes: int = 0

    @property
    def ended(self) -> bool:
        """Whether no part is left."""
        return self.coarse is not None and not self.coarse

    @property
    def names(self) -> list[str]:
        """Cameras that were compared, in the order of the rig."""
        return [name for name in self.cameras if any(name in pair for pair in self.compared)]

    def after_silhouette(self) -> "PairsProgress":
        """The comparison after one more silhouette: one part for as many silhouettes as there are views."""
        count = self.silhouettes + 1
        if count < len(self.outlines):
            return replace(self, silhouettes=count)
        return replace(self, silhouettes=0).next_part()

    def next_part(self) -> "PairsProgress":
        """Do one part of bounded length, if any is left."""
        if self.left:
            return self._next_of_pair(self.left)
        if self.coarse is None:
            names = self.names
            return replace(self, coarse=coarse_lags(names, self.compared, self.limits) if names else {})
        if not self.coarse:
            return self
        (pair, lag_s), *rest = self.coarse.items()
        one = self.compared[pair].refined_further(lag_s)
        return replace(self, coarse=dict(rest) if one.is_refined else self.coarse, compared={**self.compared, pair: one})

    def _next_of_pair(self, left: tuple[PairNames, ...]) -> "PairsProgress":
        (a, b), *rest = left
        progress = self.progress
        if progress is None:
            outlines = self.outlines.get(a, ()), self.outlines.get(b, ())
            if min(map(len, outlines)) < self.fewest:
                return replace(self, left=tuple(rest))
            progress = PairProgress((self.cameras[a], self.cameras[b]), outlines, reach_s(self.limits.max_lag_s))
        progress = advance(progress)
        if not progress.ended:
            return replace(self, progress=progress)
        result = compared(progress)
        more = {} if result is None else {(a, b): result}
        return replace(self, left=tuple(rest), progress=None, compared={**self.compared, **more})
