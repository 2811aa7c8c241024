"""Where postures begin and end in a stream of symbols, and which they are: all windows that end now, weighed at once.

A window is worth its frames times how far its posture's score lies above the threshold that was learnt (`model.scores_of`),
so that only what would be known at all is worth anything, and what is nothing in particular is worth 0.  The postures of
a stream are the windows, one behind the other, that are worth most together.  A window must end in its model's last state.

For every row that a posture may have begun with there is one hypothesis a posture, carried on by the forward algorithm; so
a row costs the same whether much or little happens, and every window's likelihood is the exact one.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.recognizer.model import PostureModel
from services.recognizer.windows import Integers, carry

Scalar = TypeVar("Scalar", np.float64, np.int64)
# Chosen on four synthetic people (seeds 300 to 303; the model is of 200 to 207).  Tracked from video by two-view, ten
# minutes with unknown movements: precision and recall 0.80 and 0.88 at 0.12, 0.92 and 0.85 at 0.18, 0.94 and 0.81 at 0.20.
# With their true angles 1.00 and 0.95 at all of them.
STRICTNESS = 0.18  # least score of a window, whatever its threshold, as a share of `in_order`
PRICE = 0.3  # of a window, so that one that explains as much as two is preferred
SHORTEST, LONGEST = 0.75, 1.6  # of the shortest and the longest example: windows that are looked at
OF_REACH = 0.65  # of a posture's reach: a window's body comes so far from where it began
SMOOTHED = 3  # rows of a running mean, for the reach


@dataclass(frozen=True, eq=False)
class Spotting:
    """A model made ready.  least, most: (n,) rows of a window.  window: the largest of `most`.

    thresholds: (n,) least scores.  reach: (n,) how far the body must come.
    transition: (n, s, s) with last states that are left like others; or a window would gain by standing on after its end.
    """

    model: PostureModel
    transition: Floats
    thresholds: Floats
    reach: Floats
    least: Integers
    most: Integers

    @property
    def window(self) -> int:
        return int(self.most.max())


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All windows that end with the last row.  rows: seen so far.  floor: the rows before it are answered.

    By the age of a window's first row, 0 for the last row: `forward` and `filler` (w, n, s), probabilities of the states,
    and `anything` (w,) of the filler's own; `likelihoods` (w, n) and `fillers` (w,), logarithms; `origin` (w, d), where the
    body was, and `extent` (w,), how far from there it came.
    By the age of a moment between rows, 0 for after the last row, (w + 1,): `worth` of the best windows up to it, `label`
    of the one that ends there or -1, and `begin`, the moment before that one or the one before this.
    open_worth, open_begin: of the best path whose last window has not ended.
    recent: the newest rows (r, d), whitened.
    """

    rows: int
    floor: int
    forward: Floats
    filler: Floats
    anything: Floats
    likelihoods: Floats
    fillers: Floats
    origin: Floats
    extent: Floats
    worth: Floats
    label: Integers
    begin: Integers
    open_worth: float
    open_begin: int
    recent: tuple[Floats, ...] = ()


@dataclass(frozen=True)
class Window:
    """A posture that was found: rows begin to end - 1 of the stream."""

    label: int
    begin: int
    end: int


def spotting_of(model: PostureModel, strictness: float = STRICTNESS) -> Spotting:
    """strictness: see STRICTNESS."""
    least = np.maximum(2, np.ceil(SHORTEST * model.durations[:, 0] * model.rate)).astype(np.int64)
    most = np.maximum(least + 1, np.floor(LONGEST * model.durations[:, -1] * model.rate).astype(np.int64))
    thresholds = np.maximum(model.thresholds, strictness * in_order(model))
    transition = model.transition.copy()
    last = model.states - 1
    transition[:, last, last] = np.minimum(transition[:, last, last], model.staying[:, last])
    return Spotting(model, transition, thresholds, OF_REACH * model.reach, least, most)


def in_order(model: PostureModel) -> Floats:
    """(n,) what a window of every posture gains a frame over the filler, at about the most, by having its states in order.

    The filler goes from each of its n s states to each; a posture of median length goes s - 1 times to the next.
    """
    steps = (model.states - 1) * np.log(len(model.labels) * model.states + 1)
    return np.asarray(steps / (model.durations[:, 1] * model.rate))


