"""Comparison of all pairs of cameras in parts, so that no step of the integrator is long.  Pure.

A part follows every so many silhouettes, and each tick: parts are a function of the events, so that a take is recomputed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.delays import limits_of
from zenocap.common.lags.pairs import coarse_lags, reach_s
from zenocap.common.lags.parts import ComparedPair, PairProgress, advance, compared
from zenocap.common.lags.tangents import Outline
from zenocap.services.integrator.parameters import FEWEST_OUTLINES, MOST_DELAY_S

PairNames = tuple[str, str]


@dataclass(frozen=True)
class Comparison:
    """left: pairs to compare; the first is the one of `progress`.  outlines: by viewer, in the order of time.

    compared: those that were.  coarse: lags of pairs that are to be refined, None before all pairs were compared.
    silhouettes: since the last part.
    """

    left: tuple[PairNames, ...]
    outlines: Mapping[str, tuple[Outline, ...]]
    progress: PairProgress | None = None
    compared: Mapping[PairNames, ComparedPair] = field(default_factory=dict)
    coarse: Mapping[PairNames, float] | None = None
    silhouettes: int = 0

    @property
    def ended(self) -> bool:
        """Whether no part is left."""
        return self.coarse is not None and not self.coarse

    def names(self, cameras: Mapping[str, Camera]) -> list[str]:
        """Cameras that were compared, in the order of the rig."""
        return [name for name in cameras if any(name in pair for pair in self.compared)]


def after_silhouette(cameras: Mapping[str, Camera], state: Comparison) -> Comparison:
    """The comparison after one more silhouette: one part for as many silhouettes as there are views."""
    count = state.silhouettes + 1
    if count < len(state.outlines):
        return replace(state, silhouettes=count)
    return next_part(cameras, replace(state, silhouettes=0))


def next_part(cameras: Mapping[str, Camera], state: Comparison) -> Comparison:
    """Do one part of bounded length, if any is left."""
    if state.left:
        return _next_of_pair(cameras, state, state.left)
    if state.coarse is None:
        names = state.names(cameras)
        return replace(state, coarse=coarse_lags(names, state.compared, limits_of(MOST_DELAY_S)) if names else {})
    if not state.coarse:
        return state
    (pair, lag_s), *rest = state.coarse.items()
    one = state.compared[pair].refined_further(lag_s)
    return replace(state, coarse=dict(rest) if one.is_refined else state.coarse, compared={**state.compared, pair: one})


def _next_of_pair(cameras: Mapping[str, Camera], state: Comparison, left: tuple[PairNames, ...]) -> Comparison:
    (a, b), *rest = left
    progress = state.progress
    if progress is None:
        outlines = state.outlines.get(a, ()), state.outlines.get(b, ())
        if min(map(len, outlines)) < FEWEST_OUTLINES:
            return replace(state, left=tuple(rest))
        progress = PairProgress((cameras[a], cameras[b]), outlines, reach_s(MOST_DELAY_S))
    progress = advance(progress)
    if not progress.ended:
        return replace(state, progress=progress)
    result = compared(progress)
    more = {} if result is None else {(a, b): result}
    return replace(state, left=tuple(rest), progress=None, compared={**state.compared, **more})
