"""Connected regions of a label image, stored as runs along its rows; the person's region."""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Bools, Ints32, Labels, Mask
from zenocap.common.jit import NO_BITS, kernel, leaf_kernel
from zenocap.common.vision.foreground import STRONG, UNSURE, WEAK
from zenocap.common.vision.silhouette import Extents, SilhouetteOptions

NEAREST_SHARE = 0.2  # of the pixels of the largest region, for the choice "nearest"; chosen by hand


class Regions(NamedTuple):
    """Connected regions.

    runs: (n, 4) row, first column, column after the last, region.

    boxes: (regions, 4) left, top, right, bottom, the last two exclusive.  areas: (regions,) pixels.
    seeds: (regions,) pixels of at least the seed label.
    """

    runs: Ints32
    boxes: Ints32
    areas: Ints32
    seeds: Ints32


@leaf_kernel
def _root(parent: Ints32, k: int) -> int:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@kernel
def _runs(labels: Labels, lowest: int, highest: int) -> Ints32:
    """(n, 4) `Regions.runs` without their regions, row by row.

    Pixels are compared in loops that vectorize; only the ends of runs are then visited one by one.
    """
    height, width = labels.shape
    low, high = np.uint8(lowest), np.uint8(highest)
    count = 0  # counted first: an array that grows within a loop would cost more
    for y in range(height):
        row = labels[y]
        count += (row[0] >= low) & (row[0] <= high)
        for x in range(1, width):
            count += (row[x] >= low) & (row[x] <= high) & ((row[x - 1] < low) | (row[x - 1] > high))
    runs = np.empty((count, 4), dtype=np.int32)
    ends = np.zeros(8 * (width // 8 + 1), dtype=np.uint8)  # 1 where a run starts, and after its last column
    words = ends.view(np.uint64)
    k = 0
    for y in range(height):
        row = labels[y]
        ends[0] = (row[0] >= low) & (row[0] <= high)
        for x in range(1, width):
            ends[x] = ((row[x] >= low) & (row[x] <= high)) != ((row[x - 1] >= low) & (row[x - 1] <= high))
        ends[width] = (row[width - 1] >= low) & (row[width - 1] <= high)
        inside = False
        for word in range(len(words)):
            if words[word] == NO_BITS:
                continue
            for x in range(8 * word, 8 * word + 8):
                if ends[x] == 0:
                    continue
                if inside:
                    runs[k, 2] = x
                    k += 1
                else:
                    runs[k, 0], runs[k, 1] = y, x
                inside = not inside
    return runs


@kernel
def find_regions(labels: Labels, lowest: int, highest: int, seed: int, diagonal: bool) -> Regions:
    """Connected regions of the pixels with lowest <= label <= highest, 8-connected when `diagonal`, else 4-connected.

    labels: (height, width) uint8.  Regions are numbered in the order of their first pixels, row by row.
    """
    runs = _runs(labels, lowest, highest)
    count = len(runs)
    reach = 1 if diagonal else 0
    parent = np.arange(count).astype(np.int32)
    above = 0
    for k in range(count):
        while above < k and (runs[above, 0] < runs[k, 0] - 1):
            above += 1
        j = above
        while j < k and runs[j, 0] == runs[k, 0] - 1 and runs[j, 1] < runs[k, 2] + reach:
            if runs[j, 2] + reach > runs[k, 1]:
                a, b = _root(parent, j), _root(parent, k)
                parent[max(a, b)] = min(a, b)
            j += 1
    total = 0
    for k in range(count):
        if parent[k] == k:
            runs[k, 3] = total
            total += 1
        else:
            runs[k, 3] = runs[_root(parent, k), 3]
    boxes = np.empty((total, 4), dtype=np.int32)
    for r in range(total):
        boxes[r, 0], boxes[r, 1], boxes[r, 2], boxes[r, 3] = labels.shape[1], labels.shape[0], 0, 0
    areas = np.zeros(total, dtype=np.int32)
    seeds = np.zeros(total, dtype=np.int32)
    for k in range(count):
        y, first, stop, r = runs[k, 0], runs[k, 1], runs[k, 2], runs[k, 3]
        boxes[r, 0], boxes[r, 1] = min(boxes[r, 0], first), min(boxes[r, 1], y)
        boxes[r, 2], boxes[r, 3] = max(boxes[r, 2], stop), max(boxes[r, 3], y + 1)
        areas[r] += stop - first
        for x in range(first, stop):
            seeds[r] += labels[y, x] >= seed
    return Regions(runs, boxes, areas, seeds)


@leaf_kernel
def distance(regions: Regions, a: int, b: int, enough: int) -> int:
    """Pixels between two regions along rows or columns, at most `enough`."""
    boxes = regions.boxes
    across = max(boxes[a, 0], boxes[b, 0]) - min(boxes[a, 2], boxes[b, 2])
    down = max(boxes[a, 1], boxes[b, 1]) - min(boxes[a, 3], boxes[b, 3])
    if max(across, down) >= enough:
        return enough
    least = enough
    for i in range(len(regions.runs)):
        if regions.runs[i, 3] != a:
            continue
        for j in range(len(regions.runs)):
            if regions.runs[j, 3] != b:
                continue
            down = abs(regions.runs[i, 0] - regions.runs[j, 0]) - 1
            across = max(regions.runs[i, 1], regions.runs[j, 1]) - min(regions.runs[i, 2], regions.runs[j, 2])
            least = min(least, max(across, down, 0))
    return least


@kernel
def reachable(regions: Regions, chosen: int, reach: int, smallest: int) -> Bools:
    """(regions,) True for the chosen region and all of `smallest` pixels that gaps of at most `reach` px connect to it."""
    keep = np.zeros(len(regions.areas), dtype=np.bool_)
    keep[chosen] = True
    queue = [chosen]
    while len(queue) > 0:
        near = queue.pop()
        for r in range(len(regions.areas)):
            if (
                not keep[r]
                and regions.areas[r] >= smallest
                and regions.seeds[r] > 0
                and distance(regions, near, r, reach + 1) <= reach
            ):
                keep[r] = True
                queue.append(r)
    return keep


@leaf_kernel
def paint(regions: Regions, keep: Bools, value: int, image: Labels) -> None:
    """Set the pixels of the kept regions to `value`, in place."""
    for k in range(len(regions.runs)):
        if keep[regions.runs[k, 3]]:
            for x in range(regions.runs[k, 1], regions.runs[k, 2]):
                image[regions.runs[k, 0], x] = value


def person_labels(
    labels: Labels, options: SilhouetteOptions, previous: Extents | None, pad: int
) -> tuple[Labels, tuple[int, int, int, int]] | None:
    """Labels of the person's region and its fragments, with a margin of `pad` px, and its box; None without a person.

    Box: left, top, right, bottom (exclusive) px.  Pieces too small for a fragment become UNSURE: specks in a shadow do not
    make it a part of the body.
    """
    regions = find_regions(labels, UNSURE, STRONG, STRONG, True)
    chosen = _chosen(regions, options, options.smallest * labels.shape[0] * labels.shape[1], previous)
    if chosen is None:
        return None
    keep = _with_fragments(regions, chosen, options)
    person = np.zeros(labels.shape, dtype=np.uint8)
    paint(regions, keep, 255, person)
    left, top = (max(0, int(least) - pad) for least in regions.boxes[keep, :2].min(axis=0))
    right, bottom = (int(most) + pad for most in regions.boxes[keep, 2:].max(axis=0))
    right, bottom = min(labels.shape[1], right), min(labels.shape[0], bottom)
    inside = labels[top:bottom, left:right] & person[top:bottom, left:right]
    pieces = find_regions(inside, WEAK, STRONG, STRONG, True)
    if len(pieces.areas) > 0:
        paint(pieces, pieces.areas < options.fragment * pieces.areas.max(), UNSURE, inside)
    return inside, (left, top, right, bottom)


def _chosen(regions: Regions, options: SilhouetteOptions, smallest_px: float, previous: Extents | None) -> int | None:
    """Region of the person, by STRONG pixels or by distance from `previous`; None when all are too small."""
    if len(regions.areas) == 0:
        return None
    large = (regions.areas >= smallest_px) & (regions.seeds > 0)
    if not large.any():
        return None
    if options.choice == "nearest" and previous is not None:
        large &= regions.seeds >= NEAREST_SHARE * regions.seeds[large].max()
        across = (regions.boxes[:, 0] + regions.boxes[:, 2] - 1) / 2 - (previous.leftmost + previous.rightmost) / 2
        down = (regions.boxes[:, 1] + regions.boxes[:, 3] - 1) / 2 - (previous.highest + previous.lowest) / 2
        return int(np.argmin(np.where(large, across**2 + down**2, np.inf)))
    return int(np.argmax(np.where(large, regions.seeds, -1)))


def _with_fragments(regions: Regions, chosen: int, options: SilhouetteOptions) -> Bools:
    box = regions.boxes[chosen]
    reach = round(options.join * (box[3] - box[1]))
    smallest = max(2, round(options.fragment * int(regions.areas[chosen])))
    keep: Bools = reachable(regions, chosen, reach, smallest)
    return keep


def fill_holes(mask: Mask, largest_px: int) -> None:
    """Fill holes of at most `largest_px` pixels in place; larger ones are real, such as between an arm and the torso."""
    holes = find_regions(mask, 0, 0, 1, False)
    height, width = mask.shape
    boxes = holes.boxes
    inside = (boxes[:, 0] > 0) & (boxes[:, 1] > 0) & (boxes[:, 2] < width) & (boxes[:, 3] < height)
    paint(holes, inside & (holes.areas <= largest_px), 1, mask)


def keep_person(mask: Mask, labels: Labels, options: SilhouetteOptions) -> bool:
    """Keep of a mask the region with the most STRONG pixels and its fragments, in place; False without such a region.

    labels: of the same pixels, before refinement: a fragment needs pixels that were STRONG there.
    """
    np.maximum(mask, np.where(mask > 0, labels, 0), out=mask)
    regions = find_regions(mask, 1, STRONG, STRONG, True)
    if not np.any(regions.seeds > 0):
        return False
    keep = _with_fragments(regions, int(np.argmax(regions.seeds)), options)
    mask[:] = 0
    paint(regions, keep, 1, mask)
    return True
