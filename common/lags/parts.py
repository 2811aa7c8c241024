"""Comparison of a pair of cameras in parts of bounded length, with the result of the whole."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import Curve, Lag
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
        np.concatenate([one.sines for one in parts]),
    )
