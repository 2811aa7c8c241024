"""Rejection thresholds, trained on held-out people and on postures without their own model.

Correct scores are those of examples of people outside the training set (`Classification.scores`).  Impostor scores are
those of examples of a posture whose own model is left out, under the posture that is then the likeliest.  They represent
movements that are in no training set.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.model import (
    NO_DISTANCE_LIMIT,
    NO_THRESHOLD,
    LabelFigures,
    PostureModel,
    distances_of,
    filler_likelihood,
    log_likelihoods,
    symbols_of,
)
from zenocap.services.recognizer.training import parameters as p
from zenocap.services.recognizer.training.examples import Prepared


# Paper (added): 5.2 takes the likeliest posture always; here unlikely windows are rejected.
@dataclass(frozen=True)
class Trial:
    """Scores of a held-out example.

    label: index of its posture.  label_known: the training set of the fold contains it.  score: of its posture.  best:
    index of the likeliest posture.  impostor_of, impostor_score: the likeliest other posture, -1 without one, and its
    score without the example's own model.  distance: mean distance to the codewords.
    """

    label: int
    label_known: bool
    score: float
    best: int
    impostor_of: int
    impostor_score: float
    distance: float


def with_thresholds(model: PostureModel, trials: Sequence[Trial]) -> PostureModel:
    """The model with thresholds, `farthest` and figures from trials of held-out examples."""
    correct = [np.array([t.score for t in trials if t.label == k and t.label_known]) for k in range(len(model.labels))]
    impostors = [np.array([t.impostor_score for t in trials if t.impostor_of == k]) for k in range(len(model.labels))]
    thresholds = train_thresholds(correct, impostors)
    distances = np.array([t.distance for t in trials])
    farthest = NO_DISTANCE_LIMIT
    if len(distances):
        farthest = max(p.LEAST_FARTHEST, p.FARTHEST_FACTOR * float(np.quantile(distances, p.FARTHEST_QUANTILE)))
    figures = tuple(_figures(known, k, trials, float(thresholds[k])) for k, known in enumerate(model.training.figures))
    training = replace(model.training, figures=figures)
    return replace(model, thresholds=thresholds, farthest=farthest, training=training)


def held_out_groups(ready: Prepared, folds: int) -> list[list[int]]:
    """Indices of examples to hold out together: by person in up to `folds` groups; with one person, by repetition."""
    of = [example.person for example in ready.examples]
    if len(set(of)) < 2:
        of = [example.repetition for example in ready.examples]
    names = sorted(set(of))
    if len(names) < 2:
        return []
    count = min(folds, len(names))
    return [[k for k, name in enumerate(of) if names.index(name) % count == fold] for fold in range(count)]


def train_thresholds(correct: Sequence[Floats], impostors: Sequence[Floats]) -> Floats:
    """(n,) thresholds that minimize the expected cost of misses and false acceptances.

    correct, impostors: scores by posture, modelled as normal; the spread of few scores is shrunk towards that of all.
    """
    pooled = np.concatenate([scores - scores.mean() for scores in correct if len(scores)] or [np.zeros(0)])
    every = np.concatenate([*correct, np.zeros(0)])
    spread = max(p.LEAST_SPREAD, float(pooled.std())) if len(pooled) else p.LEAST_SPREAD
    thresholds = np.full(len(correct), NO_THRESHOLD)
    for k, (own, others) in enumerate(zip(correct, impostors, strict=True)):
        if not len(every):
            continue
        middle = float(own.mean()) if len(own) else float(every.mean())
        width = _shrunk_deviation(own, spread) if len(own) else spread
        at = np.linspace(middle - p.FURTHEST * width, middle - p.NEAREST * width, 101)
        costs = p.MISS_COST * norm.cdf(at, middle, width)
        if len(others):
            costs = costs + norm.sf(at, float(others.mean()), _shrunk_deviation(others, spread)) * min(
                1.0, len(others) / max(len(own), 1)
            )
        thresholds[k] = at[int(np.argmin(costs))]
    return thresholds


def _shrunk_deviation(scores: Floats, spread: float) -> float:
    """Standard deviation of scores (r,) with PRIOR_SCORES scores of standard deviation `spread` added."""
    return float(np.sqrt((len(scores) * scores.var() + p.PRIOR_SCORES * spread**2) / (len(scores) + p.PRIOR_SCORES)))


def trial(model: PostureModel, ready: Prepared, k: int) -> Trial:
    """Scores of example k with a model trained without it."""
    example, features = ready.examples[k], ready.sequences[k]
    symbols = symbols_of(model, features)
    likelihoods, frames = log_likelihoods(model, symbols), len(symbols)
    names = [ready.labels.index(label) for label in model.labels]
    known = example.label in model.labels
    own = model.labels.index(example.label) if known else -1
    score = (float(likelihoods[own]) - filler_likelihood(model, symbols)) / frames if known else 0.0
    impostor_of, impostor_score = -1, 0.0
    if len(model.labels) - known > 0:
        others = likelihoods.copy()
        if known:
            others[own] = -np.inf
        other = int(np.argmax(others))
        impostor_of = names[other]
        impostor_score = (float(others[other]) - filler_likelihood(model, symbols, own)) / frames
    distance = float(distances_of(model, features, symbols).mean())
    best = names[int(np.argmax(likelihoods))]
    return Trial(ready.labels.index(example.label), known, score, best, impostor_of, impostor_score, distance)


def _figures(counted: LabelFigures, k: int, trials: Sequence[Trial], threshold: float) -> LabelFigures:
    own = [t for t in trials if t.label == k and t.label_known]
    strangers = [t.impostor_score for t in trials if t.impostor_of == k]
    return with_trials(counted, threshold, len(own), [t.score for t in own if t.best == k], strangers)


def with_trials(
    counted: LabelFigures, threshold: float, held: int, recognized: Sequence[float], strangers: Sequence[float]
) -> LabelFigures:
    """The numbers of a posture with those of its trials.

    held: number of held-out examples.  recognized: scores of those that are likeliest this posture.  strangers: scores of
    examples of other postures, without their own model, that are.
    """
    return replace(
        counted, held=held, recognised=len(recognized), accepted=sum(score >= threshold for score in recognized),
        strangers=len(strangers), refused=sum(score < threshold for score in strangers),
    )  # fmt: skip
