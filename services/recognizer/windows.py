"""Every window that ends with the newest row, one row longer: the compiled part of `spotting`."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.recognizer.likelihood import ANYTHING_STAYS

Integers = NDArray[np.int64]
TINY = 1e-300


@njit(cache=True, error_model="numpy")
def carry(
    start: Floats,
    transition: Floats,
    emission: Floats,
    staying: Floats,
    occurring: Floats,
    thresholds: Floats,
    reach: Floats,
    least: Integers,
    most: Integers,
    price: float,
    symbol: int,
    row: int,
    floor: int,
    forward: Floats,
    filler: Floats,
    anything: Floats,
    likelihoods: Floats,
    fillers: Floats,
    extent: Floats,
    worth: Floats,
    label: Integers,
    begin: Integers,
) -> tuple[float, int]:
    """Writes what the row with number `row` changes; returns worth and begin of the best path that has not ended.

    Arrays as in `spotting.Hypotheses`, each already one row older, and of the model; likelihoods and fillers as in
    `likelihood`, window by window.  price: of a window.
    """
    n, s = start.shape
    count = n * s + 1  # states of the filler
    share = 1.0 / (count - 1)
    ahead = np.empty(s)
    best, best_label, best_begin = worth[1], -1, row
    open_worth, open_begin = -np.inf, row
    for age in range(min(row - floor, len(fillers) - 1) + 1):
        leaving, scale = anything[age] * (1.0 - ANYTHING_STAYS) * share, 0.0
        if age == 0:
            anything[0], fillers[0] = 1.0 / count, 0.0
            likelihoods[0] = 0.0
        else:
            for k in range(n):
                for j in range(s):
                    leaving += filler[age, k, j] * (1.0 - staying[k, j]) * share
            anything[age] = anything[age] * (ANYTHING_STAYS - (1.0 - ANYTHING_STAYS) * share) + leaving
        anything[age] *= occurring[symbol]
        scale = anything[age]
        for k in range(n):
            for j in range(s):
                reached = 1.0 / count
                if age > 0:
                    reached = filler[age, k, j] * (staying[k, j] - (1.0 - staying[k, j]) * share) + leaving
                filler[age, k, j] = reached * emission[k, j, symbol]
                scale += filler[age, k, j]
        scale = max(scale, TINY)
        fillers[age] += np.log(scale)
        anything[age] /= scale
        for k in range(n):
            for j in range(s):
                filler[age, k, j] /= scale
        for k in range(n):
            if age >= most[k]:
                continue
            scale = 0.0
            for j in range(s):
                reached = start[k, j]
                if age > 0:
                    reached = 0.0
                    for i in range(s):
                        reached += forward[age, k, i] * transition[k, i, j]
                ahead[j] = reached * emission[k, j, symbol]
                scale += ahead[j]
            scale = max(scale, TINY)
            likelihoods[age, k] += np.log(scale)
            for j in range(s):
                forward[age, k, j] = ahead[j] / scale
            gain = likelihoods[age, k] - fillers[age] - (age + 1) * thresholds[k] - price + worth[age + 1]
            if gain > open_worth:
                open_worth, open_begin = gain, row - age
            if age + 1 >= least[k] and extent[age] >= reach[k]:
                gain += np.log(max(forward[age, k, s - 1], TINY))
                if gain > best:
                    best, best_label, best_begin = gain, k, row - age
    worth[0], label[0], begin[0] = best, best_label, best_begin
    return open_worth, open_begin
