"""Silhouette: the cleaned binary mask of one person, from a colour frame and a background model."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import cv2
import numpy as np

from common.vision.background import Background, Image, Levels, Mask
from common.vision.foreground import STRONG, UNSURE, WEAK, ForegroundOptions, Labels, expected, foreground
from common.vision.mixture import Mixture
from common.vision.outline import between, closed, fill_holes, trim_edges
from common.vision.regions import Regions, find_regions, joined, paint

FOOT_SHARE = 0.3  # of the person's height, from below, where a shadow may lie between two parts of the body


class Extents(NamedTuple):
    """The outermost pixels of a mask, all inclusive; `highest` is the smallest row.  [Two-view 2.4, Fig. 4]"""

    leftmost: int
    rightmost: int
    highest: int
    lowest: int

    def centre(self) -> tuple[float, float]:
        """(x, y) px of the middle of the box."""
        return (self.leftmost + self.rightmost) / 2, (self.highest + self.lowest) / 2


@dataclass(frozen=True)
class Silhouette:
    """mask: (height, width) uint8 of 0 and 1, not empty.  area: pixels.  touches_border: the person may be cut off."""

    mask: Mask
    extents: Extents
    area: int
    touches_border: bool


@dataclass(frozen=True)
class SilhouetteOptions:
    """foreground: thresholds.  choice: which region is the person, the largest or the nearest to the previous extents.

    smallest: area below which nobody is in view, as a share of the image.
    crack: size of the closing kernel as a share of the image's height; brought to the nearest odd number of pixels.
    hole: area up to which a hole is filled, as a share of the person's.
    join: gap over which a fragment is joined, as a share of the person's height.
    fragment: area from which a fragment may be joined, as a share of the person's.
    coverage: share of an edge pixel that the person must cover.
    """

    foreground: ForegroundOptions = field(default_factory=ForegroundOptions)
    choice: Literal["largest", "nearest"] = "largest"
    smallest: float = 0.002
    crack: float = 0.006
    hole: float = 0.004
    join: float = 0.06
    fragment: float = 0.01
    coverage: float = 0.4

    def __post_init__(self) -> None:
        for name in ("smallest", "crack", "hole", "join", "fragment", "coverage"):
            value: float = getattr(self, name)
            if not 0 <= value < 1:
                raise ValueError(f"{name}: {value}; allowed 0 <= {name} < 1")


def extract(
    background: Background | Mixture, frame: Image, options: SilhouetteOptions, previous: Extents | None = None
) -> Silhouette | None:
    """The person's silhouette in a frame (height, width, 3) uint8 BGR; None when no region is large enough.

    previous: where the person was, for the choice "nearest".  Pure for a `Background`; a `Mixture` learns by it.
    Raises ValueError when the frame's shape is not the background's.
    """
    if isinstance(background, Mixture):
        return clean(background.foreground(frame), options, previous)
    gain = expected(background, frame, options.foreground)
    labels = foreground(background, frame, gain, options.foreground)
    return clean(labels, options, previous, Edges(frame, background.mean, background.weight, gain))


class Edges(NamedTuple):
    """What trimming needs: the frame, the model's mean and weight (height, width, 3), the gain (3,) between them."""

    frame: Image
    mean: Levels
    weight: Levels
    gain: Levels


