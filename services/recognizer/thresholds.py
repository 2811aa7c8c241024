"""When a window is no posture at all: thresholds learnt from held-out people, and from postures without their own models.

A posture's score is its log-likelihood a frame above the filler's (`model.Judgement`).  Right ones are scores of examples
by people that the model was not learnt from; strangers are examples of a posture whose own model is left out, for the
posture that then claims them: movements that nobody taught.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from common.body.anatomy import Floats
from services.recognizer.examples import Plan, Prepared
from services.recognizer.fitting import Report, fitted
from services.recognizer.model import (
    FARTHEST,
    LEAST_SCORE,
    LabelFigures,
    PostureModel,
    distances_of,
    filler_likelihood,
    log_likelihoods,
    symbols_of,
)

MISSED = 2.0  # a posture that is not heard counts as much as so many strangers taken for one
NEAREST, FURTHEST = 1.0, 3.0  # standard deviations below the right ones' mean, between which a threshold lies
LEAST_SPREAD = 0.05  # natural logarithms a frame
FAR_QUANTILE, FARTHER = 0.99, 1.25


@dataclass(frozen=True)
class Trial:
    """A held-out example: its label, its score there, what was likeliest, and for which posture it is a stranger with what
    score, -1 without any.  distance: mean distance to the codewords.  label_known: the fold had examples of the label."""

    label: int
    label_known: bool
    score: float
    best: int
    stranger_to: int
    stranger_score: float
    distance: float


def with_thresholds(model: PostureModel, ready: Prepared, plan: Plan, report: Report) -> PostureModel:
    """The model with thresholds, `farthest` and figures from models of the same examples that leave people out in turn."""
    trials = trials_of(ready, plan, report)
    right = [np.array([t.score for t in trials if t.label == k and t.label_known]) for k in range(len(model.labels))]
    strangers = [np.array([t.stranger_score for t in trials if t.stranger_to == k]) for k in range(len(model.labels))]
    thresholds = thresholds_of(right, strangers)
    distances = np.array([t.distance for t in trials])
    farthest = FARTHER * float(np.quantile(distances, FAR_QUANTILE)) if len(distances) else FARTHEST
    figures = tuple(_figures(known, k, trials, float(thresholds[k])) for k, known in enumerate(model.training.figures))
    training = replace(model.training, figures=figures)
    return replace(model, thresholds=thresholds, farthest=farthest, training=training)


def groups_of(ready: Prepared, folds: int) -> list[list[int]]:
    """Examples to hold out together, by person in up to `folds` groups; by repetition where there is one person only."""
    by_person = sorted({example.person for example in ready.examples})
    of = [example.person for example in ready.examples]
    if len(by_person) < 2:
        of = [example.repetition for example in ready.examples]
    names = sorted(set(of))
    if len(names) < 2:
        return []
    count = min(folds, len(names))
    return [[k for k, name in enumerate(of) if names.index(name) % count == fold] for fold in range(count)]


def trials_of(ready: Prepared, plan: Plan, report: Report) -> list[Trial]:
    """Every example tried on models that were learnt without its group."""
    trials: list[Trial] = []
    groups = groups_of(ready, plan.folds)
    for fold, held in enumerate(groups):
        report(fold, len(groups), f"thresholds, {fold + 1} of {len(groups)}")
        kept = ready.chosen([k for k in range(len(ready.examples)) if k not in set(held)])
        labels = tuple(label for label in ready.labels if label in {example.label for example in kept.examples})
        if not labels:
            continue
        model = fitted(replace(kept, labels=labels), plan)
        trials += [_trial(model, ready, k) for k in held]
    report(len(groups), len(groups), "done")
    return trials


def thresholds_of(right: Sequence[Floats], strangers: Sequence[Floats]) -> Floats:
    """(n,) scores of the right ones and of strangers by posture: where both kinds of error together are least.

    Both are taken for normal; with few right ones of its own a posture leans on the spread of all.
    """
    pooled = np.concatenate([scores - scores.mean() for scores in right if len(scores)] or [np.zeros(0)])
    every = np.concatenate([*right, np.zeros(0)])
    spread = max(LEAST_SPREAD, float(pooled.std())) if len(pooled) else LEAST_SPREAD
    thresholds = np.full(len(right), LEAST_SCORE)
    for k, (own, others) in enumerate(zip(right, strangers, strict=True)):
        if not len(every):
            continue
        middle = float(own.mean()) if len(own) else float(every.mean())
        width = float(np.sqrt((len(own) * own.var() + 4 * spread**2) / (len(own) + 4))) if len(own) else spread
        at = np.linspace(middle - FURTHEST * width, middle - NEAREST * width, 101)
        costs = MISSED * norm.cdf(at, middle, width)
        if len(others):
            apart = float(np.sqrt((len(others) * others.var() + 4 * spread**2) / (len(others) + 4)))
            costs = costs + norm.sf(at, float(others.mean()), apart) * min(1.0, len(others) / max(len(own), 1))
        thresholds[k] = at[int(np.argmin(costs))]
    return thresholds


def _trial(model: PostureModel, ready: Prepared, k: int) -> Trial:
    example, features = ready.examples[k], ready.sequences[k]
    symbols = symbols_of(model, features)
    likelihoods, frames = log_likelihoods(model, symbols), len(symbols)
    names = [ready.labels.index(label) for label in model.labels]
    known = example.label in model.labels
    own = model.labels.index(example.label) if known else -1
    score = (float(likelihoods[own]) - filler_likelihood(model, symbols)) / frames if known else 0.0
    stranger_to, stranger_score = -1, 0.0
    if len(model.labels) - known > 0:
        others = likelihoods.copy()
        if known:
            others[own] = -np.inf
        claims = int(np.argmax(others))
        stranger_to = names[claims]
        stranger_score = (float(others[claims]) - filler_likelihood(model, symbols, own)) / frames
    distance = float(distances_of(model, features, symbols).mean())
    best = names[int(np.argmax(likelihoods))]
    return Trial(ready.labels.index(example.label), known, score, best, stranger_to, stranger_score, distance)


def _figures(known: LabelFigures, k: int, trials: Sequence[Trial], threshold: float) -> LabelFigures:
    own = [t for t in trials if t.label == k and t.label_known]
    recognised = [t for t in own if t.best == k]
    strangers = [t for t in trials if t.stranger_to == k]
    return replace(
        known,
        held=len(own),
        recognised=len(recognised),
        accepted=sum(t.score >= threshold for t in recognised),
        strangers=len(strangers),
        refused=sum(t.stranger_score < threshold for t in strangers),
    )
