"""Overlap with the true silhouette in rooms that change, by situation and background method."""

from pathlib import Path
from time import perf_counter

import cv2
import numpy as np

from benchmarks.cases.rooms.film import EMPTY_S, RoomFrame, RoomScene, shots
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


def run(one: Case) -> dict[str, float]:
    """Figures of one seed.  Options: method, one of METHODS or that with `+people`; size."""
    scene = RoomScene(FIRST_SEED + one.seed, size_of(one.option("size", "320x240")))
    situation = NAMED[one.film]
    seen_s = (EMPTY_S if situation.empty else 0.0) + SETTLED_S
    return frame_errors(list(shots(scene, situation)), scene, one.option("method", "adaptive"), seen_s)


def run_silhouettes(one: Case) -> Figures:
    """Without the time.  Options: as of `run`."""
    return {name: value for name, value in run(one).items() if name != "time"}


def run_timed(one: Case) -> Figures:
    """Time of a frame, median (ms).  Options: as of `run`."""
    return {"time": run(one)["time"]}


def frame_errors(film: list[RoomFrame], scene: RoomScene, method: str, seen_s: float) -> dict[str, float]:
    background, _, people = method.partition("+")
    segmenter = LatePeople(load_network(), threaded=False) if people else None
    setup = ViewerSetup("cam01", scene.camera, parse_background(background, Path()), people=segmenter)
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
    return {
        "overlap": float(np.mean(found)),
        "edge": float(np.mean(edges)),
        "unusable": 100.0 * float(np.mean(np.array(found) < UNUSABLE)),
        "time": 1e3 * float(np.median(times)),
    }


OVERLAP = (Quantity("overlap", "", 3, "low"), Quantity("edge", "px"), Quantity("unusable", "%", 0))
ROOMS = Kind(
    "rooms",
    "Simulated people walk in a room for 25 s, 320×240, 15 frames/s; each situation changes one thing, at 12 s where it "
    "is sudden. Overlap (intersection over union) with the true silhouette from 2 s after the person is in view; edge: "
    "mean distance of the outline from the true one; unusable: frames with an overlap below 0.6.",
    run_silhouettes,
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
