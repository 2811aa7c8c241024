"""What each part of the adaptive background brings: overlap without it, less that with all parts, by situation.

    python -m benchmarks.rooms.ablation [--seeds 6] [--first-seed 0] [--size 320x240] [--parts NAME,...] [--only NAME,...]

Overlap as of `benchmarks.rooms`, mean of the seeds; below 0: the part helps.  In brackets the difference of the seed in
which it is farthest from 0.  Parts:

gain: one gain per channel and frame.  relight: a new mean after a sudden change.  settling: first frames in one light.
visits: the mean follows what is seen.  uncovered, put-down, beside, faint: regions are learnt that have no outline now,
that do not change, that move away from the person, that are small.  hold: a person who does not change is not learnt.
previous: the person is at the place of the last silhouette.  margin: nothing is learnt around the person.  halo: noise
around the person, as of compression.
"""

import argparse
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from multiprocessing import Pool
from typing import Any
from unittest.mock import patch

import cv2
import numpy as np

from benchmarks.rooms.__main__ import SETTLED_S, frame_errors
from benchmarks.rooms.film import EMPTY_S, Scene, shots
from benchmarks.rooms.situations import SITUATIONS
from benchmarks.table import table
from zenocap.common.arrays import Floats32, Image, Mask
from zenocap.common.vision import background
from zenocap.common.vision.adaptive import follow, judgement, model
from zenocap.common.vision.adaptive.learning import LATER, LEARN, NEVER, learn_still, visit
from zenocap.common.vision.silhouette import Silhouette

ALL = "all parts"
_verdicts = judgement._verdicts


def _one_gain(*_: object) -> Floats32:
    return np.ones(3, np.float32)


def _visit_without_mean(frame: Image, labels: Mask, held: Mask, *others: Any) -> None:
    visit(frame, labels, np.ones_like(held), *others)


def _learn_large(frame: Image, labels: Mask, learnt: Mask, *others: Any) -> None:
    learn_still(frame, labels, np.where(learnt == LATER, np.uint8(NEVER), learnt), *others)


def _nothing_put_down(*arguments: Any) -> tuple[Mask, int, float]:
    verdicts, chosen, alive_s = _verdicts(*arguments)
    with patch.object(judgement, "OTHER_GAP", np.inf):
        still = _verdicts(*arguments)[0] == LEARN
    return np.where(still, np.uint8(NEVER), verdicts), chosen, alive_s


def _own_pixels(shape: tuple[int, ...], silhouette: Silhouette | None) -> Mask:
    return np.zeros(shape, np.uint8) if silhouette is None else silhouette.mask.astype(np.uint8)


# Of each part: module, name, and what stands there without the part.
PARTS: Mapping[str, tuple[Any, str, object]] = {
    "gain": (background, "gains", _one_gain),
    "relight": (follow, "relit", lambda *_: None),
    "settling": (model, "_in_one_light", list),
    "visits": (follow, "visit", _visit_without_mean),
    "uncovered": (judgement, "EDGE_RATIO", np.inf),
    "put-down": (judgement, "_verdicts", _nothing_put_down),
    "beside": (judgement, "OTHER_GAP", np.inf),
    "faint": (judgement, "learn_still", _learn_large),
    "hold": (judgement, "HOLD_S", 0.0),
    "previous": (judgement, "PREVIOUS_SHARE", -1.0),
    "margin": (follow, "_widened", _own_pixels),
    "halo": (follow, "_halo", lambda *_: 1.0),
}


def without(part: str) -> ExitStack:
    """Context in which a part of the adaptive background is off; `ALL`: none."""
    stack = ExitStack()
    if part != ALL:
        stack.enter_context(patch.object(*PARTS[part]))
    return stack


def overlaps(job: tuple[int, str], size: tuple[int, int], parts: Sequence[str]) -> list[float]:
    """Mean overlap of a seed and situation without each part."""
    cv2.setNumThreads(1)
    seed, name = job
    scene = Scene(seed, size)
    situation = next(one for one in SITUATIONS if one.name == name)
    film = list(shots(scene, situation))
    seen_s = (EMPTY_S if situation.empty else 0.0) + SETTLED_S
    found = []
    for part in parts:
        with without(part):
            found.append(frame_errors(film, scene, "adaptive", seen_s)[0])
    return found


def rows(names: Sequence[str], seeds: Sequence[int], found: Mapping[tuple[int, str], list[float]]) -> list[list[str]]:
    """Cells of the table: situation, overlap with all parts, change without each."""
    cells = []
    for name in names:
        of = np.array([found[seed, name] for seed in seeds])
        row = [name, f"{of[:, 0].mean():.3f}"]
        for column in (of[:, 1:] - of[:, :1]).T:
            farthest = column[np.argmax(np.abs(column))]
            row.append("0" if abs(farthest) < 5e-4 else f"{column.mean():+.3f} ({farthest:+.3f})")
        cells.append(row)
    return cells


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--parts", default=",".join(PARTS), metavar="NAME,...")
    parser.add_argument("--only", default="", help="situations whose name contains one of these, separated by commas")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    parts = options.parts.split(",")
    if unknown := sorted(set(parts) - set(PARTS)):
        parser.error(f"--parts {', '.join(unknown)}: allowed: {', '.join(PARTS)}")
    names = [one.name for one in SITUATIONS if any(part in one.name for part in options.only.split(","))]
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    jobs = [(seed, name) for name in names for seed in seeds]
    with Pool(options.jobs) as pool:
        work = partial(overlaps, size=(width, height), parts=(ALL, *parts))
        found = dict(zip(jobs, pool.map(work, jobs, chunksize=1), strict=True))
    print(table("", ("situation", ALL, *parts), rows(names, seeds, found)))


if __name__ == "__main__":
    main()
