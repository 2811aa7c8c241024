"""Training of the posture models over one codebook, and of their thresholds.  [Two-view 5.1]"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.errors import UserError
from zenocap.services.recognizer.model import NO_DISTANCE_LIMIT, NO_THRESHOLD, LabelFigures, PostureModel, Training
from zenocap.services.recognizer.motion_rows import ANGLES
from zenocap.services.recognizer.training import forest as forest_training
from zenocap.services.recognizer.training.background import false_alarms_of, negatives_of, with_rate
from zenocap.services.recognizer.training.baum_welch import Hmm, smoothed, spread_of, train_hmm
from zenocap.services.recognizer.training.codebook import Codebook, nearest, train_codebook, whitened
from zenocap.services.recognizer.training.examples import (
    BACKGROUND,
    Example,
    Prepared,
    TrainingSettings,
    background_of,
    postures_of,
    prepare,
)
from zenocap.services.recognizer.training.forest import ForestData, descriptions_of, forest_of
from zenocap.services.recognizer.training.parameters import EDGE_FRAMES, EDGE_QUANTILE, LEAST_REACH
from zenocap.services.recognizer.training.thresholds import Trial, held_out_groups, trial, with_thresholds

Report = Callable[[int, int, str], None]
"""Progress: steps done, their number, and the current one."""


def no_report(done: int, of: int, text: str) -> None:
    """Ignore progress."""


def train(examples: Sequence[Example], settings: TrainingSettings, report: Report = no_report) -> PostureModel:
    """Train a model of the examples' postures, with thresholds.  Equal arguments give equal models.  Raises UserError."""
    ready, background = prepare(postures_of(examples), settings), background_of(examples, settings)
    if settings.false_per_hour is not None and not background:
        raise UserError(
            f"false_per_hour = {settings.false_per_hour:g}: no background: allowed: with rows of posture {BACKGROUND!r}"
        )
    model = train_models(ready, settings, report)
    _check_reach(model)
    if settings.folds:
        model = with_thresholds(model, trials_of(ready, settings, report))
    return model if settings.classifier == "paper" else _with_forest(model, ready, background, settings)


def _check_reach(model: PostureModel) -> None:
    """Raise UserError for a posture that moves hardly anything but ignored parts: a stream could not find it."""
    still = [label for label, reach in zip(model.labels, model.reach, strict=True) if reach < LEAST_REACH]
    if model.ignored and still:
        raise UserError(
            f"ignored = {', '.join(model.ignored)}: posture {', '.join(map(repr, still))} moves the other limbs by less "
            f"than {LEAST_REACH:g} rad: allowed: postures that move them, or other parts"
        )


def _with_forest(
    model: PostureModel, ready: Prepared, background: Sequence[Floats], settings: TrainingSettings
) -> PostureModel:
    values = descriptions_of(ready, settings.rate, settings.seed)
    data = ForestData(values, ready.indices, len(ready.labels), *negatives_of(model, background, settings.seed))
    forest = forest_of(data, np.arange(len(values)), settings.trees, settings.seed)
    if not settings.folds:
        return replace(model, forest=forest)
    tried = forest_training.trials_of(data, held_out_groups(ready, settings.folds), settings.trees, settings.seed)
    forest = forest_training.with_thresholds(forest, tried)
    if settings.false_per_hour is not None:
        alarms = false_alarms_of(model, forest, data, background, settings.seed)
        forest = with_rate(forest, alarms, settings.false_per_hour)
    figures = forest_training.figures_of(model.training.figures, forest, tried)
    return replace(model, forest=forest, training=replace(model.training, figures=figures))


def train_models(ready: Prepared, settings: TrainingSettings, report: Report = no_report) -> PostureModel:
    """Train hidden Markov models that accept every window.  Every label needs an example."""
    angles = [rows[:, ANGLES] for rows in ready.sequences]
    codebook = train_codebook(angles, settings.symbols, settings.scale, settings.seed)
    vectors = [whitened(codebook, features) for features in angles]
    symbols = [nearest(codebook.codewords, sequence) for sequence in vectors]
    count = len(codebook.codewords)
    hmms: list[Hmm] = []
    for k, label in enumerate(ready.labels):
        report(k, len(ready.labels), label)
        own = [found for found, example in zip(symbols, ready.examples, strict=True) if example.label == label]
        seed = (settings.seed * 1000003 + k) % 2**31
        hmms.append(train_hmm(own, count, settings.states, settings.topology, settings.restarts, seed))
    report(len(ready.labels), len(ready.labels), "done")
    return _model(ready, settings, codebook, vectors, symbols, hmms)


