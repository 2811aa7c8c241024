"""What recognition costs: a window, a pose of a stream, training, and memory over an hour."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from common.body.anatomy import Floats
from services.recognizer.features import DEFAULT
from services.recognizer.file import find_model, read_model
from services.recognizer.model import PostureModel, judge, log_likelihoods, symbols_of
from services.recognizer.stream import beginning, heard, plan_of
from services.recognizer.training import Example, Plan, train
from tests.evaluation.recognition.bench import SETTINGS_SEED, Bench
from tests.evaluation.recognition.streaming import MODEL
from tests.evaluation.sections import Row, Section, Table

WINDOW, REPEATS = 45, 2000  # frames: three seconds at the model's rate
HOUR_S, PARTS = 3600.0, 6
BUDGET_MS = 1.0


def costs(bench: Bench) -> Section:
    model = read_model(find_model(MODEL))
    examples = bench.examples("truth", SETTINGS_SEED, DEFAULT)
    notes = (
        f"The model {MODEL!r}: {len(model.labels)} postures. Windows of {WINDOW} frames, {REPEATS} times; the budget is "
        f"{BUDGET_MS:g} ms a window. The stream is the examples' true angles one after the other, an hour at the model's "
        "rate.",
    )
    begin_s = time.perf_counter()
    train(examples, Plan(), lambda done, of, words: None)
    training_s = time.perf_counter() - begin_s
    windows = [one.features[:WINDOW] for one in examples if len(one.features) >= WINDOW // 2]
    rows: list[Row] = [
        ("a window, from features to a judgement", *_milliseconds(lambda k: judge(model, windows[k % len(windows)]))),
        ("of that the log-likelihoods", *_likelihoods(model, windows)),
    ]
    per_row, memory = _hour(model, examples)
    rows.append(("a pose of a stream", *per_row))
    return Section(
        "costs",
        "What recognition costs",
        (*notes, f"Training {len(examples)} examples with thresholds: {training_s:.1f} s."),
        (
            Table("Milliseconds", ("what", "median", "p95", "p99"), tuple(rows)),
            Table("Memory", ("minutes", "resident MB"), tuple(memory)),
        ),
    )


def _likelihoods(model: PostureModel, windows: list[Floats]) -> tuple[str, str, str]:
    symbols = [symbols_of(model, window) for window in windows]
    return _milliseconds(lambda k: log_likelihoods(model, symbols[k % len(symbols)]))


def _milliseconds(work: Callable[[int], object]) -> tuple[str, str, str]:
    taken = np.empty(REPEATS)
    work(0)
    for k in range(REPEATS):
        begin_ns = time.perf_counter_ns()
        work(k)
        taken[k] = (time.perf_counter_ns() - begin_ns) / 1e6
    return _quantiles(taken)


def _quantiles(taken: Floats) -> tuple[str, str, str]:
    p50, p95, p99 = (f"{value:.3f}" for value in np.quantile(taken, (0.5, 0.95, 0.99)))
    return p50, p95, p99


def _hour(model: PostureModel, examples: list[Example]) -> tuple[tuple[str, str, str], list[Row]]:
    """Times of its poses, and the memory of this process at its beginning and after each part."""
    plan, count = plan_of(model), round(HOUR_S * model.rate)
    rows = np.concatenate([one.features for one in examples])
    stream, taken = beginning(plan), np.empty(count)
    stream, *_ = heard(plan, stream, 0, rows[0])
    memory: list[Row] = [(0, f"{_resident_mb():.1f}")]
    for k in range(count):
        begin_ns = time.perf_counter_ns()
        stream, *_ = heard(plan, stream, round((k + 1) * 1e9 / model.rate), rows[k % len(rows)])
        taken[k] = (time.perf_counter_ns() - begin_ns) / 1e6
        if (k + 1) % (count // PARTS) == 0:
            memory.append((round((k + 1) / model.rate / 60.0), f"{_resident_mb():.1f}"))
    return _quantiles(taken), memory


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