def clean(
    labels: Labels, options: SilhouetteOptions, previous: Extents | None = None, edges: Edges | None = None
) -> Silhouette | None:
    """The silhouette in a label image (height, width) of `common.vision.foreground`; edges are trimmed when given."""
    height, width = labels.shape
    kernel = 2 * round(max(0.0, options.crack * height - 1) / 2) + 1
    if kernel > 1:
        labels = np.asarray(cv2.medianBlur(labels, 3), dtype=np.uint8)
    regions = find_regions(labels, UNSURE, STRONG, STRONG, True)
    chosen = choose(regions, options, options.smallest * height * width, previous)
    if chosen is None:
        return None
    keep = _with_fragments(regions, chosen, options)
    left, top, right, bottom = _box(regions, keep, kernel // 2 + 1, labels.shape)
    place = np.s_[top:bottom, left:right]
    person = np.zeros(labels.shape, dtype=np.uint8)
    paint(regions, keep, 255, person)
    inside = labels[place] & person[place]
    _doubt_specks(inside, options)
    mask = closed(between(inside, 1 - FOOT_SHARE), kernel)
    fill_holes(mask, int(options.hole * np.count_nonzero(mask)))
    if edges is not None and options.coverage > 0:
        frame, mean, weight, gain = edges
        for _ in range(1 if kernel == 1 else 2):  # at a fine scale the lens and the codec blur an edge over two pixels
            mask = trim_edges(mask, frame[place], mean[place], weight[place], gain, options.coverage)
    # What was strong before stays the proof that a fragment is more than noise.
    np.maximum(mask, np.where(mask > 0, labels[place], 0), out=mask)
    regions = find_regions(mask, 1, STRONG, STRONG, True)
    if not np.any(regions.seeds > 0):
        return None
    keep = _with_fragments(regions, int(np.argmax(regions.seeds)), options)
    mask[:] = 0
    paint(regions, keep, 1, mask)
    person[:] = 0
    person[place] = mask
    return describe(person, options.smallest)


def describe(mask: Mask, smallest: float = 0.0) -> Silhouette | None:
    """Extents and area of a mask (height, width) uint8 of 0 and 1; None below `smallest`, a share of the image."""
    height, width = mask.shape
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    area = int(np.count_nonzero(mask))
    if area == 0 or area < smallest * mask.size:
        return None
    extents = Extents(int(columns[0]), int(columns[-1]), int(rows[0]), int(rows[-1]))
    border = extents.leftmost == 0 or extents.highest == 0
    border |= extents.rightmost == width - 1 or extents.lowest == height - 1
    return Silhouette(mask, extents, area, border)


def choose(regions: Regions, options: SilhouetteOptions, smallest_px: float, previous: Extents | None) -> int | None:
    """The region that is the person, by strong pixels or by nearness; None when all are too small."""
    if len(regions.areas) == 0:
        return None
    large = (regions.areas >= smallest_px) & (regions.seeds > 0)
    if not large.any():
        return None
    if options.choice == "nearest" and previous is not None:
        # Large against the largest, so that a speck beside the person is not the person.
        large &= regions.seeds >= 0.2 * regions.seeds[large].max()
        x, y = previous.centre()
        across = (regions.boxes[:, 0] + regions.boxes[:, 2] - 1) / 2 - x
        down = (regions.boxes[:, 1] + regions.boxes[:, 3] - 1) / 2 - y
        return int(np.argmin(np.where(large, across**2 + down**2, np.inf)))
    return int(np.argmax(np.where(large, regions.seeds, -1)))


def _doubt_specks(labels: Labels, options: SilhouetteOptions) -> None:
    """Make pieces too small for a fragment UNSURE, in place: specks do not prove a shadow to be a part of the body."""
    regions = find_regions(labels, WEAK, STRONG, STRONG, True)
    if len(regions.areas) > 0:
        paint(regions, regions.areas < options.fragment * regions.areas.max(), UNSURE, labels)


def _with_fragments(
    regions: Regions, chosen: int, options: SilhouetteOptions
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    box = regions.boxes[chosen]
    reach = round(options.join * (box[3] - box[1]))
    smallest = max(2, round(options.fragment * int(regions.areas[chosen])))
    keep: np.ndarray[tuple[int], np.dtype[np.bool_]] = joined(regions, chosen, reach, smallest)
    return keep


def _box(
    regions: Regions, keep: np.ndarray[tuple[int], np.dtype[np.bool_]], pad: int, shape: tuple[int, ...]
) -> tuple[int, int, int, int]:
    """Left, top, right, bottom (exclusive) of the kept regions with a margin, inside the image."""
    boxes = regions.boxes[keep]
    left, top = boxes[:, :2].min(axis=0) - pad
    right, bottom = boxes[:, 2:].max(axis=0) + pad
    return max(0, int(left)), max(0, int(top)), min(shape[1], int(right)), min(shape[0], int(bottom))
