"""Cost of recognition: time per window, per pose of a stream and of training, and memory over an hour."""

import time
from collections.abc import Callable

import numpy as np

from benchmarks.cases.recognition.examples import SETTINGS_SEED, posture_examples
from benchmarks.cases.recognition.streams import MODEL
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from zenocap.common.runtime.health import memory_bytes
from zenocap.services.recognizer.model import classify
from zenocap.services.recognizer.model_file import find_model, read_model
from zenocap.services.recognizer.stream import initial_stream, push, stream_setup
from zenocap.services.recognizer.training.examples import TrainingSettings
from zenocap.services.recognizer.training.train import train
from zenocap.tools.measure.latency import percentiles

WINDOW, REPEATS = 45, 2000  # frames: three seconds at the model's rate
HOUR_S = 3600.0


def run(one: Case) -> Figures:
    """Times of a window of three seconds, of the poses of a stream, or of training.  Options: seconds, people."""
    model = read_model(find_model(MODEL))
    examples = posture_examples("truth", SETTINGS_SEED, count=one.option("people", 12))
    if one.film == "training":
        start_s = time.perf_counter()
        train(examples, TrainingSettings())
        return {"median": 1e3 * (time.perf_counter() - start_s)}
    if one.film == "window":
        windows = [each.features[:WINDOW] for each in examples if len(each.features) >= WINDOW // 2]
        return _milliseconds(lambda k: classify(model, windows[k % len(windows)]), REPEATS)
    plan, rows = stream_setup(model), np.concatenate([each.features for each in examples])
    stream, *_ = push(plan, initial_stream(plan), 0, rows[0])

    def next_pose(k: int) -> None:
        nonlocal stream
        stream, *_ = push(plan, stream, round((k + 1) * 1e9 / model.rate), rows[k % len(rows)])

    before_mb = 1e-6 * memory_bytes()
    found = _milliseconds(next_pose, round(one.option("seconds", HOUR_S) * model.rate))
    after_mb = 1e-6 * memory_bytes()
    return found | {"memory": after_mb, "growth": after_mb - before_mb}


def _milliseconds(work: Callable[[int], object], repeats: int) -> dict[str, float]:
    times_ms = np.empty(repeats)
    for k in range(repeats):
        begin_ns = time.perf_counter_ns()
        work(k)
        times_ms[k] = (time.perf_counter_ns() - begin_ns) / 1e6
    found = percentiles(times_ms)
    return {"median": found["p50"], "p95": found["p95"], "p99": found["p99"]}


COSTS = Kind(
    "recognition-costs",
    "Time of one window of three seconds against fifteen postures, of one pose of a stream of an hour, and of training on "
    "360 examples; memory of the process at the end of the hour, and its growth.",
    run,
    (
        *(Quantity(name, "ms", 2, joined="median") for name in ("median", "p95", "p99")),
        Quantity("memory", "MB", 0),
        Quantity("growth", "MB", 1),
    ),
    {name: case(name) for name in ("window", "stream", "training")},
    case("stream", seconds=20.0, people=1),
    rows="what",
    timed=True,
)
