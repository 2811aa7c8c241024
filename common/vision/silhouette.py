"""Silhouette: the cleaned binary mask of one person, from a colour frame and a background model."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image, Labels, Mask
from zenocap.common.vision.background import Background
from zenocap.common.vision.foreground import STRONG, UNSURE, WEAK, ForegroundOptions, expected_gain, foreground
from zenocap.common.vision.mask_refinement import close_cracks, enclosed, fill_holes, trim_edges
from zenocap.common.vision.mixture import Mixture
from zenocap.common.vision.regions import Regions, find_regions, paint, reachable
from zenocap.common.vision.semantics import overrule

FOOT_SHARE = 0.3  # of the body height from the soles, where a shadow may be between the feet; chosen by hand
NEAREST_SHARE = 0.2  # of the pixels of the largest region, for the choice "nearest"; chosen by hand


class Extents(NamedTuple):
    """Outermost pixels of a mask, all inclusive; `highest` is the smallest row.  [Two-view 2.4, Fig. 4]"""

    leftmost: int
    rightmost: int
    highest: int
    lowest: int

    def centre(self) -> tuple[float, float]:
        """(x, y) px of the centre of the box."""
        return (self.leftmost + self.rightmost) / 2, (self.highest + self.lowest) / 2


@dataclass(frozen=True)
class Silhouette:
    """Silhouette of one person.

    mask: (height, width) uint8 of 0 and 1, not empty.  area: pixels.  touches_border: the person may be cut off.
    """

    mask: Mask
    extents: Extents
    area: int
    touches_border: bool


@dataclass(frozen=True)
class SilhouetteOptions:
    """Options of the extraction; shares are chosen by hand.

    foreground: thresholds.  choice: region of the person, the largest or the nearest to the previous extents.
    smallest: smallest area of a person, share of the image.
    crack: size of the closing kernel, share of the image height; rounded to an odd number of pixels.
    hole: largest area of a hole that is filled, share of the person's area.
    join: largest gap to a fragment that is joined, share of the person's height.
    fragment: smallest area of a fragment that is joined, share of the person's area.
    coverage: smallest coverage of an edge pixel by the person.
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
    background: Background | Mixture,
    frame: Image,
    options: SilhouetteOptions,
    previous: Extents | None = None,
    decided: Mask | None = None,
) -> Silhouette | None:
    """Silhouette of the person in a frame (height, width, 3) uint8 BGR; None when no region is large enough.

    previous: last extents of the person, for the choice "nearest".  decided: see `common.vision.semantics`.
    Pure for a `Background`; a `Mixture` learns from it.
    Raises ValueError when the frame's shape is not the background's.
    """
    if isinstance(background, Mixture):
        labels = background.foreground(frame)
        if decided is not None:
            overrule(labels, decided)
        return clean(labels, options, previous)
    gain = expected_gain(background, frame, options.foreground)
    labels = foreground(background, frame, gain, options.foreground)
    if decided is not None:
        overrule(labels, decided)
    return clean(labels, options, previous, Edges(frame, background.mean, background.weight, gain))


class Edges(NamedTuple):
    """Input of edge trimming: frame, mean and weight of the model (height, width, 3), gain (3,)."""

    frame: Image
    mean: Floats32
    weight: Floats32
    gain: Floats32


