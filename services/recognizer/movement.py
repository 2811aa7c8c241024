"""Detection of any movement in a stream, so that movements without a posture are reported too.

The smoothed feature vectors of two moments COMPARED_S apart are compared: the distance of a moving body exceeds that of
noise.  The noise and the smallest reach of a posture are learnt in training.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.recognizer import parameters as p
from zenocap.services.recognizer.model import PostureModel


@dataclass(frozen=True)
class RowRange:
    """Rows begin to end - 1 of a stream."""

    begin: int
    end: int

    def overlap(self, others: Sequence["RowRange"]) -> float:
        """Share of its rows that lie in `others`, which do not overlap each other."""
        return sum(max(0, min(self.end, o.end) - max(self.begin, o.begin)) for o in others) / (self.end - self.begin)


@dataclass(frozen=True, eq=False)
class MovementState:
    """State of the detection after a row.

    recent: the latest rows (r, d), whitened.  begin: first row of the current movement, -1 without one; `last` is its last
    row with motion.  origin: (d,) smoothed vector at its start.  extent: largest distance from there.
    """

    recent: tuple[Floats, ...] = ()
    begin: int = -1
    last: int = -1
    origin: Floats | None = None
    extent: float = 0.0


def detect_movement(
    model: PostureModel, state: MovementState, row: Floats, number: int, longest: int
) -> tuple[MovementState, RowRange | None]:
    """Add row `number` (d,), whitened; also return a movement that has ended with it or lasted for `longest` rows."""
    apart = max(1, round(p.COMPARED_S * model.rate))
    recent = (*state.recent, row)[-(apart + p.SMOOTHING_ROWS) :]
    state = replace(state, recent=recent)
    if len(recent) < apart + p.SMOOTHING_ROWS:
        return state, None
    now, before = np.mean(recent[-p.SMOOTHING_ROWS :], axis=0), np.mean(recent[: p.SMOOTHING_ROWS], axis=0)
    moves = np.linalg.norm(now - before) > max(model.slow / model.rate, p.MOVING_REACH * float(model.reach.min()))
    if state.begin < 0:
        if moves:
            state = replace(state, begin=number - apart, last=number, origin=before, extent=0.0)
        return state, None
    assert state.origin is not None
    state = replace(state, extent=max(state.extent, float(np.linalg.norm(now - state.origin))))
    if moves:
        state = replace(state, last=number)
    if number - state.last < p.STILL_S * model.rate and number + 1 - state.begin < longest:
        return state, None
    movement = RowRange(state.begin, state.last + 1)
    large = movement.end - movement.begin >= p.SHORTEST_MOVEMENT * float(model.durations[:, 0].min()) * model.rate
    large = large and state.extent >= p.MOVEMENT_REACH * float(model.reach.min())
    return MovementState(recent), movement if large else None
