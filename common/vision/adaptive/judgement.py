"""Verdicts on regions that differ from the adaptive model: person, uncovered, put down, moved.

See `zenocap.common.vision.adaptive`.
"""

from dataclasses import replace

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Floats, Floats32, Image, Ints, Ints32, Labels, Mask
from zenocap.common.jit import kernel
from zenocap.common.vision.adaptive.learning import LATER, LEARN, NEVER, SAME_SIGMAS, learn_still
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.common.vision.empty_scene import EDGE_RATIO, edges
from zenocap.common.vision.foreground import UNSURE, WEAK
from zenocap.common.vision.prediction import Prediction
from zenocap.common.vision.regions import Regions, find_regions

ALIVE_S, ALIVE_SHARE = 1.5, 0.03  # s; share of the pixels of a region; chosen by hand
HOLD_S = 60.0  # s for which the person's region is held although nothing of it changes; chosen by hand
EXPLAINED_HOLD_S = 600.0  # s of the same where the tracked body explains the region; chosen by hand
EXPLAINED_SHARE = 0.5  # of the expected body that differs, from which it explains a region; chosen by hand
BESIDE_BANDS = 1.5  # bands outside the expected body, from where a region is not explained by it; chosen by hand
OTHER_GAP = 0.15  # heights of the person, from there something else moves; chosen by hand
PREVIOUS_SHARE = 0.2  # of the largest overlap with the last silhouette, of a region of the person; chosen by hand
UNCOVERED_SHARE = 0.3  # of the outline of an uncovered region, that has an edge in the model only; chosen on five people
SMALLEST_REGION = 0.0008  # share of the image, of a region that is judged; chosen by hand


def judged(
    model: Adaptive, frame: Image, gain: Floats32, labels: Labels, time_s: float, trusted: Prediction | None
) -> Adaptive:
    """The model with the regions that differ judged and learnt; the labels of what was learnt become BACKGROUND."""
    shape, smallest = labels.shape, SMALLEST_REGION * labels.size
    differs = _joined(labels >= UNSURE)
    still = _joined((differs != 0) & (model.since_s < time_s - ALIVE_S))
    learnt = np.full(shape, LATER, dtype=np.uint8)
    # 1: what no longer moves and has an outline in the model only, also where it touches the person.
    regions = find_regions(still, 1, 1, 1, True)
    if (regions.areas >= smallest).any():
        number = _numbered(regions.runs, *shape)
        moving = cv2.dilate(((differs != 0) & (still == 0)).astype(np.uint8), np.ones((3, 3), np.uint8))
        for r in np.flatnonzero(regions.areas >= smallest):
            place, own, outline = _outline(regions, int(r), number)
            both = edges(frame[place]), edges(model.background.mean[place])
            if _is_uncovered(both, outline & (moving[place] == 0), int(np.count_nonzero(outline))):
                learnt[place][own] = LEARN
                differs[place][own] = 0
    # 2: the person, and the rest.
    regions, alive_s = find_regions(differs, 1, 1, 1, True), model.alive_s
    if len(regions.areas) > 0:
        number = _numbered(regions.runs, *shape)
        hold_s = HOLD_S if trusted is None else EXPLAINED_HOLD_S
        verdicts, chosen, alive_s = _verdicts(model, labels, regions, number, time_s, hold_s)
        learnt = np.where(number > 0, verdicts[number], learnt).astype(np.uint8)
        if trusted is not None and chosen >= 0:
            _explain(trusted, number, chosen + 1, learnt)
    same = np.float32(SAME_SIGMAS * model.noise)
    learn_still(
        frame, labels, learnt, gain, model.background.mean, model.candidate, model.since_s, np.float32(time_s), same
    )
    return replace(model, background=replace(model.background), alive_s=alive_s)


def _explain(trusted: Prediction, number: Ints32, person: int, learnt: Mask) -> None:
    """Correct the verdicts where a body is expected in the person's region, in place.

    What the body explains is never learnt, in whatever region it is; of the person's region the rest is, where it is still.
    """
    own = number == person
    beside = own.copy()
    beside[trusted.place] &= trusted.depth < -BESIDE_BANDS * trusted.band
    body = trusted.depth > 0
    if np.count_nonzero(own[trusted.place] & body) < EXPLAINED_SHARE * np.count_nonzero(body):
        return
    near = trusted.depth > -trusted.band
    learnt[beside] = LATER
    learnt[trusted.place][near & (number[trusted.place] > 0)] = NEVER


