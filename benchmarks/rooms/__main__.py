"""Silhouettes in rooms that change: overlap with the true silhouette, by situation and background method.

    python -m benchmarks.rooms [--seeds 5] [--first-seed 0] [--size 320x240] [--methods adaptive,first:60] [--only NAME]

overlap: intersection over union in the frames with a person from SETTLED_S after the person has come into view, mean of the
seeds, and the mean of the worst seed in brackets.  A method with `+people` has the network of `people = true`, with results
one frame late, as live; `zenocap models add people` gets it.
edge: mean distance of the edge from the true one, px.  unusable: share
of those frames with an overlap below 0.6.  time: of a frame, median (ms).
"""

import argparse
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np

from benchmarks.rooms.film import EMPTY_S, Scene, Shot, shots
from benchmarks.rooms.situations import SITUATIONS
from benchmarks.table import table
from zenocap.common.arrays import Floats32, Mask
from zenocap.common.rig.sources import parse_background
from zenocap.common.vision.semantics import Semantics
from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.people.network import load_network
from zenocap.services.viewer.people.segmenter import PeopleSegmenter
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, viewer_setup

SETTLED_S = 2.0  # after the person came into view
UNUSABLE = 0.6  # overlap
SMALLEST = 0.004  # of the image: a person of less is not measured
COLUMNS = ("situation", "method", "overlap", "edge", "unusable", "time")
Row = tuple[float, float, float, float]


class LatePeople(PeopleSegmenter):
    """The network, with results that come one frame after the question."""

    last: Semantics | None = None

    def latest(self, frame: Frame, room: Floats32 | None, person: Extents | None) -> Semantics | None:
        before, self.last = self.last, super().latest(frame, room, person)
        return before


def overlap(a: Mask, b: Mask) -> float:
    """Intersection over union of two masks of 0 and 1."""
    union = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / union if union else 1.0


def edge_px(found: Mask, truth: Mask) -> float:
    """Mean distance of the edge of the found silhouette from that of the true one, px."""
    kernel = np.ones((3, 3), np.uint8)
    of_truth = cv2.morphologyEx(truth, cv2.MORPH_GRADIENT, kernel)
    of_found = cv2.morphologyEx(found, cv2.MORPH_GRADIENT, kernel)
    if not of_found.any() or not of_truth.any():
        return float(np.hypot(*truth.shape))
    far = cv2.distanceTransform(1 - of_truth, cv2.DIST_L2, 3)
    return float(far[of_found != 0].mean())


def measured(job: tuple[int, str], size: tuple[int, int], methods: tuple[str, ...]) -> list[Row]:
    """Of every method: mean overlap, edge (px), share of unusable frames, median time (ms) of a seed and situation."""
    cv2.setNumThreads(1)
    seed, name = job
    scene = Scene(seed, size)
    situation = next(one for one in SITUATIONS if one.name == name)
    film = list(shots(scene, situation))
    seen_s = (EMPTY_S if situation.empty else 0.0) + SETTLED_S
    return [frame_errors(film, scene, method, seen_s) for method in methods]


def frame_errors(film: list[Shot], scene: Scene, method: str, seen_s: float) -> Row:
    background, _, people = method.partition("+")
    segmenter = LatePeople(load_network(), threaded=False) if people else None
    setup = viewer_setup("cam01", scene.camera, parse_background(background, Path()), True, people=segmenter)
    state, place = LearningBackground(), None
    found, edges, times = [], [], []
    for number, shot in enumerate(film):
        start = perf_counter()
        if place is None:
            state, place = learn(setup, state, shot.image)
            mask = None
        else:
            frame = Frame(number, round(shot.time_s * 1e9), shot.image)
            place, mask, _ = segment(setup, place, frame)
            times.append(perf_counter() - start)
        if shot.time_s < seen_s or np.count_nonzero(shot.truth) < SMALLEST * shot.truth.size:
            continue
        mask = np.zeros_like(shot.truth) if mask is None else mask
        found.append(overlap(mask, shot.truth))
        edges.append(edge_px(mask, shot.truth))
    unusable = float(np.mean(np.array(found) < UNUSABLE))
    return float(np.mean(found)), float(np.mean(edges)), unusable, 1e3 * float(np.median(times))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--methods", default="first:60,median,mog2")
    parser.add_argument("--only", default="", help="situations whose name contains this")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    names = [one.name for one in SITUATIONS if options.only in one.name]
    methods = tuple(options.methods.split(","))
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    jobs = [(seed, name) for name in names for seed in seeds]
    with Pool(options.jobs) as pool:
        work = partial(measured, size=(width, height), methods=methods)
        rows = dict(zip(jobs, pool.map(work, jobs, chunksize=1), strict=True))
    cells = []
    for name in names:
        for number, method in enumerate(methods):
            of = np.array([rows[seed, name][number] for seed in seeds])
            cells.append(
                (
                    name,
                    method,
                    f"{of[:, 0].mean():.3f} ({of[:, 0].min():.3f})",
                    f"{of[:, 1].mean():.1f} ({of[:, 1].max():.1f})",
                    f"{of[:, 2].mean():.0%} ({of[:, 2].max():.0%})",
                    f"{np.median(of[:, 3]):.2f}",
                )
            )
    print(table("", COLUMNS, cells))


if __name__ == "__main__":
    main()
