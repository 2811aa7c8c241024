"""Times of the tracker in one process: start, then every stage of every frame of a clip.

    python -m benchmarks.hybrid.stage_times CLIPS OUT CLIP VIEWS THREADS [--start-only]

Prints JSON.  VIEWS: names joined by commas, or `all`.  Runs in a separate process, so that a cold start can be measured.
"""

import time

PROCESS_START_S = time.perf_counter()

import argparse  # noqa: E402
import json  # noqa: E402
import os  # noqa: E402
from collections.abc import Callable, Iterator  # noqa: E402
from contextlib import ExitStack, contextmanager  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import ParamSpec, TypeVar  # noqa: E402
from unittest.mock import patch  # noqa: E402

import cv2  # noqa: E402
import numba  # noqa: E402
import numpy as np  # noqa: E402

from benchmarks.hybrid.priors import KINDS  # noqa: E402
from benchmarks.hybrid.runs import ANATOMY, Case, setup_of  # noqa: E402
from benchmarks.hybrid.silhouettes import load_clip  # noqa: E402
from zenocap.services.tracker import tracking  # noqa: E402
from zenocap.services.tracker.filter import filter_step  # noqa: E402
from zenocap.services.tracker.jit_warmup import load_compiled  # noqa: E402
from zenocap.services.tracker.prior.file import find_prior, read_prior  # noqa: E402

P = ParamSpec("P")
R = TypeVar("R")

STAGES: dict[str, tuple[tuple[object, str], ...]] = {
    "contours and hull": (
        (tracking, "extract_outlines"),
        (tracking, "exclude_views"),
        (tracking, "scene_from"),
        (tracking, "contour_rays"),
    ),
    "silhouette distance": ((tracking, "distance_field"),),
    "view consistency": ((tracking, "check_views"), (tracking, "untrusted")),
    "particles": (
        (filter_step, "draw_samples"),
        (filter_step, "propose_particles"),
        (filter_step, "refine_particles"),
        (filter_step, "likelihood_weights"),
    ),
    "estimate": ((filter_step, "_estimate"), (filter_step, "support_fraction"), (filter_step, "_outcome")),
    "online shape": ((filter_step, "_update_shape"),),
}
REST = "rest"


class Stopwatch:
    """Seconds by stage since the last `take`; a stage within a stage counts for the outer one."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.busy = False

    def timed(self, stage: str, function: Callable[P, R]) -> Callable[P, R]:
        def run(*args: P.args, **kwargs: P.kwargs) -> R:
            if self.busy:
                return function(*args, **kwargs)
            self.busy, started = True, time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self.busy = False
                self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - started

        return run

    def take(self) -> dict[str, float]:
        seconds, self.seconds = self.seconds, {}
        return seconds


@contextmanager
def timing(watch: Stopwatch) -> Iterator[None]:
    """Time the tracker's stages within the context."""
    with ExitStack() as stack:
        for stage, functions in STAGES.items():
            for module, name in functions:
                stack.enter_context(patch.object(module, name, watch.timed(stage, getattr(module, name))))
        yield


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("clip")
    parser.add_argument("views")
    parser.add_argument("threads", type=int)
    parser.add_argument("--start-only", action="store_true")
    options = parser.parse_args()
    imported_s = time.perf_counter() - PROCESS_START_S
    cv2.setNumThreads(options.threads)
    numba.set_num_threads(options.threads)
    clip = load_clip(options.clips / options.clip, options.out / "silhouettes")
    views = () if options.views == "all" else tuple(options.views.split(","))
    prior = read_prior(find_prior(KINDS[options.clip]), ANATOMY)
    setup = setup_of(clip, Case(clip.name, views=views), prior)
    load_start_s = time.perf_counter()
    load_compiled(setup)
    ready_s = time.perf_counter() - load_start_s
    result: dict[str, object] = {
        "imported_s": imported_s, "ready_s": ready_s, "load": os.getloadavg()[0], "threads": numba.get_num_threads()
    }  # fmt: skip
    if not options.start_only:
        watch, state = Stopwatch(), tracking.initial_state(setup)
        rows: dict[str, list[float]] = {stage: [] for stage in (*STAGES, REST, "whole")}
        with timing(watch):
            for instant in clip.instants:
                masks = clip.masks(instant, setup.cameras)
                started = time.perf_counter()
                state, outcome = tracking.track(setup, state, instant.captured_ns, masks)
                whole, seconds = time.perf_counter() - started, watch.take()
                if outcome.pose is None or instant.frame < clip.motion_from:
                    continue
                for stage in STAGES:
                    rows[stage].append(1e3 * seconds.get(stage, 0.0))
                rows[REST].append(1e3 * (whole - sum(seconds.values())))
                rows["whole"].append(1e3 * whole)
        result["median_ms"] = {stage: float(np.median(values)) for stage, values in rows.items()}
        result["p99_ms"] = {stage: float(np.percentile(values, 99)) for stage, values in rows.items()}
        result["mean_ms"] = {stage: float(np.mean(values)) for stage, values in rows.items()}
    print(json.dumps(result))


if __name__ == "__main__":
    main()
