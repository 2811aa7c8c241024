"""One process that times the tracker: what it needs to start, then every stage of every frame of a clip.

    python -m tests.evaluation.hybrid.stage_times CLIPS OUT CLIP VIEWS THREADS [--start-only]

Prints JSON.  VIEWS: names joined by commas, or `all`.  It is a process of its own so that a cold start can be seen.
"""

import time

BEGUN = time.perf_counter()

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

from services.tracker import filtering, tracking  # noqa: E402
from services.tracker.prior.file import read_prior  # noqa: E402
from services.tracker.prior.shipped import find_prior  # noqa: E402
from services.tracker.ready import load_compiled  # noqa: E402
from tests.evaluation.hybrid.priors import KINDS  # noqa: E402
from tests.evaluation.hybrid.runs import ANATOMY, Case, setup_of  # noqa: E402
from tests.evaluation.hybrid.silhouettes import load_clip  # noqa: E402

P = ParamSpec("P")
R = TypeVar("R")

STAGES: dict[str, tuple[tuple[object, str], ...]] = {
    "contours and hull": ((tracking, "outlines"), (tracking, "without"), (tracking, "scene_of"), (tracking, "rays_of")),
    "room": ((tracking, "room_of"),),
    "agreement": ((tracking, "watch"), (tracking, "untrusted")),
    "particles": ((filtering, "draw"), (filtering, "advance"), (filtering, "weighted")),
    "estimate": ((filtering, "_estimate"), (filtering, "explained"), (filtering, "_outcome")),
    "learning the body": ((filtering, "_learn"),),
}
REST = "rest"


class Stopwatch:
    """Seconds by stage since the last `take`; a stage inside a stage counts for the outer one."""

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
    """The tracker's stages are timed while this is open."""
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
    imported_s = time.perf_counter() - BEGUN
    cv2.setNumThreads(options.threads)
    numba.set_num_threads(options.threads)
    clip = load_clip(options.clips / options.clip, options.out / "silhouettes")
    views = () if options.views == "all" else tuple(options.views.split(","))
    prior = read_prior(find_prior(KINDS[options.clip]), ANATOMY)
    setup = setup_of(clip, Case(clip.name, views=views), prior)
    begun = time.perf_counter()
    load_compiled(setup)
    ready_s = time.perf_counter() - begun
    said: dict[str, object] = {
        "imported_s": imported_s, "ready_s": ready_s, "load": os.getloadavg()[0], "threads": numba.get_num_threads()
    }  # fmt: skip
    if not options.start_only:
        watch, state = Stopwatch(), tracking.initial_state(setup)
        rows: dict[str, list[float]] = {stage: [] for stage in (*STAGES, REST, "whole")}
        with timing(watch):
            for instant in clip.instants:
                masks = clip.masks(instant, setup.cameras)
                started = time.perf_counter()
                state, outcome = tracking.follow(setup, state, instant.captured_ns, masks)
                whole, seconds = time.perf_counter() - started, watch.take()
                if outcome.pose is None or instant.frame < clip.motion_from:
                    continue
                for stage in STAGES:
                    rows[stage].append(1e3 * seconds.get(stage, 0.0))
                rows[REST].append(1e3 * (whole - sum(seconds.values())))
                rows["whole"].append(1e3 * whole)
        said["median_ms"] = {stage: float(np.median(values)) for stage, values in rows.items()}
        said["p99_ms"] = {stage: float(np.percentile(values, 99)) for stage, values in rows.items()}
        said["mean_ms"] = {stage: float(np.mean(values)) for stage, values in rows.items()}
    print(json.dumps(said))


if __name__ == "__main__":
    main()
