"""Forward and backward passes of a hidden Markov model, scaled.  [Hybrid Eq. 1-7, 15-16]"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.jit import kernel


@dataclass(frozen=True)
class Expectation:
    """Result of a forward-backward pass.

    log_likelihood: log p(x_1:T | lambda).  gamma: (T, M) p(s_t = q_i | x_1:T).
    xi: (M, M) the sum over t of p(s_t = q_i, s_t+1 = q_j | x_1:T).
    """

    log_likelihood: float
    gamma: Floats
    xi: Floats


def expectation(transitions: Floats, log_densities: Floats) -> Expectation:
    """Forward-backward pass of one sequence, with a uniform initial state as in the paper.

    transitions: (M, M) a_ij.  log_densities: (T, M) log b_j(x_t).  Raises ValueError where no path is possible.

    Scaled: alpha_t sums to 1, and b_j(x_t) is relative to the greatest at t, which cancels in gamma and xi.
    """
    highest = log_densities.max(axis=1)
    densities = np.exp(log_densities - highest[:, None])
    alpha, scales = _forward(transitions, densities)
    if not np.all(scales > 0):
        raise ValueError(f"frame {int(np.argmin(scales > 0))}: no state sequence leads to it: allowed: transitions above 0")
    beta, xi = _backward(transitions, densities, alpha, scales)
    return Expectation(float(np.log(scales).sum() + highest.sum()), alpha * beta, xi)


@kernel
def _forward(transitions: Floats, densities: Floats) -> tuple[Floats, Floats]:
    """alpha (T, M) with rows that sum to 1, and their scale factors (T,).  [Hybrid Eq. 2, 3]"""
    frames, states = densities.shape
    alpha, scales = np.zeros((frames, states)), np.zeros(frames)
    for t in range(frames):
        if t == 0:
            alpha[t, :] = 1.0 / states
        else:
            for i in range(states):
                if alpha[t - 1, i] > 0.0:
                    for j in range(states):
                        alpha[t, j] += alpha[t - 1, i] * transitions[i, j]
        for j in range(states):
            alpha[t, j] *= densities[t, j]
            scales[t] += alpha[t, j]
        for j in range(states):
            alpha[t, j] /= scales[t]
    return alpha, scales


@kernel
def _backward(transitions: Floats, densities: Floats, alpha: Floats, scales: Floats) -> tuple[Floats, Floats]:
    """beta (T, M) in the scale of alpha, and the sum of xi (M, M).  [Hybrid Eq. 5, 6, 16]"""
    frames, states = densities.shape
    beta, xi = np.ones((frames, states)), np.zeros((states, states))
    ahead = np.empty(states)
    for t in range(frames - 2, -1, -1):
        for j in range(states):
            ahead[j] = densities[t + 1, j] * beta[t + 1, j] / scales[t + 1]
        for i in range(states):
            beta[t, i] = 0.0
            for j in range(states):
                share = transitions[i, j] * ahead[j]
                beta[t, i] += share
                xi[i, j] += alpha[t, i] * share
    return beta, xi
