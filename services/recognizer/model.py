"""Posture models as arrays, and the classification of a window: symbols, log-likelihoods, acceptance.

n postures, s states, k symbols, d features: the first columns of rows (T, d or more).  [Two-view 5.2]

The hidden Markov models find windows in a stream.  A model with a forest leaves the decision on a window to the forest.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.forest import Forest, votes_of
from zenocap.services.recognizer.ignored_parts import Part, without_parts
from zenocap.services.recognizer.likelihood import filler_log_likelihood, forward_log_likelihoods
from zenocap.services.recognizer.segment_description import describe

MOST_LABELS = 256  # of a `Posture` message
LEAST_VOTES = 0.5  # added to votes before logarithms
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

    features: kind of the angles.  rate: frames per second.  labels: (n,).
    mean: (d,), whitening: (d, d): the whitened feature vector f is (f - mean) @ whitening.
    codebook: (k, d), whitened.  occurring: (k,) relative frequency of each symbol in all examples, sums to 1.
    start: (n, s), transition: (n, s, s), emission: (n, s, k): probabilities, rows sum to 1.
    durations: (n, 3) seconds: the shortest, the median and the longest example.
    edges: (n, 2, d) mean of the examples' first and last frames, whitened.
    reach: (n,) largest distance from an example's first frame that 95 % of the examples exceed.
    thresholds: (n,) least score of a posture, see `Classification`.
    farthest: largest mean distance of a window's frames to their codewords with which it is accepted.
    calm, slow: 95 % quantiles over first and last frames of the distance to `edges`, and of the speed per second.
    forest: decides on windows; None: the paper's recognizer, which takes the likeliest model.
    ignored: parts of the body that are not used, see `ignored_parts`.
    """

    features: Kind
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
    forest: Forest | None = None
    ignored: tuple[Part, ...] = ()

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

    By hidden Markov models: log_likelihoods: (n,) log P(O | λ).  scores: (n,) (log_likelihoods - filler) / frames, see
    `filler_likelihood`.  best: index of the likeliest posture.  distance: mean distance of the frames to their codewords.
    accepted: the score of `best` reaches its threshold, and the distance is at most the model's `farthest`.
    margin: the largest log-likelihood minus the second largest per frame, 0 with a single posture.

    By a forest: log_likelihoods: logarithms of the shares of votes.  scores: -ln(1 - s) of a share of votes s.
    best: index of most votes.  accepted: its share reaches its threshold, and no fewer trees vote for it than for none.
    margin: -ln(1 - s + t) with the share t of the second best, 0 with a single posture.  distance: 0.  In all logarithms
    LEAST_VOTES are added to the votes.
    """

    log_likelihoods: Floats
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
    """(..., d) whitened feature vectors of rows (..., d or more)."""
    whitened: Floats = (features[..., : len(model.mean)] - model.mean) @ model.whitening
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


def classify(model: PostureModel, features: Floats) -> Classification:
    """Classify a window of rows (T, d or, by a forest, `motion_rows.WIDTH`), T of 1 or more, at the model's rate.

    All values are finite.
    """
    features = without_parts(features, model.ignored)
    return by_models(model, features) if model.forest is None else by_forest(model.forest, describe(features, model.rate))


def by_forest(forest: Forest, values: Floats) -> Classification:
    """Classify the description of a window."""
    every = votes_of(forest, values)
    votes, trees = every[:-1], int(every.sum())
    best = int(np.argmax(votes))
    second = int(np.delete(votes, best).max(initial=0))
    otherwise = (trees - votes + LEAST_VOTES) / (trees + LEAST_VOTES)
    margin = -np.log((trees - votes[best] + second + LEAST_VOTES) / (trees + LEAST_VOTES)) if len(votes) > 1 else 0.0
    accepted = bool(votes[best] >= forest.thresholds[best] * trees and votes[best] >= every[-1])
    shares = np.log((votes + LEAST_VOTES) / (trees + LEAST_VOTES * len(votes)))
    return Classification(shares, -np.log(otherwise), best, 0.0, accepted, float(margin))


def by_models(model: PostureModel, features: Floats) -> Classification:
    """Classify by the hidden Markov models alone.  [Two-view 5.2]"""
    symbols = symbols_of(model, features)
    distance = float(distances_of(model, features, symbols).mean())
    likelihoods, filler = log_likelihoods(model, symbols), filler_likelihood(model, symbols)
    scores = (likelihoods - filler) / len(symbols)
    best = int(np.argmax(likelihoods))
    others = np.delete(likelihoods, best)
    margin = float(likelihoods[best] - others.max()) / len(symbols) if len(others) else 0.0
    accepted = bool(scores[best] >= model.thresholds[best] and distance <= model.farthest)
    return Classification(likelihoods, scores, best, distance, accepted, margin)
