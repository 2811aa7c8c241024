"""Stretches of a stream in which somebody moves, whatever it is: so that what no posture explains is told too.

Between two moments a third of a second apart a body that moves comes farther than one that stands, whose vectors only
tremble; how far trembling goes, and how far the smallest posture, was learnt in training.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from common.body.anatomy import Floats
from services.recognizer.model import PostureModel

SMOOTHED = 3  # rows of a running mean
APART_S, STILL_S = 0.33, 0.4  # moments that are compared; how long nothing moves before a movement is over
OF_REACH, OF_SHORTEST = 0.25, 0.6  # of the smallest reach: what is a move; of the shortest example: what is a movement
ENOUGH = 0.8  # of the smallest reach: how far a movement comes from where it began
SHARE = 0.4  # of a movement that windows must cover to explain it


@dataclass(frozen=True)
class Stretch:
    """Rows begin to end - 1 of a stream."""

    begin: int
    end: int

    def covered(self, others: Sequence["Stretch"]) -> float:
        """The share of its rows that lie in `others`, which do not overlap."""
        return sum(max(0, min(self.end, o.end) - max(self.begin, o.begin)) for o in others) / (self.end - self.begin)


@dataclass(frozen=True, eq=False)
class Moving:
    """recent: the newest rows (r, d), whitened.  begin: the first row of a movement, -1 for none; `last` its last so far.

    origin: (d,) where it began.  extent: how far from there it came.
    """

    recent: tuple[Floats, ...] = ()
    begin: int = -1
    last: int = -1
    origin: Floats | None = None
    extent: float = 0.0


def moved(model: PostureModel, moving: Moving, row: Floats, number: int, longest: int) -> tuple[Moving, Stretch | None]:
    """With one more row (d,), whitened, and its number; a movement that is over, or has gone on for `longest` rows."""
    apart = max(1, round(APART_S * model.rate))
    recent = (*moving.recent, row)[-(apart + SMOOTHED) :]
    moving = replace(moving, recent=recent)
    if len(recent) < apart + SMOOTHED:
        return moving, None
    now, before = np.mean(recent[-SMOOTHED:], axis=0), np.mean(recent[:SMOOTHED], axis=0)
    moves = np.linalg.norm(now - before) > max(model.slow / model.rate, OF_REACH * float(model.reach.min()))
    if moving.begin < 0:
        if moves:
            moving = replace(moving, begin=number - apart, last=number, origin=before, extent=0.0)
        return moving, None
    assert moving.origin is not None
    moving = replace(moving, extent=max(moving.extent, float(np.linalg.norm(now - moving.origin))))
    if moves:
        moving = replace(moving, last=number)
    if number - moving.last < STILL_S * model.rate and number + 1 - moving.begin < longest:
        return moving, None
    over = Stretch(moving.begin, moving.last + 1)
    enough = over.end - over.begin >= OF_SHORTEST * float(model.durations[:, 0].min()) * model.rate
    enough = enough and moving.extent >= ENOUGH * float(model.reach.min())
    return Moving(recent), over if enough else None
