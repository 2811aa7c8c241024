"""Posture models as arrays, and what they say of a window: symbols, log-likelihoods, and whether any explains it.

n postures, s states, k symbols, d features.  [Two-view 5.2]
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.recognizer.likelihood import filler_log_likelihood, forward_log_likelihoods

Symbols = NDArray[np.int64]
MOST_LABELS = 256  # as a message has room for
EDGE = 2  # frames at either end of an example
LEAST_SCORE, FARTHEST = -1e3, 1e6  # of models without thresholds: everything is known to them


@dataclass(frozen=True)
class LabelFigures:
    """What was learnt of one posture.

    examples, people: learnt from.  held: examples that a model without their person was tried on; recognised: of these
    the ones with the largest likelihood; accepted: of those the ones that reach the threshold, also set without them.
    strangers: examples of other postures, each tried without its own model, for which this was the likeliest;
    refused: of these the ones that stay below the threshold.
    """

    examples: int
    people: int
    held: int = 0
    recognised: int = 0
    accepted: int = 0
    strangers: int = 0
    refused: int = 0


@dataclass(frozen=True)
class Training:
    """Where a model comes from.  settings: what was chosen, by name.  figures: in the order of the labels.

    frames: learnt from, at the model's rate.  sources: of the examples, names of files.
    """

    people: tuple[str, ...]
    sources: tuple[str, ...]
    frames: int
    settings: dict[str, str]
    figures: tuple[LabelFigures, ...]


@dataclass(frozen=True, eq=False)
class PostureModel:
    """One hidden Markov model for each posture over the symbols of one codebook.

    features: a kind of `services.recognizer.features`.  rate: frames per second.  labels: (n,).
    mean: (d,), whitening: (d, d): a feature vector f is compared as (f - mean) @ whitening.
    codebook: (k, d) in those coordinates.  occurring: (k,) how often each symbol is seen in all examples, sums to 1.
    start: (n, s), transition: (n, s, s), emission: (n, s, k): probabilities, rows sum to 1.
    durations: (n, 3) seconds: the shortest, the median and the longest example.
    edges: (n, 2, d) mean of the examples' first and last EDGE frames, in the codebook's coordinates.
    reach: (n,) how far from its first frame an example comes at least: of 95 in 100 examples.
    thresholds: (n,) least score of a posture, see `scores_of`.
    farthest: mean distance of a window's frames to their codewords beyond which it is like nothing that was learnt.
    calm, slow: of 95 in 100 edge frames, the largest distance to `edges`, and speed in coordinates per second.
    """

    features: str
    rate: float
    labels: tuple[str, ...]
    mean: Floats
    whitening: Floats
    codebook: Floats
    occurring: Floats
    start: Floats
    transition: Floats
    emission: Floats
    durations: Floats
    edges: Floats
    reach: Floats
    thresholds: Floats
    farthest: float
    calm: float
    slow: float
    training: Training

    @property
    def states(self) -> int:
        return int(self.start.shape[1])

    @property
    def symbols(self) -> int:
        return len(self.codebook)

    @cached_property
    def squares(self) -> Floats:
        """(k,) half the squared length of every codeword."""
        return np.asarray(0.5 * np.sum(self.codebook**2, axis=1))

    @cached_property
    def staying(self) -> Floats:
        """(n, s) probability to stay in a state within the filler: the posture's own; a last state's: the rest's mean."""
        stay = np.diagonal(self.transition, axis1=1, axis2=2).copy()
        for row in stay:
            last = row > 1.0 - 1e-6
            row[last] = row[~last].mean() if (~last).any() else 0.9
        return stay


@dataclass(frozen=True)
class Judgement:
    """What a model says of one window.

    log_likelihoods: (n,) log P(O | λ).  filler: see `filler_likelihood`.  scores: (n,) (log_likelihoods - filler) / frames.
    best: index of the likeliest posture.  distance: mean distance of the frames to their codewords.
    known: the best one's score reaches its threshold, and the distance is at most the model's `farthest`.
    margin: the best log-likelihood minus the second, 0 of a single posture.
    """

    log_likelihoods: Floats
    filler: float
    scores: Floats
    best: int
    distance: float
    known: bool
    margin: float


def symbols_of(model: PostureModel, features: Floats) -> Symbols:
    """(T,) index of the codeword nearest to each feature vector (T, d)."""
    nearest: Symbols = np.argmax(whiten(model, features) @ model.codebook.T - model.squares, axis=1)
    return nearest


def whiten(model: PostureModel, features: Floats) -> Floats:
    """(..., d) feature vectors (..., d) in the codebook's coordinates."""
    whitened: Floats = (features - model.mean) @ model.whitening
    return whitened


def distances_of(model: PostureModel, features: Floats, symbols: Symbols) -> Floats:
    """(T,) from each feature vector (T, d) to its codeword, in the codebook's coordinates."""
    distances: Floats = np.linalg.norm(whiten(model, features) - model.codebook[symbols], axis=1)
    return distances


def log_likelihoods(model: PostureModel, symbols: Symbols) -> Floats:
    """(n,) P_i = log P(O | λ_i) of symbols (T,), by the forward algorithm.  [Two-view 5.2]"""
    return forward_log_likelihoods(model.start, model.transition, model.emission, symbols)


def filler_likelihood(model: PostureModel, symbols: Symbols, without: int = -1) -> float:
    """log P(O | filler) of symbols (T,): of all postures' states and one more, each left for any other alike.

    without: index of a posture that is left out.  After Lee and Kim, An HMM-based threshold model approach for gesture
    recognition (1999): what is made of parts of postures in another order has the filler as its likeliest; so has, by the
    one more state, what has symbols that no posture comes to in that way.
    """
    return float(filler_log_likelihood(model.staying, model.emission, model.occurring, symbols, without))


def scores_of(model: PostureModel, symbols: Symbols) -> Floats:
    """(n,) log-likelihoods of symbols (T,) above that of the filler, by frame; to be compared with the thresholds."""
    return (log_likelihoods(model, symbols) - filler_likelihood(model, symbols)) / len(symbols)


def judge(model: PostureModel, features: Floats) -> Judgement:
    """What the model says of a window of feature vectors (T, d), T of 1 or more, at the model's rate, all finite."""
    symbols = symbols_of(model, features)
    distance = float(distances_of(model, features, symbols).mean())
    return judgement_of(model, log_likelihoods(model, symbols), filler_likelihood(model, symbols), len(symbols), distance)


def judgement_of(model: PostureModel, likelihoods: Floats, filler: float, frames: int, distance: float) -> Judgement:
    scores = (likelihoods - filler) / frames
    best = int(np.argmax(likelihoods))
    others = np.delete(likelihoods, best)
    margin = float(likelihoods[best] - others.max()) if len(others) else 0.0
    known = bool(scores[best] >= model.thresholds[best] and distance <= model.farthest)
    return Judgement(likelihoods, filler, scores, best, distance, known, margin)


def index_of(labels: Sequence[str], label: str) -> int:
    """Raises ValueError that names the label and those there are."""
    try:
        return list(labels).index(label)
    except ValueError:
        raise ValueError(f"posture {label!r}: allowed: {', '.join(labels)}") from None