def clean(
    labels: Labels, options: SilhouetteOptions, previous: Extents | None = None, edges: Edges | None = None
) -> Silhouette | None:
    """Silhouette in a label image (height, width) of `common.vision.foreground`; edges are trimmed when given."""
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
    _demote_specks(inside, options)
    # Paper (replaced): 1 filters by morphology; here regions, small closings, holes by area, and edges by coverage.
    mask = close_cracks(enclosed(inside, 1 - FOOT_SHARE), kernel)
    fill_holes(mask, int(options.hole * np.count_nonzero(mask)))
    if edges is not None and options.coverage > 0:
        frame, mean, weight, gain = edges
        for _ in range(1 if kernel == 1 else 2):  # at high resolution lens and codec blur an edge over two pixels
            mask = trim_edges(mask, frame[place], mean[place], weight[place], gain, options.coverage)
    # A fragment needs pixels that were STRONG before.
    np.maximum(mask, np.where(mask > 0, labels[place], 0), out=mask)
    regions = find_regions(mask, 1, STRONG, STRONG, True)
    if not np.any(regions.seeds > 0):
        return None
    keep = _with_fragments(regions, int(np.argmax(regions.seeds)), options)
    mask[:] = 0
    paint(regions, keep, 1, mask)
    person[:] = 0
    person[place] = mask
    return describe(person, options.smallest, (left, top, right, bottom))


def describe(mask: Mask, smallest: float = 0.0, box: tuple[int, int, int, int] | None = None) -> Silhouette | None:
    """Extents and area of a mask (height, width) of 0 and 1; None below the area `smallest`, a share of the image.

    box: left, top, right, bottom (exclusive) px; the mask is known to be 0 outside of it.
    """
    height, width = mask.shape
    left, top, right, bottom = box or (0, 0, width, height)
    inside = mask[top:bottom, left:right]
    columns, rows = np.flatnonzero(inside.any(axis=0)), np.flatnonzero(inside.any(axis=1))
    area = int(np.count_nonzero(inside))
    if area == 0 or area < smallest * mask.size:
        return None
    extents = Extents(left + int(columns[0]), left + int(columns[-1]), top + int(rows[0]), top + int(rows[-1]))
    border = extents.leftmost == 0 or extents.highest == 0
    border |= extents.rightmost == width - 1 or extents.lowest == height - 1
    return Silhouette(mask, extents, area, border)


def choose(regions: Regions, options: SilhouetteOptions, smallest_px: float, previous: Extents | None) -> int | None:
    """Region of the person, by STRONG pixels or by distance from `previous`; None when all are too small."""
    if len(regions.areas) == 0:
        return None
    large = (regions.areas >= smallest_px) & (regions.seeds > 0)
    if not large.any():
        return None
    if options.choice == "nearest" and previous is not None:
        large &= regions.seeds >= NEAREST_SHARE * regions.seeds[large].max()
        x, y = previous.centre()
        across = (regions.boxes[:, 0] + regions.boxes[:, 2] - 1) / 2 - x
        down = (regions.boxes[:, 1] + regions.boxes[:, 3] - 1) / 2 - y
        return int(np.argmin(np.where(large, across**2 + down**2, np.inf)))
    return int(np.argmax(np.where(large, regions.seeds, -1)))


def _demote_specks(labels: Labels, options: SilhouetteOptions) -> None:
    """Label pieces too small for a fragment UNSURE, in place: specks in a shadow do not make it a part of the body."""
    regions = find_regions(labels, WEAK, STRONG, STRONG, True)
    if len(regions.areas) > 0:
        paint(regions, regions.areas < options.fragment * regions.areas.max(), UNSURE, labels)


def _with_fragments(
    regions: Regions, chosen: int, options: SilhouetteOptions
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    box = regions.boxes[chosen]
    reach = round(options.join * (box[3] - box[1]))
    smallest = max(2, round(options.fragment * int(regions.areas[chosen])))
    keep: np.ndarray[tuple[int], np.dtype[np.bool_]] = reachable(regions, chosen, reach, smallest)
    return keep


def _box(
    regions: Regions, keep: np.ndarray[tuple[int], np.dtype[np.bool_]], pad: int, shape: tuple[int, ...]
) -> tuple[int, int, int, int]:
    """Left, top, right, bottom (exclusive) of the kept regions with a margin, inside the image."""
    boxes = regions.boxes[keep]
    left, top = boxes[:, :2].min(axis=0) - pad
    right, bottom = boxes[:, 2:].max(axis=0) + pad
    return max(0, int(left)), max(0, int(top)), min(shape[1], int(right)), min(shape[0], int(bottom))
