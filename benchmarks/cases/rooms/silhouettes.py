"""Overlap with the true silhouette in rooms that change, by situation and background method."""

from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, median
from time import perf_counter

import cv2
import numpy as np

from benchmarks.cases.rooms.film import RoomScene, shots
from benchmarks.cases.rooms.situations import SITUATIONS
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import size_of
from zenocap.common.arrays import Floats32, Mask
from zenocap.common.rig.sources import parse_background
from zenocap.common.vision.semantics import Semantics
from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.people.network import load_network
from zenocap.services.viewer.people.segmenter import PeopleSegmenter
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, ViewerSetup

SETTLED_S = 2.0  # after the person came into view
UNUSABLE = 0.6  # overlap
SMALLEST = 0.004  # of the image: a person of less is not measured
FIRST_SEED = 50  # constants of `adaptive` were chosen on 0 to 3, 20 to 25 and 55
METHODS = ("first:60", "median", "mog2", "adaptive")
NAMED = {one.name: one for one in SITUATIONS}


class LatePeople(PeopleSegmenter):
    """The network, with results that come one frame after the question."""

    last: Semantics | None = None

    def latest(self, frame: Frame, room: Floats32 | None, person: Extents | None) -> Semantics | None:
        before, self.last = self.last, super().latest(frame, room, person)
        return before


@dataclass
class OverlapScore:
    """Overlaps of silhouettes with the true ones, and distances of their edges, px."""

    overlaps: list[float] = field(default_factory=list)
    edges: list[float] = field(default_factory=list)

    def add(self, found: Mask | None, truth: Mask) -> None:
        """found: None for an empty one."""
        if np.count_nonzero(truth) >= SMALLEST * truth.size:
            mask = np.zeros_like(truth) if found is None else found
            self.overlaps.append(overlap(mask, truth))
            self.edges.append(edge_px(mask, truth))

    def figures(self) -> dict[str, float]:
        unusable = np.mean(np.array(self.overlaps) < UNUSABLE)
        return {"overlap": mean(self.overlaps), "edge": mean(self.edges), "unusable": 100.0 * float(unusable)}


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


def run(one: Case) -> Figures:
    """Figures of one seed.  Options: method, one of METHODS or that with `+people`; size."""
    return _segmented(one)[0].figures()


def run_timed(one: Case) -> Figures:
    """Time of a frame, median (ms).  Options: as of `run`."""
    return {"time": 1e3 * median(_segmented(one)[1])}


def _segmented(one: Case) -> tuple[OverlapScore, list[float]]:
    """Score of the silhouettes of a film, and the times of its frames, seconds."""
    scene = RoomScene(FIRST_SEED + one.seed, size_of(one.option("size", "320x240")))
    film = list(shots(scene, NAMED[one.film]))  # rendered before anything is timed
    background, _, people = one.option("method", "adaptive").partition("+")
    segmenter = LatePeople(load_network(), threaded=False) if people else None
    setup = ViewerSetup("cam01", scene.camera, parse_background(background, Path()), people=segmenter)
    state, place = LearningBackground(), None
    score, times = OverlapScore(), list[float]()
    for number, shot in enumerate(film):
        start = perf_counter()
        mask: Mask | None = None
        if place is None:
            state, place = learn(setup, state, shot.image)
        else:
            place, mask, _ = segment(setup, place, Frame(number, round(shot.time_s * 1e9), shot.image))
            times.append(perf_counter() - start)
        if shot.time_s >= NAMED[one.film].first_s + SETTLED_S:
            score.add(mask, shot.truth)
    return score, times


OVERLAP = (Quantity("overlap", "", 3, "low"), Quantity("edge", "px"), Quantity("unusable", "%", 0))
ROOMS = Kind(
    "rooms",
    "Simulated people walk in a room for 25 s, 320×240, 15 frames/s; each situation changes one thing, at 12 s where it "
    "is sudden. Overlap (intersection over union) with the true silhouette from 2 s after the person is in view; edge: "
    "mean distance of the outline from the true one; unusable: frames with an overlap below 0.6.",
    run,
    OVERLAP,
    {f"{name}, {method}": case(name, method=method) for name in NAMED for method in METHODS}
    | {f"{name}, adaptive+people": case(name, method="adaptive+people") for name in NAMED},
    case("empty room first", size="160x120"),
    seeds=12,
    rows="situation, background",
)
FRAME_TIMES = Kind(
    "room-times",
    "Time of a frame of one camera, colour image to silhouette, on one core.",
    run_timed,
    (Quantity("time", "ms", 1, joined="median"),),
    {
        f"{method}, {size}": case("empty room first", method=method, size=size)
        for method in ("first:60", "adaptive")
        for size in ("640x480", "1280x720")
    },
    case("empty room first", size="160x120"),
    rows="background, size",
    timed=True,
)