def hypotheses_of(spotting: Spotting) -> Hypotheses:
    """Before the first row."""
    w, (n, s), d = spotting.window, spotting.model.start.shape, len(spotting.model.mean)
    return Hypotheses(
        0, 0, np.zeros((w, n, s)), np.zeros((w, n, s)), np.zeros(w), np.zeros((w, n)), np.zeros(w), np.zeros((w, d)),
        np.zeros(w), np.zeros(w + 1), np.full(w + 1, -1, np.int64), np.zeros(w + 1, np.int64), -np.inf, 0,
    )  # fmt: skip


def carried_on(spotting: Spotting, before: Hypotheses, symbol: int, place: Floats) -> Hypotheses:
    """With one more row: its symbol, and itself (d,), whitened."""
    model = spotting.model
    recent = (*before.recent, place)[-SMOOTHED:]
    origin, extent = _aged(before.origin), _aged(before.extent)
    origin[0] = np.mean(recent, axis=0)
    extent = np.maximum(extent, np.linalg.norm(origin - origin[0], axis=1))
    forward, filler, anything = _aged(before.forward), _aged(before.filler), _aged(before.anything)
    likelihoods, fillers = _aged(before.likelihoods), _aged(before.fillers)
    worth, label, begin = _aged(before.worth), _aged(before.label), _aged(before.begin)
    open_worth, open_begin = carry(
        model.start, spotting.transition, model.emission, model.staying, model.occurring, spotting.thresholds,
        spotting.reach, spotting.least, spotting.most, PRICE, symbol, before.rows, before.floor, forward, filler, anything,
        likelihoods, fillers, extent, worth, label, begin,
    )  # fmt: skip
    return Hypotheses(
        before.rows + 1, before.floor, forward, filler, anything, likelihoods, fillers, origin, extent, worth, label, begin,
        open_worth, open_begin, recent,
    )  # fmt: skip


def settled(hypotheses: Hypotheses, lag: int) -> tuple[Hypotheses, Window | None]:
    """The first window of the best path, if it ended `lag` rows ago or more; it and all before it are then answered.

    lag: 0 when nothing more comes, so that windows which have not ended do not count.
    """
    first = _first(hypotheses, lag > 0)
    if first < 0 or first > hypotheses.rows - lag:
        return hypotheses, None
    age = hypotheses.rows - first
    return _answered(hypotheses, first), Window(int(hypotheses.label[age]), int(hypotheses.begin[age]), first)


def pending(hypotheses: Hypotheses) -> int:
    """The row with which the first window of the best path begins that is not settled; `rows` without any."""
    first = _first(hypotheses, True)
    if first >= 0:
        return int(hypotheses.begin[hypotheses.rows - first])
    return hypotheses.open_begin if hypotheses.open_worth > hypotheses.worth[0] else hypotheses.rows


def _first(hypotheses: Hypotheses, unfinished: bool) -> int:
    """The end of the first window of the best path, -1 without any.  unfinished: the last window may go on."""
    now = hypotheses.rows
    place = hypotheses.open_begin if unfinished and hypotheses.open_worth > hypotheses.worth[0] else now
    oldest = max(hypotheses.floor, now - len(hypotheses.worth) + 1)
    first = -1
    while place > oldest:
        if hypotheses.label[now - place] >= 0:
            first = place
        place = int(hypotheses.begin[now - place])
    return first


def _answered(hypotheses: Hypotheses, first: int) -> Hypotheses:
    """Everything before the moment `first` is answered: paths that do not go through it are given up."""
    now = hypotheses.rows
    worth, label, begin = hypotheses.worth.copy(), hypotheses.label.copy(), hypotheses.begin.copy()
    base = worth[now - first]
    for place in range(first, now + 1):
        age = now - place
        through = place
        while through > first:
            through = int(begin[now - through])
        if place == first or through != first:
            worth[age], label[age], begin[age] = base, -1, max(first, place - 1)
    worth -= base
    return replace(hypotheses, floor=first, worth=worth, label=label, begin=begin)


def _aged(values: NDArray[Scalar]) -> NDArray[Scalar]:
    """One older, the youngest still to be written."""
    older = np.empty_like(values)
    older[1:] = values[:-1]
    older[0] = 0
    return older
