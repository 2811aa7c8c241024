"""Compiled forward algorithm of the posture models and their filler.  [Two-view 5.2]"""

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.jit import kernel, leaf_kernel
from zenocap.services.recognizer.parameters import FILLER_STAY


@kernel
def forward_log_likelihoods(start: Floats, transition: Floats, emission: Floats, symbols: Ints) -> Floats:
    """(n,) log P(O | λ_i), -inf where it is impossible.

    start: (n, s).  transition: (n, s, s).  emission: (n, s, k).  symbols: (T,).
    α_t(j) = Σ_i α_t-1(i) a_ij b_j(o_t), normalized at every step; the logarithms of the sums are added.
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


@leaf_kernel
def _leaving(total: float, alpha: Floats, staying: Floats, share: float, without: int) -> float:
    """`total` and what leaves each state of the postures for one other state."""
    for model in range(staying.shape[0]):
        for j in range(staying.shape[1]):
            if model != without:
                total += alpha[model, j] * (1.0 - staying[model, j]) * share
    return total


@kernel
def filler_log_likelihood(staying: Floats, emission: Floats, occurring: Floats, symbols: Ints, without: int) -> float:
    """log P(O | filler).

    staying: (n, s).  emission: (n, s, k).  occurring: (k,) emission of the extra state, whose probability of staying is
    FILLER_STAY.  symbols: (T,).  without: index of a posture that is left out, -1 for none.
    Every state is left for each of the others with an equal share of the rest, and all are equally likely at the start,
    so a frame costs N operations for N states, not N squared.
    """
    n, s = staying.shape
    count = s * (n - 1 if 0 <= without < n else n) + 1
    alpha, other, total = np.full((n, s), 1.0 / count), 1.0 / count, 0.0
    share = 1.0 / max(count - 1, 1)
    for t in range(len(symbols)):
        symbol, scale, leaving = symbols[t], 0.0, 0.0
        if t > 0:
            leaving = _leaving(other * (1.0 - FILLER_STAY) * share, alpha, staying, share, without)
            other = other * FILLER_STAY + leaving - other * (1.0 - FILLER_STAY) * share
        other *= occurring[symbol]
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
