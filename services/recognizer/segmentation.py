"""Segmentation of a stream of symbols into postures.

The gain of a window is its number of frames times the excess of its posture's score over the learnt threshold
(`Classification.scores`), so that only windows that would be accepted have a positive gain.  The segmentation is the
sequence of windows, one after another, with the largest sum.  A window must end in its model's last state.

For every row that a posture may begin with there is one hypothesis per posture, extended by the forward algorithm.  Every
row costs the same, and every window's likelihood is exact.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.parameters import LONGEST_WINDOW, SHORTEST_WINDOW, SMOOTHING_ROWS, STRICTNESS, WINDOW_REACH
from zenocap.services.recognizer.viterbi_windows import WindowModel, Windows, extend_windows

# Paper (added): 5.2 classifies sequences that are cut; here postures are found in a stream.
Scalar = TypeVar("Scalar", np.float64, np.int64)


@dataclass(frozen=True, eq=False)
class SegmentationSetup:
    """A model prepared for segmentation.

    arrays.transition: the probability of staying in a last state is at most that of other states; otherwise standing still
    after a posture would increase the gain of its window.
    """

    model: PostureModel
    arrays: WindowModel

    @property
    def window(self) -> int:
        """Largest number of rows of a window."""
        return int(self.arrays.longest.max())


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All windows that end with the latest row.

    rows: number of rows so far.  floor: rows before it are answered.  windows: by age.  `forward` and `filler` are
    probabilities of states, `extra` of the filler's extra state, `likelihoods` and `fillers` logarithms, `extent` the
    largest distance from the window's first vector `origin` (w, d).  `gain` is that of the best windows up to a moment,
    `label` the posture of the window that ends there or -1, `begin` the moment before that window, or one row earlier.
    open_gain, open_begin: of the best path whose last window has not ended.  recent: the latest rows (r, d), whitened.
    """

    rows: int
    floor: int
    windows: Windows
    origin: Floats
    open_gain: float
    open_begin: int
    recent: tuple[Floats, ...] = ()


@dataclass(frozen=True)
class Window:
    """Detected posture: rows begin to end - 1 of the stream."""

    label: int
    begin: int
    end: int


def segmentation_setup(model: PostureModel, strictness: float = STRICTNESS) -> SegmentationSetup:
    """Prepare a model.  strictness: see `parameters.STRICTNESS`."""
    shortest = np.maximum(2, np.ceil(SHORTEST_WINDOW * model.durations[:, 0] * model.rate)).astype(np.int64)
    longest = np.maximum(shortest + 1, np.floor(LONGEST_WINDOW * model.durations[:, -1] * model.rate).astype(np.int64))
    thresholds = np.maximum(model.thresholds, strictness * expected_gain(model))
    transition = model.transition.copy()
    last = model.states - 1
    transition[:, last, last] = np.minimum(transition[:, last, last], model.staying[:, last])
    arrays = WindowModel(
        model.start, transition, model.emission, model.staying, model.occurring, thresholds, WINDOW_REACH * model.reach,
        shortest, longest,
    )  # fmt: skip
    return SegmentationSetup(model, arrays)


def expected_gain(model: PostureModel) -> Floats:
    """(n,) largest gain per frame of a posture over the filler that is due to the order of its states.

    The filler goes from each of its n s states to each other; a posture of median length makes s - 1 transitions.
    """
    steps = (model.states - 1) * np.log(len(model.labels) * model.states + 1)
    return np.asarray(steps / (model.durations[:, 1] * model.rate))


def initial_hypotheses(setup: SegmentationSetup) -> Hypotheses:
    """Hypotheses before the first row."""
    w, (n, s), d = setup.window, setup.model.start.shape, len(setup.model.mean)
    windows = Windows(
        np.zeros((w, n, s)), np.zeros((w, n, s)), np.zeros(w), np.zeros((w, n)), np.zeros(w), np.zeros(w), np.zeros(w + 1),
        np.full(w + 1, -1, np.int64), np.zeros(w + 1, np.int64),
    )  # fmt: skip
    return Hypotheses(0, 0, windows, np.zeros((w, d)), -np.inf, 0)


def advance(setup: SegmentationSetup, before: Hypotheses, symbol: int, whitened: Floats) -> Hypotheses:
    """Add a row: its symbol and its whitened vector (d,)."""
    recent = (*before.recent, whitened)[-SMOOTHING_ROWS:]
    origin = _aged(before.origin)
    origin[0] = np.mean(recent, axis=0)
    old = before.windows
    extent = np.maximum(_aged(old.extent), np.linalg.norm(origin - origin[0], axis=1))
    windows = Windows(
        _aged(old.forward), _aged(old.filler), _aged(old.extra), _aged(old.likelihoods), _aged(old.fillers), extent,
        _aged(old.gain), _aged(old.label), _aged(old.begin),
    )  # fmt: skip
    open_gain, open_begin = extend_windows(setup.arrays, windows, symbol, before.rows, before.floor)
    return Hypotheses(before.rows + 1, before.floor, windows, origin, open_gain, open_begin, recent)


def pop_window(hypotheses: Hypotheses, delay: int) -> tuple[Hypotheses, Window | None]:
    """Remove the first window of the best path if it ended `delay` rows ago or earlier; fixes the path up to its end.

    delay: 0 at the end of a stream, where windows that have not ended do not count.
    """
    first = _first_end(hypotheses, delay > 0)
    if first < 0 or first > hypotheses.rows - delay:
        return hypotheses, None
    age = hypotheses.rows - first
    label, begin = int(hypotheses.windows.label[age]), int(hypotheses.windows.begin[age])
    return _fix_path(hypotheses, first), Window(label, begin, first)


def first_open_row(hypotheses: Hypotheses) -> int:
    """First row of the first window of the best path that is not removed yet; `rows` without such a window."""
    first = _first_end(hypotheses, True)
    if first >= 0:
        return int(hypotheses.windows.begin[hypotheses.rows - first])
    return hypotheses.open_begin if hypotheses.open_gain > hypotheses.windows.gain[0] else hypotheses.rows


def _first_end(hypotheses: Hypotheses, unfinished: bool) -> int:
    """End of the first window of the best path, -1 without one.  unfinished: the last window need not have ended."""
    now, windows = hypotheses.rows, hypotheses.windows
    moment = hypotheses.open_begin if unfinished and hypotheses.open_gain > windows.gain[0] else now
    oldest = max(hypotheses.floor, now - len(windows.gain) + 1)
    first = -1
    while moment > oldest:
        if windows.label[now - moment] >= 0:
            first = moment
        moment = int(windows.begin[now - moment])
    return first


def _fix_path(hypotheses: Hypotheses, first: int) -> Hypotheses:
    """Make the moment `first` part of every path: paths that do not go through it are removed."""
    now, windows = hypotheses.rows, hypotheses.windows
    gain, label, begin = windows.gain.copy(), windows.label.copy(), windows.begin.copy()
    base = gain[now - first]
    for moment in range(first, now + 1):
        age = now - moment
        through = moment
        while through > first:
            through = int(begin[now - through])
        if moment == first or through != first:
            gain[age], label[age], begin[age] = base, -1, max(first, moment - 1)
    gain -= base
    return replace(hypotheses, floor=first, windows=windows._replace(gain=gain, label=label, begin=begin))


def _aged(values: NDArray[Scalar]) -> NDArray[Scalar]:
    """Copy with every row one older; row 0 is 0."""
    older = np.empty_like(values)
    older[1:] = values[:-1]
    older[0] = 0
    return older
