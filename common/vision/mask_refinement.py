"""Refinement of a person's mask: clothes like shadow, cracks, holes, edges at partial coverage."""

from typing import NamedTuple

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image, Labels, Mask
from zenocap.common.jit import kernel
from zenocap.common.vision.foreground import UNSURE, WEAK
from zenocap.common.vision.regions import fill_holes
from zenocap.common.vision.silhouette import SilhouetteOptions

FOOT_SHARE = 0.3  # of the body height from the soles, where a shadow may be between the feet; chosen by hand
TRIM_SIGMAS = 1.0  # sigmas of the noise by which the coverage of a removed edge pixel is too small; chosen by hand


class Edges(NamedTuple):
    """Input of edge trimming: frame, mean and weight of the model (height, width, 3), gain (3,)."""

    frame: Image
    mean: Floats32
    weight: Floats32
    gain: Floats32

    def within(self, place: tuple[slice, slice]) -> "Edges":
        """The same of a part of the image."""
        return Edges(self.frame[place], self.mean[place], self.weight[place], self.gain)


def refined(labels: Labels, options: SilhouetteOptions, kernel: int, edges: Edges | None) -> Mask:
    """Mask (height, width) of a person's labels.  kernel: size of the closing, px.  edges: of the same pixels, or None."""
    mask = close_cracks(enclosed(labels, 1 - FOOT_SHARE), kernel)
    fill_holes(mask, int(options.hole * np.count_nonzero(mask)))
    if edges is not None and options.coverage > 0:
        for _ in range(1 if kernel == 1 else 2):  # at high resolution lens and codec blur an edge over two pixels
            mask = trim_edges(mask, *edges, options.coverage)
    return mask


def odd_kernel(size_px: int) -> Mask:
    """Elliptical structuring element (size, size).  Raises ValueError for an even size, which would shift the mask."""
    if size_px < 1 or size_px % 2 == 0:
        raise ValueError(f"kernel size: {size_px}; allowed are odd numbers from 1")
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size_px, size_px)), dtype=np.uint8)


def close_cracks(mask: Mask, size_px: int) -> Mask:
    """Mask with cracks narrower than the kernel closed; pixels beyond the border count as empty."""
    if size_px == 1:
        return mask
    kernel, pad = odd_kernel(size_px), size_px // 2
    wide = cv2.copyMakeBorder(mask, pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=0)
    wide = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, kernel)
    return np.ascontiguousarray(wide[pad:-pad, pad:-pad])


@kernel
def enclosed(labels: Labels, upper: float) -> Mask:
    """1 on pixels that differ, and on UNSURE pixels with such pixels both above and below, or both left and right.

    Clothes are enclosed by other parts of the body; a shadow on the ground is at the end of its column.  Left and right
    count only in the `upper` share of the rows, since a shadow may lie between the feet.
    """
    height, width = labels.shape
    mask = np.zeros((height, width), dtype=np.uint8)
    highest = np.full(width, height, dtype=np.int32)
    lowest = np.full(width, -1, dtype=np.int32)
    for y in range(height):
        for x in range(width):
            if labels[y, x] >= WEAK:
                highest[x] = min(highest[x], y)
                lowest[x] = y
    for y in range(height):
        first, last = width, -1
        if y < upper * height:
            for x in range(width):
                if labels[y, x] >= WEAK:
                    first = min(first, x)
                    last = x
        for x in range(width):
            if labels[y, x] >= WEAK or (labels[y, x] == UNSURE and (highest[x] < y < lowest[x] or first < x < last)):
                mask[y, x] = 1
    return mask


@kernel
def trim_edges(mask: Mask, frame: Image, mean: Floats32, weight: Floats32, gain: Floats32, half: float) -> Mask:
    """Mask without the edge pixels of which the person covers less than the share `half`.

    An edge pixel mixes the colours of person and background, so thresholds near the noise make a silhouette up to a pixel
    too wide.  Its coverage is its difference from the model projected on that of the next pixel inwards; it must be too
    small by more than the noise.  Limbs one or two pixels wide are kept, since all of their pixels are edges.
    frame, mean, weight: (height, width, 3) of the same region.
    """
    height, width = mask.shape
    out = mask.copy()
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            if mask[y, x] == 0 or mask[y - 1, x] & mask[y + 1, x] & mask[y, x - 1] & mask[y, x + 1] != 0:
                continue
            for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                in_x, in_y = x - dx, y - dy
                if mask[y + dy, x + dx] != 0 or mask[in_y, in_x] == 0:
                    continue
                deep_y, deep_x = in_y - dy, in_x - dx
                if not (0 <= deep_y < height and 0 <= deep_x < width and mask[deep_y, deep_x] != 0):
                    continue
                shared, whole, noise = np.float32(0), np.float32(0), np.float32(0)
                for c in range(3):
                    inner = np.float32(frame[in_y, in_x, c]) - gain[c] * mean[in_y, in_x, c]
                    shared += inner * (np.float32(frame[y, x, c]) - gain[c] * mean[y, x, c])
                    whole += inner * inner
                    noise += inner * inner / weight[y, x, c]
                if shared < half * whole - TRIM_SIGMAS * np.sqrt(noise):
                    out[y, x] = 0
                    break
    return out
