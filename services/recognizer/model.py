"""Posture models as arrays, and the classification of a window: symbols, log-likelihoods, acceptance.

n postures, s states, k symbols, d features.  [Two-view 5.2]
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.services.recognizer.likelihood import filler_log_likelihood, forward_log_likelihoods

MOST_LABELS = 256  # of a `Posture` message
NO_THRESHOLD, NO_DISTANCE_LIMIT = -1e3, 1e6  # values of models without thresholds, which accept every window


@dataclass(frozen=True)
class LabelFigures:
    """Numbers of examples of one posture.

    examples, people: in training.  held: held-out examples, classified by a model without their person; recognised: of
    these, those for which this posture is the likeliest; accepted: of those, those above the threshold.
    strangers: number of examples of other postures, classified without their own model, for which this one is likeliest;
    refused: of these, those below the threshold.  The names are those of the file format.
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
    """Provenance of a model.

    people: their names.  sources: file names of the examples.  frames: number in training, at the model's rate.
    settings: by name.  figures: in the order of the labels.
    """

    people: tuple[str, ...]
    sources: tuple[str, ...]
    frames: int
    settings: dict[str, str]
    figures: tuple[LabelFigures, ...]


@dataclass(frozen=True, eq=False)
class PostureModel:
    """One hidden Markov model per posture over the symbols of one codebook.

    features: a kind of `features.KINDS`.  rate: frames per second.  labels: (n,).
    mean: (d,), whitening: (d, d): the whitened feature vector f is (f - mean) @ whitening.
    codebook: (k, d), whitened.  occurring: (k,) relative frequency of each symbol in all examples, sums to 1.
    start: (n, s), transition: (n, s, s), emission: (n, s, k): probabilities, rows sum to 1.
    durations: (n, 3) seconds: the shortest, the median and the longest example.
    edges: (n, 2, d) mean of the examples' first and last frames, whitened.
    reach: (n,) largest distance from an example's first frame that 95 % of the examples exceed.
    thresholds: (n,) least score of a posture, see `scores_of`.
    farthest: largest mean distance of a window's frames to their codewords with which it is accepted.
    calm, slow: 95 % quantiles over first and last frames of the distance to `edges`, and of the speed per second.
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
        """(n, s) probability of staying in a state of the filler: the posture's own; in a last state, the others' mean."""
        stay = np.diagonal(self.transition, axis1=1, axis2=2).copy()
        for row in stay:
            last = row > 1.0 - 1e-6
            row[last] = row[~last].mean() if (~last).any() else 0.9
        return stay


@dataclass(frozen=True)
class Classification:
    """Result of one window.

    log_likelihoods: (n,) log P(O | λ).  filler: see `filler_likelihood`.  scores: (n,) (log_likelihoods - filler) / frames.
    best: index of the likeliest posture.  distance: mean distance of the frames to their codewords.
    accepted: the score of `best` reaches its threshold, and the distance is at most the model's `farthest`.
    margin: the largest log-likelihood minus the second largest, 0 with a single posture.
    """

    log_likelihoods: Floats
    filler: float
    scores: Floats
    best: int
    distance: float
    accepted: bool
    margin: float


def symbols_of(model: PostureModel, features: Floats) -> Ints:
    """(T,) index of the nearest codeword of each feature vector (T, d)."""
    nearest: Ints = np.argmax(whiten(model, features) @ model.codebook.T - model.squares, axis=1)
    return nearest


def whiten(model: PostureModel, features: Floats) -> Floats:
    """(..., d) whitened feature vectors (..., d)."""
    whitened: Floats = (features - model.mean) @ model.whitening
    return whitened


def distances_of(model: PostureModel, features: Floats, symbols: Ints) -> Floats:
    """(T,) whitened distance of each feature vector (T, d) to its codeword."""
    distances: Floats = np.linalg.norm(whiten(model, features) - model.codebook[symbols], axis=1)
    return distances


def log_likelihoods(model: PostureModel, symbols: Ints) -> Floats:
    """(n,) P_i = log P(O | λ_i) of symbols (T,), by the forward algorithm.  [Two-view 5.2]"""
    return forward_log_likelihoods(model.start, model.transition, model.emission, symbols)


def filler_likelihood(model: PostureModel, symbols: Ints, without: int = -1) -> float:
    """log P(O | filler) of symbols (T,).

    The filler has all postures' states and one more, each with equal exits to all others.  without: index of a posture that
    is left out, -1 for none.  Lee and Kim, An HMM-based threshold model approach for gesture recognition (1999): the filler
    is likelier than every posture for parts of postures in another order and, by its extra state, for symbols that no
    posture has in that order.
    """
    return float(filler_log_likelihood(model.staying, model.emission, model.occurring, symbols, without))


def scores_of(model: PostureModel, symbols: Ints) -> Floats:
    """(n,) scores of symbols (T,): excess of log-likelihood over the filler's per frame, compared with the thresholds."""
    return (log_likelihoods(model, symbols) - filler_likelihood(model, symbols)) / len(symbols)


def classify(model: PostureModel, features: Floats) -> Classification:
    """Classify a window of feature vectors (T, d), T of 1 or more, at the model's rate, all finite."""
    symbols = symbols_of(model, features)
    distance = float(distances_of(model, features, symbols).mean())
    likelihoods, filler = log_likelihoods(model, symbols), filler_likelihood(model, symbols)
    scores = (likelihoods - filler) / len(symbols)
    best = int(np.argmax(likelihoods))
    others = np.delete(likelihoods, best)
    margin = float(likelihoods[best] - others.max()) if len(others) else 0.0
    accepted = bool(scores[best] >= model.thresholds[best] and distance <= model.farthest)
    return Classification(likelihoods, filler, scores, best, distance, accepted, margin)