def _verdicts(
    model: Adaptive, labels: Labels, regions: Regions, number: Ints32, time_s: float, hold_s: float
) -> tuple[Mask, int, float]:
    """Verdict on every region, after one for none; the person's region, or -1; and when that last changed."""
    sums = np.zeros((3, len(regions.areas) + 1), dtype=np.int64)
    person = np.zeros(labels.shape, np.uint8) if model.person is None else model.person
    _count(number, model.since_s, person, labels, np.float32(time_s - ALIVE_S), sums)
    changed, previous, seeds = sums[:, 1:]
    large = regions.areas >= SMALLEST_REGION * labels.size
    alive = large & (changed >= ALIVE_SHARE * regions.areas)
    verdicts = np.where(large, LEARN, LATER).astype(np.uint8)
    verdicts[alive] = NEVER
    chosen, alive_s = -1, model.alive_s
    if alive.any():
        near = alive & (previous > PREVIOUS_SHARE * max(1, previous[alive].max()))
        chosen, alive_s = int(np.argmax(np.where(near if near.any() else alive, seeds, -1))), time_s
    elif previous.any() and time_s - alive_s < hold_s:
        chosen = int(np.argmax(previous))
    if chosen >= 0:
        verdicts[alive & (_gaps(regions, chosen) > OTHER_GAP)] = LEARN
        verdicts[chosen] = NEVER
    return np.concatenate([np.full(1, LATER, np.uint8), verdicts]), chosen, alive_s


def _gaps(regions: Regions, chosen: int) -> Floats:
    """Distance between the box of every region and that of the chosen one, in heights of the latter."""
    box = regions.boxes[chosen]
    across = np.maximum(regions.boxes[:, 0] - box[2], box[0] - regions.boxes[:, 2])
    down = np.maximum(regions.boxes[:, 1] - box[3], box[1] - regions.boxes[:, 3])
    return np.asarray(np.maximum(across, down) / max(1, box[3] - box[1]))


def _joined(differs: Bools) -> Mask:
    """Mask of 0 and 1 with cracks closed and specks removed."""
    closed = cv2.morphologyEx(differs.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return np.asarray(cv2.medianBlur(closed, 3), dtype=np.uint8)


def _outline(regions: Regions, region: int, number: Ints32) -> tuple[tuple[slice, slice], Bools, Bools]:
    """Place of a region with a margin; in it: the pixels of the region, and those within one pixel of its outline."""
    left, top, right, bottom = (int(v) for v in regions.boxes[region])
    place = (slice(max(0, top - 2), bottom + 2), slice(max(0, left - 2), right + 2))
    own = number[place] == region + 1
    return place, own, cv2.morphologyEx(own.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) != 0


def _is_uncovered(edges: tuple[Floats32, Floats32], free: Bools, length: int) -> bool:
    """Whether enough of an outline has an edge in the model and none in the frame; edges: of frame and model, (h, w).

    free: pixels (h, w) of the outline beside which nothing moves.  length: of the whole outline, px, of which the share is
    counted: a part of a person who moves in place is mostly beside the rest, and only some of it at edges of the room.
    """
    here, known = edges
    vanished = int(np.count_nonzero(free & (known > EDGE_RATIO * here)))
    return vanished >= UNCOVERED_SHARE * length


@kernel
def _numbered(runs: Ints32, height: int, width: int) -> Ints32:
    """(height, width) number of the region from 1, 0 outside."""
    number = np.zeros((height, width), dtype=np.int32)
    for k in range(len(runs)):
        for x in range(runs[k, 1], runs[k, 2]):
            number[runs[k, 0], x] = runs[k, 3] + 1
    return number


@kernel
def _count(number: Ints32, since: Floats32, person: Mask, labels: Labels, after_s: np.float32, sums: Ints) -> None:
    """Pixels of each region that changed since a time, that were of the last silhouette, and that differ; in place."""
    for y in range(number.shape[0]):
        for x in range(number.shape[1]):
            r = number[y, x]
            if r > 0:
                sums[0, r] += since[y, x] > after_s
                sums[1, r] += person[y, x] != 0
                sums[2, r] += labels[y, x] >= WEAK
