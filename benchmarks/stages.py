"""Time of a viewer per frame, by stage, from the colour frame to the partial BAP, on one core.

    python -m benchmarks.stages [--takes N]

`whole` is the sum of the two steps of a frame: on the frame (silhouette, sighting) and on the assignment (limbs).
Only frames with a partial BAP of every viewer count.  Targets for its median: 2 ms at 160 x 120, 8 ms at 640 x 480.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from time import perf_counter
from typing import ParamSpec, TypeVar
from unittest.mock import patch

import cv2
import numpy as np
from benchmarks.takes import FPS, LARGE, SMALL, VIEWERS, Film, Size, default_folder, film, takes

from benchmarks import loop
from benchmarks.table import table
from zenocap.common.messages import PartialBap
from zenocap.common.rig.sources import FirstFrames
from zenocap.services.viewer import segmentation
from zenocap.services.viewer import step as viewer_step
from zenocap.services.viewer.frame import Frame

P = ParamSpec("P")
R = TypeVar("R")

# Module that calls a function of a stage, name of the function, and the stage.
CALLS = (
    (segmentation, "extract", "silhouette"),
    (segmentation, "update", "background"),
    (viewer_step, "sighting", "sighting"),
    (viewer_step, "limbs", "limbs"),
)
STAGES = tuple(stage for _, _, stage in CALLS)
WHOLE = "whole"
TARGETS_MS = {SMALL: 2.0, LARGE: 8.0}
POSTURES = ("march", "raise-both-arms-bent", "squat", "kick-right")


class Stopwatch:
    """Elapsed time (s) by stage since the last `take`."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def timed(self, stage: str, function: Callable[P, R]) -> Callable[P, R]:
        def run(*args: P.args, **kwargs: P.kwargs) -> R:
            started = perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - started

        return run

    def take(self) -> dict[str, float]:
        seconds, self.seconds = self.seconds, {}
        return seconds


@contextmanager
def timing(watch: Stopwatch) -> Iterator[None]:
    """Time the viewer's stages and its whole step while the context is open."""
    with ExitStack() as stack:
        for module, name, stage in CALLS:
            stack.enter_context(patch.object(module, name, watch.timed(stage, getattr(module, name))))
        stack.enter_context(patch.object(viewer_step, "step", watch.timed(WHOLE, viewer_step.step)))
        yield


def timed_frames(rendered: Film, fps: float) -> list[dict[str, float]]:
    """Time (s) by stage, per viewer, of every frame that both viewers tracked."""
    watch = Stopwatch()
    with timing(watch):
        tracker = loop.Loop(rendered.cameras, {id: FirstFrames(rendered.empty) for id in rendered.cameras}, fps)
        rows = []
        for k in range(len(rendered.truths)):
            captured_ns = loop.EPOCH_NS + round(k * 1e9 / fps)
            messages = tracker.feed({id: Frame(k, captured_ns, images[k]) for id, images in rendered.images.items()})
            seconds = watch.take()
            if sum(isinstance(message, PartialBap) for message in messages) == len(VIEWERS):
                rows.append({stage: seconds.get(stage, 0.0) / len(VIEWERS) for stage in (*STAGES, WHOLE)})
    return rows


def measure(size: Size, count: int) -> list[tuple[str | float, ...]]:
    chosen = [take for take in takes(0, 1, POSTURES[:count], size) if take.number == 0]
    films = [film(take, default_folder() if size == SMALL else None) for take in chosen]
    timed_frames(films[0], FPS)  # compiles the kernels
    rows = [row for rendered in films for row in timed_frames(rendered, FPS)]
    table_rows: list[tuple[str | float, ...]] = []
    for stage in (*STAGES, WHOLE):
        ms = 1000.0 * np.array([row[stage] for row in rows])
        target = TARGETS_MS[size] if stage == WHOLE else ""
        name = f"{size[0]}x{size[1]} {stage}"
        table_rows.append((name, len(rows), float(np.median(ms)), float(np.quantile(ms, 0.9)), float(ms.mean()), target))
    return table_rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--takes", type=int, default=len(POSTURES), help=f"1 to {len(POSTURES)}")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows = [row for size in (SMALL, LARGE) for row in measure(size, options.takes)]
    print(
        table("A viewer's time per frame, one core", ("stage", "frames", "median ms", "p90 ms", "mean ms", "target"), rows)
    )


if __name__ == "__main__":
    main()
