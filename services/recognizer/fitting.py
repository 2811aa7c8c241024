"""One hidden Markov model for each posture over the symbols of one codebook, learnt from examples.  [Two-view 5.1]"""

from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np

from common.body.anatomy import Floats
from services.recognizer.codebook import Codebook, codebook_of, nearest, whitened
from services.recognizer.edges import edges_of, reach_of
from services.recognizer.examples import Plan, Prepared
from services.recognizer.hmm import Hmm, Symbols, learnt, smoothed, spread_of
from services.recognizer.model import FARTHEST, LEAST_SCORE, LabelFigures, PostureModel, Training

Report = Callable[[int, int, str], None]


def fitted(ready: Prepared, plan: Plan, report: Report = lambda done, of, words: None) -> PostureModel:
    """A model without thresholds: everything is known to it.  Every label needs an example."""
    codebook = codebook_of(ready.sequences, plan.symbols, plan.scale, plan.seed)
    vectors = [whitened(codebook, features) for features in ready.sequences]
    symbols = [nearest(codebook.codewords, some) for some in vectors]
    count = len(codebook.codewords)
    hmms: list[Hmm] = []
    for k, label in enumerate(ready.labels):
        report(k, len(ready.labels), label)
        own = [found for found, example in zip(symbols, ready.examples, strict=True) if example.label == label]
        seed = (plan.seed * 1000003 + k) % 2**31
        hmms.append(learnt(own, count, plan.states, plan.topology, plan.restarts, seed))
    report(len(ready.labels), len(ready.labels), "done")
    return _model(ready, plan, codebook, vectors, symbols, hmms)


def _model(
    ready: Prepared,
    plan: Plan,
    codebook: Codebook,
    vectors: Sequence[Floats],
    symbols: Sequence[Symbols],
    hmms: Sequence[Hmm],
) -> PostureModel:
    count = len(codebook.codewords)
    seen = np.bincount(np.concatenate(symbols), minlength=count) + 1.0
    occurring = np.asarray(seen / seen.sum(), dtype=np.float64)
    emission = np.stack([hmm.emission for hmm in hmms])
    n = len(ready.labels)
    of = [ready.labels.index(example.label) for example in ready.examples]
    edges, calm, slow = edges_of(of, n, vectors, plan.rate)
    return PostureModel(
        plan.features,
        plan.rate,
        ready.labels,
        codebook.mean,
        codebook.whitening,
        codebook.codewords,
        occurring,
        np.stack([hmm.start for hmm in hmms]),
        np.stack([hmm.transition for hmm in hmms]),
        smoothed(emission, spread_of(codebook.codewords, plan.spread), plan.floor, occurring),
        _durations(ready, plan.rate),
        edges,
        reach_of(of, n, vectors),
        np.full(n, LEAST_SCORE),
        FARTHEST,
        calm,
        slow,
        _training(ready, plan),
    )


def _durations(ready: Prepared, rate: float) -> Floats:
    """(n, 3) seconds: shortest, median and longest example of every label."""
    rows = []
    for label in ready.labels:
        pairs = zip(ready.sequences, ready.examples, strict=True)
        seconds = [len(features) / rate for features, example in pairs if example.label == label]
        rows.append([min(seconds), float(np.median(seconds)), max(seconds)])
    return np.array(rows)


def _training(ready: Prepared, plan: Plan) -> Training:
    figures = []
    for label in ready.labels:
        own = [example for example in ready.examples if example.label == label]
        figures.append(LabelFigures(len(own), len({example.person for example in own})))
    return Training(
        tuple(sorted({example.person for example in ready.examples})),
        tuple(dict.fromkeys(example.source for example in ready.examples if example.source)),
        sum(map(len, ready.sequences)),
        {name: f"{value:g}" if isinstance(value, float) else str(value) for name, value in asdict(plan).items()},
        tuple(figures),
    )
