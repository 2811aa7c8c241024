"""A viewer's time per frame by stage, from the colour frame to the partial BAP, on one core.

    python -m tests.evaluation.stages [--takes N]

`whole` is what the two steps of a frame take together: the frame's (silhouette, sighting) and the assignment's (limbs).
Only frames that end in a partial BAP count.  Targets for its median: 2 ms at 160 x 120, 8 ms at 640 x 480.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from time import perf_counter
from typing import ParamSpec, TypeVar
from unittest.mock import patch

import cv2
import numpy as np

from common.messages import PartialBap
from common.runtime.specs import FirstFrames
from services.viewer import step as viewer_step
from services.viewer.sources.frame import Frame
from tests.evaluation import loop
from tests.evaluation.table import table
from tests.evaluation.takes import FPS, LARGE, SMALL, VIEWERS, Film, Size, default_folder, film, takes

P = ParamSpec("P")
R = TypeVar("R")

STAGES = {"extract": "silhouette", "update": "background", "sighting": "sighting", "limbs": "limbs"}
WHOLE = "whole"
TARGETS_MS = {SMALL: 2.0, LARGE: 8.0}
POSTURES = ("march", "raise-both-arms-bent", "squat", "kick-right")


class Stopwatch:
    """Seconds by stage since the last `take`."""

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
    """The viewer's stages and its whole step are timed while this is open."""
    with ExitStack() as stack:
        for name, stage in STAGES.items():
            stack.enter_context(patch.object(viewer_step, name, watch.timed(stage, getattr(viewer_step, name))))
        stack.enter_context(patch.object(viewer_step, "step", watch.timed(WHOLE, viewer_step.step)))
        yield


def timed_frames(shot: Film, fps: float) -> list[dict[str, float]]:
    """Seconds by stage, per viewer, of every frame that both viewers tracked."""
    watch = Stopwatch()
    with timing(watch):
        tracker = loop.Loop(shot.cameras, {id: FirstFrames(shot.empty) for id in shot.cameras}, fps)
        rows = []
        for k in range(len(shot.truths)):
            captured_ns = loop.EPOCH_NS + round(k * 1e9 / fps)
            said = tracker.feed({id: Frame(k, captured_ns, images[k]) for id, images in shot.images.items()})
            seconds = watch.take()
            if sum(isinstance(message, PartialBap) for message in said) == len(VIEWERS):
                rows.append({stage: seconds.get(stage, 0.0) / len(VIEWERS) for stage in (*STAGES.values(), WHOLE)})
    return rows


def measure(size: Size, count: int) -> list[tuple[str | float, ...]]:
    chosen = [take for take in takes(0, 1, POSTURES[:count], size) if take.number == 0]
    films = [film(take, default_folder() if size == SMALL else None) for take in chosen]
    timed_frames(films[0], FPS)  # what is compiled on first use
    rows = [row for shot in films for row in timed_frames(shot, FPS)]
    table_rows: list[tuple[str | float, ...]] = []
    for stage in (*STAGES.values(), WHOLE):
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