def _model(
    ready: Prepared,
    settings: TrainingSettings,
    codebook: Codebook,
    vectors: Sequence[Floats],
    symbols: Sequence[Ints],
    hmms: Sequence[Hmm],
) -> PostureModel:
    count = len(codebook.codewords)
    counts = np.bincount(np.concatenate(symbols), minlength=count) + 1.0
    occurring = np.asarray(counts / counts.sum(), dtype=np.float64)
    emission = np.stack([hmm.emission for hmm in hmms])
    n = len(ready.labels)
    of = ready.indices.tolist()
    edges, calm, slow = edges_of(of, n, vectors, settings.rate)
    return PostureModel(
        settings.features,
        settings.rate,
        ready.labels,
        codebook.mean,
        codebook.whitening,
        codebook.codewords,
        occurring,
        np.stack([hmm.start for hmm in hmms]),
        np.stack([hmm.transition for hmm in hmms]),
        # Paper (added): 5.1 has no smoothing; symbols without examples would have probability 0.
        smoothed(emission, spread_of(codebook.codewords, settings.spread), settings.floor, occurring),
        _durations(ready, settings.rate),
        edges,
        reach_of(of, n, vectors),
        np.full(n, NO_THRESHOLD),
        NO_DISTANCE_LIMIT,
        calm,
        slow,
        _training(ready, settings),
        ignored=settings.ignored,
    )


def _durations(ready: Prepared, rate: float) -> Floats:
    """(n, 3) seconds: the shortest, the median and the longest example of every label."""
    rows = []
    for label in ready.labels:
        pairs = zip(ready.sequences, ready.examples, strict=True)
        seconds = [len(features) / rate for features, example in pairs if example.label == label]
        rows.append([min(seconds), float(np.median(seconds)), max(seconds)])
    return np.array(rows)


def _training(ready: Prepared, settings: TrainingSettings) -> Training:
    figures = []
    for label in ready.labels:
        own = [example for example in ready.examples if example.label == label]
        figures.append(LabelFigures(len(own), len({example.person for example in own})))
    return Training(
        tuple(sorted({example.person for example in ready.examples})),
        tuple(dict.fromkeys(example.source for example in ready.examples if example.source)),
        sum(map(len, ready.sequences)),
        {name: _setting(value) for name, value in asdict(settings).items() if value not in (None, ())},
        tuple(figures),
    )


def _setting(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(str, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def edges_of(labels: Sequence[int], count: int, vectors: Sequence[Floats], rate: float) -> tuple[Floats, float, float]:
    """`edges` (n, 2, d), `calm` and `slow` of a `PostureModel`.

    labels: index of each example's posture, below `count`.  vectors: (T_i, d), T_i of 2 or more, whitened, at `rate` frames
    per second.
    """
    ends = [(example[:EDGE_FRAMES], example[-EDGE_FRAMES:]) for example in vectors]

    def mean(k: int, end: int) -> Floats:
        own: Floats = np.concatenate([pair[end] for pair, of in zip(ends, labels, strict=True) if of == k]).mean(axis=0)
        return own

    edges = np.array([[mean(k, end) for end in (0, 1)] for k in range(count)])
    distances, speeds = [], []
    for pair, of in zip(ends, labels, strict=True):
        for end in (0, 1):
            distances.append(np.linalg.norm(pair[end] - edges[of, end], axis=1))
            speeds.append(np.linalg.norm(np.diff(pair[end], axis=0), axis=1) * rate)
    calm, slow = (float(np.quantile(np.concatenate(values), EDGE_QUANTILE)) for values in (distances, speeds))
    return edges, calm, slow


def reach_of(labels: Sequence[int], count: int, vectors: Sequence[Floats]) -> Floats:
    """(n,) distance from the first frame that 95 % of the examples (T_i, d) of a posture exceed."""
    largest = np.array([np.linalg.norm(example - example[0], axis=1).max() for example in vectors])
    of = np.array(labels)
    return np.array([np.quantile(largest[of == k], 1.0 - EDGE_QUANTILE) for k in range(count)])


def trials_of(ready: Prepared, settings: TrainingSettings, report: Report) -> list[Trial]:
    """Trials of every example with models that are trained without its group."""
    trials: list[Trial] = []
    groups = held_out_groups(ready, settings.folds)
    for fold, held in enumerate(groups):
        report(fold, len(groups), f"thresholds, {fold + 1} of {len(groups)}")
        if (kept := ready.without(held)).examples:
            model = train_models(kept, settings)
            trials += [trial(model, ready, k) for k in held]
    report(len(groups), len(groups), "done")
    return trials
