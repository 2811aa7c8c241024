"""Compiled part of `segmentation`: extends every window that ends with the latest row by one row."""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.jit import kernel, leaf_kernel
from zenocap.services.recognizer.parameters import FILLER_STAY, WINDOW_PRICE

TINY = 1e-300  # smallest probability whose logarithm is taken


class WindowModel(NamedTuple):
    """Arrays of a model.  n postures, s states, k symbols.

    start: (n, s).  transition: (n, s, s), see `SegmentationSetup`.  emission: (n, s, k).  staying: (n, s).
    occurring: (k,).  thresholds: (n,) least scores.  reach: (n,) least extent.  shortest, longest: (n,) rows of a window.
    """

    start: Floats
    transition: Floats
    emission: Floats
    staying: Floats
    occurring: Floats
    thresholds: Floats
    reach: Floats
    shortest: Ints
    longest: Ints


class Windows(NamedTuple):
    """Hypotheses by age, see `segmentation.Hypotheses`.

    By the age of a window's first row, 0 for the latest row: forward, filler (w, n, s); extra (w,); likelihoods (w, n);
    fillers (w,); extent (w,).  By the age of a moment between rows, 0 after the latest row: gain, label, begin (w + 1,).
    """

    forward: Floats
    filler: Floats
    extra: Floats
    likelihoods: Floats
    fillers: Floats
    extent: Floats
    gain: Floats
    label: Ints
    begin: Ints


@kernel
def extend_windows(model: WindowModel, windows: Windows, symbol: int, row: int, floor: int) -> tuple[float, int]:
    """Update `windows`, whose arrays are already one row older, with row number `row` and its symbol.

    floor: first row that is not answered.  Returns gain and begin of the best path whose last window has not ended.
    """
    n, s = model.start.shape
    ahead = np.empty(s)
    best, best_label, best_begin = windows.gain[1], -1, row
    open_gain, open_begin = -np.inf, row
    for age in range(min(row - floor, len(windows.fillers) - 1) + 1):
        _extend_filler(model, windows, symbol, age)
        for k in range(n):
            if age >= model.longest[k]:
                continue
            _extend_posture(model, windows, symbol, age, k, ahead)
            above_filler = windows.likelihoods[age, k] - windows.fillers[age] - (age + 1) * model.thresholds[k]
            gain = above_filler - WINDOW_PRICE + windows.gain[age + 1]
            if gain > open_gain:
                open_gain, open_begin = gain, row - age
            if age + 1 >= model.shortest[k] and windows.extent[age] >= model.reach[k]:
                gain += np.log(max(windows.forward[age, k, s - 1], TINY))
                if gain > best:
                    best, best_label, best_begin = gain, k, row - age
    windows.gain[0], windows.label[0], windows.begin[0] = best, best_label, best_begin
    return open_gain, open_begin


@leaf_kernel
def _extend_filler(model: WindowModel, windows: Windows, symbol: int, age: int) -> None:
    """Advance the filler of the window of this age by one symbol."""
    n, s = model.start.shape
    filler, extra, fillers = windows.filler, windows.extra, windows.fillers
    staying, emission = model.staying, model.emission
    count = n * s + 1  # states of the filler
    share = 1.0 / (count - 1)
    leaving = extra[age] * (1.0 - FILLER_STAY) * share
    if age == 0:
        extra[0], fillers[0] = 1.0 / count, 0.0
    else:
        for k in range(n):
            for j in range(s):
                leaving += filler[age, k, j] * (1.0 - staying[k, j]) * share
        extra[age] = extra[age] * (FILLER_STAY - (1.0 - FILLER_STAY) * share) + leaving
    extra[age] *= model.occurring[symbol]
    scale = extra[age]
    for k in range(n):
        for j in range(s):
            reached = 1.0 / count
            if age > 0:
                reached = filler[age, k, j] * (staying[k, j] - (1.0 - staying[k, j]) * share) + leaving
            filler[age, k, j] = reached * emission[k, j, symbol]
            scale += filler[age, k, j]
    scale = max(scale, TINY)
    fillers[age] += np.log(scale)
    extra[age] /= scale
    for k in range(n):
        for j in range(s):
            filler[age, k, j] /= scale


@leaf_kernel
def _extend_posture(model: WindowModel, windows: Windows, symbol: int, age: int, k: int, ahead: Floats) -> None:
    """Advance posture k of the window of this age by one symbol.  ahead: (s,) scratch."""
    s = model.start.shape[1]
    scale = 0.0
    for j in range(s):
        reached = model.start[k, j]
        if age > 0:
            reached = 0.0
            for i in range(s):
                reached += windows.forward[age, k, i] * model.transition[k, i, j]
        ahead[j] = reached * model.emission[k, j, symbol]
        scale += ahead[j]
    scale = max(scale, TINY)
    windows.likelihoods[age, k] = (windows.likelihoods[age, k] if age > 0 else 0.0) + np.log(scale)
    for j in range(s):
        windows.forward[age, k, j] = ahead[j] / scale
