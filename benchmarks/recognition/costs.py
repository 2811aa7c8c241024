"""Cost of recognition: time per window, per pose of a stream and of training, and memory over an hour."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.recognition.bench import SETTINGS_SEED, Bench
from benchmarks.recognition.streaming import MODEL
from benchmarks.sections import Row, Section, Table
from zenocap.common.arrays import Floats
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.model import PostureModel, classify, log_likelihoods, symbols_of
from zenocap.services.recognizer.model_file import find_model, read_model
from zenocap.services.recognizer.stream import initial_stream, push, stream_setup
from zenocap.services.recognizer.training.examples import Example, TrainingSettings
from zenocap.services.recognizer.training.train import train

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
    train(examples, TrainingSettings(), lambda done, of, words: None)
    training_s = time.perf_counter() - begin_s
    windows = [one.features[:WINDOW] for one in examples if len(one.features) >= WINDOW // 2]
    rows: list[Row] = [
        ("a window, from features to a result", *_milliseconds(lambda k: classify(model, windows[k % len(windows)]))),
        ("log-likelihoods only", *_likelihoods(model, windows)),
    ]
    per_row, memory = _hour(model, examples)
    rows.append(("a pose of a stream", *per_row))
    return Section(
        "costs",
        "Cost of recognition",
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
    times_ms = np.empty(REPEATS)
    work(0)
    for k in range(REPEATS):
        begin_ns = time.perf_counter_ns()
        work(k)
        times_ms[k] = (time.perf_counter_ns() - begin_ns) / 1e6
    return _quantiles(times_ms)


def _quantiles(times_ms: Floats) -> tuple[str, str, str]:
    p50, p95, p99 = (f"{value:.3f}" for value in np.quantile(times_ms, (0.5, 0.95, 0.99)))
    return p50, p95, p99


def _hour(model: PostureModel, examples: list[Example]) -> tuple[tuple[str, str, str], list[Row]]:
    """Times of the poses of an hour, and memory of this process at the start and after each part."""
    plan, count = stream_setup(model), round(HOUR_S * model.rate)
    rows = np.concatenate([one.features for one in examples])
    stream, times_ms = initial_stream(plan), np.empty(count)
    stream, *_ = push(plan, stream, 0, rows[0])
    memory: list[Row] = [(0, f"{_resident_mb():.1f}")]
    for k in range(count):
        begin_ns = time.perf_counter_ns()
        stream, *_ = push(plan, stream, round((k + 1) * 1e9 / model.rate), rows[k % len(rows)])
        times_ms[k] = (time.perf_counter_ns() - begin_ns) / 1e6
        if (k + 1) % (count // PARTS) == 0:
            memory.append((round((k + 1) / model.rate / 60.0), f"{_resident_mb():.1f}"))
    return _quantiles(times_ms), memory


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
