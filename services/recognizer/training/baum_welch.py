"""Baum-Welch training of one posture's hidden Markov model (hmmlearn).  [Two-view 5.1]"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from hmmlearn.hmm import CategoricalHMM

from zenocap.common.arrays import Floats, Ints
from zenocap.services.recognizer.training.examples import Topology
from zenocap.services.recognizer.training.parameters import ITERATIONS, PRIOR_COUNT, TOLERANCE


class _Hmm(CategoricalHMM):  # type: ignore[misc]  # hmmlearn has no types
    """HMM that starts from the given probabilities.

    hmmlearn's own initialization warns about fewer frames than probabilities; `smoothed` handles this case.
    """

    def _init(self, X: Ints, lengths: Sequence[int] | None = None) -> None:
        pass


@dataclass(frozen=True)
class Hmm:
    """Hidden Markov model of one posture.

    start: (s,), transition: (s, s), emission: (s, k): probabilities, rows sum to 1.  fit: log P(examples).
    """

    start: Floats
    transition: Floats
    emission: Floats
    fit: float


def train_hmm(examples: Sequence[Ints], symbols: int, states: int, topology: Topology, restarts: int, seed: int) -> Hmm:
    """Train `restarts` models and return the one with the largest likelihood.

    examples: symbols (T_i,) from 0 to symbols - 1.  The first model starts from examples divided into `states` equal parts,
    others from random divisions and emissions.  left-right: transitions to the same and the next state, starting in the
    first.  ergodic: all transitions.  Equal seeds give equal models.
    """
    # Paper (open): 5.1 gives neither topology nor training; here left-right by default, and Baum-Welch.
    lengths = [len(example) for example in examples]
    column = np.concatenate(examples)[:, None]
    best: Hmm | None = None
    for restart in range(restarts):
        rng = np.random.default_rng((seed, restart))
        start, transition = _chain(states, topology, float(np.mean(lengths)))
        hmm = _Hmm(
            states, n_features=symbols, params="te" if topology == "left-right" else "ste", init_params="",
            n_iter=ITERATIONS, tol=TOLERANCE, implementation="scaling", startprob_prior=1.0 + PRIOR_COUNT,
            transmat_prior=1.0 + PRIOR_COUNT * (transition > 0.0), emissionprob_prior=1.0 + PRIOR_COUNT,
        )  # fmt: skip
        hmm.startprob_, hmm.transmat_ = start, transition
        hmm.emissionprob_ = _divided_emissions(examples, symbols, states, None if restart == 0 else rng)
        hmm.fit(column, lengths)
        fit = float(hmm.score(column, lengths))
        if best is None or fit > best.fit:
            best = Hmm(hmm.startprob_, hmm.transmat_, hmm.emissionprob_, fit)
    assert best is not None, "restarts is one or more"
    return best


def smoothed(emission: Floats, spread: Floats, floor: float, occurring: Floats) -> Floats:
    """(..., s, k) emissions smoothed for symbols that the examples do not contain.

    spread: (k, k) weights of neighbouring symbols, rows sum to 1.  floor: share of the symbols' overall frequencies
    `occurring` (k,) in the result.
    """
    mixed: Floats = (1.0 - floor) * (emission @ spread) + floor * occurring
    return np.asarray(mixed / mixed.sum(axis=-1, keepdims=True))


def spread_of(codewords: Floats, width: float) -> Floats:
    """(k, k) weights exp(-(distance / width)^2 / 2) between codewords (k, d), rows normalized to 1.

    width: in mean distances of a codeword to its nearest neighbour; 0: the identity.
    """
    if width == 0.0 or len(codewords) == 1:
        return np.eye(len(codewords))
    distances = np.linalg.norm(codewords[:, None] - codewords[None], axis=2)
    others = np.where(np.eye(len(codewords), dtype=bool), np.inf, distances)
    weights = np.exp(-0.5 * (distances / (width * others.min(axis=1).mean())) ** 2)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _chain(states: int, topology: Topology, frames: float) -> tuple[Floats, Floats]:
    """Start and transition probabilities before training: equal expected durations of all states."""
    stay = max(0.5, 1.0 - states / frames) if states > 1 else 1.0
    if topology == "ergodic":
        others = (1.0 - stay) / max(states - 1, 1)
        return np.full(states, 1.0 / states), np.full((states, states), others) + (stay - others) * np.eye(states)
    transition = stay * np.eye(states) + (1.0 - stay) * np.eye(states, k=1)
    transition[-1, -1] = 1.0
    return np.eye(states)[0], transition


def _divided_emissions(examples: Sequence[Ints], symbols: int, states: int, rng: np.random.Generator | None) -> Floats:
    """(s, k) emissions of examples divided into `states` parts: equal, or random with `rng`."""
    counts = np.full((states, symbols), 0.1)
    for example in examples:
        edges = np.linspace(0.0, 1.0, states + 1)
        if rng is not None:
            edges[1:-1] = np.sort(rng.uniform(0.0, 1.0, states - 1))
        of = np.clip(np.searchsorted(edges, (np.arange(len(example)) + 0.5) / len(example)) - 1, 0, states - 1)
        np.add.at(counts, (of, example), 1.0)
    if rng is not None:
        counts *= rng.uniform(0.5, 1.5, counts.shape)
    return np.asarray(counts / counts.sum(axis=1, keepdims=True))
