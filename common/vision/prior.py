"""Decision by pixel near a tracked person: background model, expected body, smoothness.

A few mean-field passes of a binary field.  The data term is the silhouette found without the body and the labels of the
subtraction.  The prior is the distance from the expected outline: without effect on the outline itself, so that within the
band the image decides, and strongest a band inside and outside of it.  What lies outside and moves may be a limb that the
tracker has lost, and is kept; what has been still is furniture.
"""

# Paper (added): 1 has no prior; here the tracker's pose of the frame before is one.

import numpy as np

from zenocap.common.arrays import Floats32, Labels, Mask
from zenocap.common.jit import finite_kernel, finite_leaf_kernel, leaf_kernel
from zenocap.common.vision.foreground import BACKGROUND, SHADOW, STRONG, UNSURE, WEAK
from zenocap.common.vision.prediction import Prediction
from zenocap.common.vision.regions import find_regions, paint
from zenocap.common.vision.silhouette import PersonSilhouette, SilhouetteOptions, describe

# Logarithms of odds.  All constants are chosen by hand.
STRONG_ODDS, WEAK_ODDS, FILLED_ODDS = 4.0, 2.0, 1.0  # of a pixel of the silhouette by label
CLEAR_ODDS, SHADE_ODDS, LEFT_ODDS = -2.5, -1.5, -0.5  # of another pixel: equal to the model; in shadow; differs
INSIDE_ODDS, OUTSIDE_ODDS, STILL_ODDS = 3.5, -1.5, -6.0  # a band inside the expected outline; outside; and unchanged
COUPLING = 0.8  # of two neighbours
PASSES = 4
FAR_BANDS = 4.0  # bands outside of the body, as which everything farther counts
STILL_S = 1.0  # s without a change, of what is outside of the body


BESIDE_SHARE = 0.15  # of the expected area, of what is outside of the body and no limb of it


@leaf_kernel
def explained_share(labels: Labels, depth: Floats32) -> float:
    """Share of the expected body (depth > 0) that differs from the background."""
    differing, area = 0, 0
    for y in range(depth.shape[0]):
        for x in range(depth.shape[1]):
            if depth[y, x] > 0:
                area += 1
                differing += labels[y, x] >= UNSURE
    return differing / max(area, 1)


def with_prior(
    silhouette: PersonSilhouette,
    labels: Labels,
    prediction: Prediction,
    since: Floats32,
    now_s: np.float32,
    options: SilhouetteOptions,
) -> PersonSilhouette | None:
    """The silhouette decided with the prior near the expected body; None when nothing is left.

    labels: (height, width) of `common.vision.foreground`.  since: (height, width) s, since when a pixel has not changed.
    """
    e, (rows, columns) = silhouette.extents, prediction.place
    outer = np.s_[
        min(e.highest, rows.start) : max(e.lowest + 1, rows.stop),
        min(e.leftmost, columns.start) : max(e.rightmost + 1, columns.stop),
    ]
    top, left = outer[0].start, outer[1].start
    depth = np.full((outer[0].stop - top, outer[1].stop - left), -FAR_BANDS * prediction.band, dtype=np.float32)
    depth[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = prediction.depth
    own = silhouette.mask[outer]
    others = _others(own, depth, prediction.band)
    found = _mean_field(
        own, labels[outer], depth, since[outer], others, now_s - np.float32(STILL_S), np.float32(prediction.band)
    )
    mask = np.zeros_like(silhouette.mask)
    mask[outer] = found
    return describe(mask, options.smallest)


def _others(mask: Mask, depth: Floats32, band: float) -> Mask:
    """1 on pieces of a mask that are a band outside of the body and too large for a limb that the tracker has lost."""
    outside = (mask != 0) & (depth < -band)
    found = np.zeros_like(mask)
    if not outside.any():
        return found
    area = int(np.count_nonzero(depth > 0))
    regions = find_regions(outside.astype(np.uint8), 1, 1, 1, True)
    paint(regions, regions.areas > BESIDE_SHARE * area, 1, found)
    return found


@finite_leaf_kernel
def _data_term(inside: int, label: int) -> np.float32:
    """Logarithm of the odds of a pixel in or outside of the silhouette, by its label."""
    if inside != 0:
        if label == STRONG:
            return np.float32(STRONG_ODDS)
        return np.float32(WEAK_ODDS) if label == WEAK else np.float32(FILLED_ODDS)
    if label == BACKGROUND:
        return np.float32(CLEAR_ODDS)
    return np.float32(SHADE_ODDS) if label == SHADOW else np.float32(LEFT_ODDS)


@finite_kernel
def _mean_field(
    mask: Mask, labels: Labels, depth: Floats32, since: Floats32, others: Mask, still_s: np.float32, band: np.float32
) -> Mask:
    rows, columns = mask.shape
    odds = np.empty((rows, columns), dtype=np.float32)
    for y in range(rows):
        for x in range(columns):
            value, d = _data_term(mask[y, x], labels[y, x]), depth[y, x] / band
            share = min(max(d, np.float32(-1)), np.float32(1))
            if share >= 0:
                value += np.float32(INSIDE_ODDS) * share
            elif since[y, x] < still_s or others[y, x] != 0:
                value -= np.float32(STILL_ODDS) * share
            else:
                value -= np.float32(OUTSIDE_ODDS) * share
            odds[y, x] = value
    spin = np.empty((rows + 2, columns + 2), dtype=np.float32)
    spin[:, :] = np.float32(-1)
    for y in range(rows):
        for x in range(columns):
            spin[y + 1, x + 1] = min(max(odds[y, x] * np.float32(0.5), np.float32(-1)), np.float32(1))
    after = spin.copy()
    for _ in range(PASSES):
        for y in range(1, rows + 1):
            for x in range(1, columns + 1):
                near = spin[y - 1, x] + spin[y + 1, x] + spin[y, x - 1] + spin[y, x + 1]
                field = odds[y - 1, x - 1] + np.float32(COUPLING) * near
                after[y, x] = min(max(field * np.float32(0.5), np.float32(-1)), np.float32(1))
        spin, after = after, spin
    out = np.zeros((rows, columns), dtype=np.uint8)
    for y in range(rows):
        for x in range(columns):
            out[y, x] = spin[y + 1, x + 1] > 0
    return out
