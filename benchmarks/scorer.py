"""The tri-tree with the incremental scorer against the same search with a full-frame scorer in numpy.

    python -m benchmarks.scorer [--searches N]

The full-frame scorer draws all ten parts into an empty mask for every match (OpenCV fills the outlines) and counts all
pixels (`zenocap.common.vision.model_image`).  Same searches, same control flow; medians over the searches.
"""

import argparse
from collections.abc import Callable
from time import perf_counter
from unittest.mock import patch

import cv2
import numpy as np

from benchmarks.situations import SearchResult, Situation, record
from benchmarks.table import table
from benchmarks.takes import LARGE, SMALL, Size, default_folder, takes
from zenocap.common.arrays import Floats
from zenocap.common.vision.model_image import CORNERS, matching_score, part_outline
from zenocap.services.viewer import limb_search
from zenocap.services.viewer.limb_search import CoverImage, LimbBody, is_allowed, segment_frame, turn_limb

POSTURES = ("march", "raise-both-arms-bent", "squat", "swing-right-arm")
TARGET = 50.0
ROUNDS = 5


class FullFrame:
    """The full-frame scorer of one situation, to stand in for `limb_search.limb_score`."""

    def __init__(self, situation: Situation) -> None:
        self.situation = situation
        self.canvas = np.zeros_like(situation.image.mask)

    def score(self, directions: Floats, axis: Floats, what: int, angle: float, limb: LimbBody, image: CoverImage) -> float:
        trial = np.empty((2, 3))
        turn_limb(directions, axis, what, angle, trial)
        if not is_allowed(trial, limb.is_leg):
            return -1.0
        every = self.situation.directions.copy()
        every[self.situation.limb] = trial
        self._draw(every)
        return matching_score(image.mask, self.canvas)

    def _draw(self, directions: Floats) -> None:
        s = self.situation
        self.canvas[:] = 0
        torso = np.column_stack([s.torso_to_world, s.position])
        self._fill(torso, s.model.torso)
        self._fill(np.column_stack([s.torso_to_world, s.position + s.torso_to_world @ s.model.neck]), s.model.head)
        for k in range(len(directions)):
            origin = s.position + s.torso_to_world @ s.model.origins[k]
            for part in range(2):
                frame = np.empty((3, 4))
                segment_frame(origin, directions[k, part], s.torso_to_world, frame)
                self._fill(frame, s.model.limbs[k, part])
                origin = origin + s.model.limbs[k, part, 0] * frame[:, 1]

    def _fill(self, frame: Floats, size: Floats) -> None:
        corners = np.empty((CORNERS, 2))
        if part_outline(np.ascontiguousarray(frame), size, self.situation.image.camera, corners):
            cv2.fillConvexPoly(self.canvas, np.rint(corners).astype(np.int32), 1)


def full_frame_search(situation: Situation) -> SearchResult:
    s = situation
    with patch.object(limb_search, "limb_score", FullFrame(s).score):
        interpreted: Callable[..., SearchResult] = limb_search.tri_tree.py_func  # type: ignore[attr-defined]
        return interpreted(s.directions[s.limb], s.axis, s.what, s.region, s.body, s.image)


def measure(size: Size, searches: int) -> tuple[str | int | float, ...]:
    chosen = [t for t in takes(0, 1, POSTURES, size) if t.number == 0]
    kept = record(chosen, default_folder() if size == SMALL else None, 40)
    kept = kept[:: max(1, len(kept) // searches)]
    kept[0].tri_tree()
    fast, slow, matchings = [], [], []
    for situation in kept:
        started = perf_counter()
        for _ in range(ROUNDS):
            situation.tri_tree()
        fast.append((perf_counter() - started) / ROUNDS)
        started = perf_counter()
        matchings.append(full_frame_search(situation)[2])
        slow.append(perf_counter() - started)
    ratios = np.array(slow) / np.array(fast)
    return (
        f"{size[0]}x{size[1]}", len(kept), 1e6 * float(np.median(fast)), 1e6 * float(np.median(slow)),
        1e6 * float(np.median(np.array(fast) / matchings)), 1e6 * float(np.median(np.array(slow) / matchings)),
        float(np.median(ratios)), float(ratios.min()), TARGET,
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--searches", type=int, default=400, help="at least (default 400)")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    columns = (
        "size", "searches", "tri-tree us", "numpy us", "per match us", "numpy us", "ratio", "least", "target"
    )  # fmt: skip
    rows = [measure(size, options.searches) for size in (SMALL, LARGE)]
    print(table("One tri-tree search: incremental scorer against a full-frame scorer", columns, rows))


if __name__ == "__main__":
    main()
