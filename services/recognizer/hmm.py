"""Learning one posture's hidden Markov model from its symbol sequences, by hmmlearn's Baum-Welch.  [Two-view 5.1]"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from hmmlearn.hmm import CategoricalHMM
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.recognizer.examples import Topology

Symbols = NDArray[np.int64]
ITERATIONS, TOLERANCE = 30, 1e-2
COUNTED = 1e-6  # frames that are counted on top everywhere: a state that nobody comes to has probabilities too


class _Given(CategoricalHMM):  # type: ignore[misc]  # hmmlearn has no types
    """Begins with the probabilities it was given.  hmmlearn would look whether to draw them, and warn of fewer frames than
    probabilities, which is what the smoothing is for."""

    def _init(self, X: NDArray[np.int64], lengths: Sequence[int] | None = None) -> None:
        pass


@dataclass(frozen=True)
class Hmm:
    """start: (s,), transition: (s, s), emission: (s, k): probabilities, rows sum to 1.  fit: log P of the examples."""

    start: Floats
    transition: Floats
    emission: Floats
    fit: float


def learnt(examples: Sequence[Symbols], symbols: int, states: int, topology: Topology, restarts: int, seed: int) -> Hmm:
    """The likeliest of `restarts` models of the examples, each symbols (T_i,) from 0 to symbols - 1.

    The first begins from examples cut into `states` equal parts; of others the cuts and emissions are drawn from the
    seed.  left-right: from each state to itself and the next, from the first on.  ergodic: from each to each.
    """
    lengths = [len(example) for example in examples]
    column = np.concatenate(examples)[:, None]
    best: Hmm | None = None
    for restart in range(restarts):
        rng = np.random.default_rng((seed, restart))
        start, transition = _chain(states, topology, float(np.mean(lengths)))
        hmm = _Given(
            states, n_features=symbols, params="te" if topology == "left-right" else "ste", init_params="",
            n_iter=ITERATIONS, tol=TOLERANCE, implementation="scaling", startprob_prior=1.0 + COUNTED,
            transmat_prior=1.0 + COUNTED * (transition > 0.0), emissionprob_prior=1.0 + COUNTED,
        )  # fmt: skip
        hmm.startprob_, hmm.transmat_ = start, transition
        hmm.emissionprob_ = _cut(examples, symbols, states, None if restart == 0 else rng)
        hmm.fit(column, lengths)
        fit = float(hmm.score(column, lengths))
        if best is None or fit > best.fit:
            best = Hmm(hmm.startprob_, hmm.transmat_, hmm.emissionprob_, fit)
    assert best is not None, "restarts is one or more"
    return best


def smoothed(emission: Floats, spread: Floats, floor: float, occurring: Floats) -> Floats:
    """(..., s, k) emissions that expect what the examples did not show.

    spread: (k, k) how each symbol stands for its neighbours, rows sum to 1.  floor: share of the symbols' overall
    frequencies `occurring` (k,) that is mixed in.
    """
    mixed: Floats = (1.0 - floor) * (emission @ spread) + floor * occurring
    return np.asarray(mixed / mixed.sum(axis=-1, keepdims=True))


def spread_of(codewords: Floats, width: float) -> Floats:
    """(k, k) weights exp(-(distance / width)^2 / 2) between codewords (k, d), rows made to sum to 1.

    width: in mean distances from a codeword to its nearest neighbour; 0 for the identity.
    """
    if width == 0.0 or len(codewords) == 1:
        return np.eye(len(codewords))
    distances = np.linalg.norm(codewords[:, None] - codewords[None], axis=2)
    others = np.where(np.eye(len(codewords), dtype=bool), np.inf, distances)
    weights = np.exp(-0.5 * (distances / (width * others.min(axis=1).mean())) ** 2)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _chain(states: int, topology: Topology, frames: float) -> tuple[Floats, Floats]:
    """Start and transition probabilities before learning: equal stays in every state."""
    stay = max(0.5, 1.0 - states / frames) if states > 1 else 1.0
    if topology == "ergodic":
        others = (1.0 - stay) / max(states - 1, 1)
        return np.full(states, 1.0 / states), np.full((states, states), others) + (stay - others) * np.eye(states)
    transition = stay * np.eye(states) + (1.0 - stay) * np.eye(states, k=1)
    transition[-1, -1] = 1.0
    return np.eye(states)[0], transition


def _cut(examples: Sequence[Symbols], symbols: int, states: int, rng: np.random.Generator | None) -> Floats:
    """(s, k) emissions of examples cut into `states` parts: equal ones, or at places that are drawn."""
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
