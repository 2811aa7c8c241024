"""The forward algorithm, compiled: of one model for each posture, and of the filler made of all of them."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Floats

ANYTHING_STAYS = 0.9


@njit(cache=True, error_model="numpy")
def forward_log_likelihoods(start: Floats, transition: Floats, emission: Floats, symbols: NDArray[np.int64]) -> Floats:
    """(n,) log P(O | λ_i): start (n, s), transition (n, s, s), emission (n, s, k), symbols (T,); -inf of the impossible.

    α_t(j) = Σ_i α_t-1(i) a_ij b_j(o_t), brought to the sum one at every step; the logarithms of the sums add up.
    """
    n, s = start.shape
    result = np.zeros(n)
    ahead, alpha = np.empty(s), np.empty(s)
    for model in range(n):
        total = 0.0
        for t in range(len(symbols)):
            symbol, scale = symbols[t], 0.0
            for j in range(s):
                reached = 0.0
                if t == 0:
                    reached = start[model, j]
                else:
                    for i in range(s):
                        reached += alpha[i] * transition[model, i, j]
                ahead[j] = reached * emission[model, j, symbol]
                scale += ahead[j]
            if scale <= 0.0:
                total = -np.inf
                break
            total += np.log(scale)
            for j in range(s):
                alpha[j] = ahead[j] / scale
        result[model] = total
    return result


@njit(cache=True, error_model="numpy")
def filler_log_likelihood(
    staying: Floats, emission: Floats, anything: Floats, symbols: NDArray[np.int64], without: int
) -> float:
    """log P(O | filler): staying (n, s), emission (n, s, k), symbols (T,); without: a posture left out, -1 for none.

    anything: (k,) emission of one more state, which stays with ANYTHING_STAYS.  From each of the N states one stays with
    its probability, and goes to each of the others with an equal share of the rest; all begin alike.  So a step costs N
    and not N squared.
    """
    n, s = staying.shape
    count = s * (n - 1 if 0 <= without < n else n) + 1
    alpha, other, total = np.full((n, s), 1.0 / count), 1.0 / count, 0.0
    share = 1.0 / max(count - 1, 1)
    for t in range(len(symbols)):
        symbol, scale, leaving = symbols[t], 0.0, 0.0
        if t > 0:
            leaving = other * (1.0 - ANYTHING_STAYS) * share
            for model in range(n):
                for j in range(s):
                    if model != without:
                        leaving += alpha[model, j] * (1.0 - staying[model, j]) * share
        if t > 0:
            other = other * ANYTHING_STAYS + leaving - other * (1.0 - ANYTHING_STAYS) * share
        other *= anything[symbol]
        scale += other
        for model in range(n):
            for j in range(s):
                if model == without:
                    continue
                reached = alpha[model, j]
                if t > 0:
                    left = reached * (1.0 - staying[model, j]) * share
                    reached = reached * staying[model, j] + leaving - left
                alpha[model, j] = reached * emission[model, j, symbol]
                scale += alpha[model, j]
        if scale <= 0.0:
            return -np.inf
        total += np.log(scale)
        other /= scale
        for model in range(n):
            for j in range(s):
                alpha[model, j] /= scale
    return total
