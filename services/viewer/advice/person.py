"""Measures of the person in one image: contrast to the room, holes, mirror image, size and border."""

from dataclasses import dataclass

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Image, Mask
from zenocap.services.viewer.parameters import (
    ADVICE_PERSON_PX,
    ADVICE_PX,
    CLOSING,
    CONTACT_PX,
    CONTRAST_QUANTILE,
    GLOSS_CONTRAST,
    GLOSS_FEET,
    GLOSS_LIKENESS,
    GLOSS_REACH,
)

GAIN_RANGE = (0.5, 2.0)  # of the light of an image over that of the room
THIRDS = 3
SIDES, BELOW = 0.15, 0.3  # of the person's height, what is measured beside and below


@dataclass(frozen=True)
class PersonSample:
    """contrast: (3,) levels of the upper, middle and lower third.  holes: %.  height: px.

    mirrored: the silhouette contains a mirror image.  cut: by the border of the image.
    """

    time_s: float
    contrast: Floats
    holes: float
    mirrored: bool
    height: float
    cut: bool


@dataclass(frozen=True)
class Reduced:
    """Reduced surroundings of a person: difference from the room in its present light (h, w, 3), silhouette (h, w)."""

    difference: Floats32
    mask: Mask


def gains(image: Image, room: Floats32, mask: Mask) -> Floats32:
    """(3,) light of an image over that of the room, by colour, outside the silhouette, from every n-th pixel."""
    step = max(1, round(image.shape[1] / ADVICE_PX))
    outside = np.ascontiguousarray(1 - mask[::step, ::step])
    now, empty = (np.array(cv2.mean(np.ascontiguousarray(one[::step, ::step]), outside)[:3]) for one in (image, room))
    return np.asarray(np.clip(now / np.maximum(empty, 1.0), *GAIN_RANGE), dtype=np.float32)


def reduced(image: Image, room: Floats32, gain: Floats32, mask: Mask, top: int, bottom: int) -> Reduced:
    """The person of rows `top` to `bottom` with what is around and below, about ADVICE_PERSON_PX tall."""
    height = bottom - top + 1
    step = max(1, round(height / ADVICE_PERSON_PX))
    columns = np.flatnonzero(mask[top : bottom + 1 : step].any(axis=0))
    margin, below = round(SIDES * height), round(BELOW * height)
    left, right = max(0, int(columns[0]) - margin), int(columns[-1]) + margin + 1
    place = np.s_[max(0, top - step) : bottom + below : step, left:right:step]
    return Reduced(image[place] - gain * room[place], np.ascontiguousarray(mask[place]))


def person_sample(time_s: float, found: Reduced, mask: Mask, top: int, bottom: int) -> PersonSample:
    """Measures of a silhouette (height, width) whose rows are `top` to `bottom`."""
    rows = np.flatnonzero(found.mask.any(axis=1))
    cut = any(int(np.count_nonzero(line)) >= CONTACT_PX for line in (mask[0], mask[-1], mask[:, 0], mask[:, -1]))
    height = float(bottom - top + 1)
    if len(rows) < THIRDS:
        return PersonSample(time_s, np.full(THIRDS, np.nan), 0.0, False, height, cut)
    first, last = int(rows[0]), int(rows[-1])
    width = max(3, round(CLOSING * (last - first + 1))) | 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))
    region = cv2.copyMakeBorder(found.mask, width, width, width, width, cv2.BORDER_CONSTANT, value=0)
    closed = cv2.morphologyEx(region, cv2.MORPH_CLOSE, disc)[width:-width, width:-width]
    area = int(np.count_nonzero(found.mask))
    holes = 100.0 * (int(np.count_nonzero(closed)) - area) / area
    return PersonSample(time_s, _contrast(found, np.asarray(closed, dtype=np.uint8), first, last), holes,
                        is_mirrored(found, first, last), height, cut)  # fmt: skip


def _contrast(found: Reduced, region: Mask, first: int, last: int) -> Floats:
    levels = np.abs(found.difference).max(axis=2)
    values = np.full(THIRDS, np.nan)
    for third, rows in enumerate(np.array_split(np.arange(first, last + 1), THIRDS)):
        inside = levels[rows[0] : rows[-1] + 1][region[rows[0] : rows[-1] + 1] != 0]
        if len(inside):
            values[third] = float(np.quantile(inside, CONTRAST_QUANTILE))
    return values


def is_mirrored(found: Reduced, first: int, last: int) -> bool:
    """Whether the lower half of the silhouette of rows `first` to `last` is a faint mirror image of the upper half.

    That is so where a glossy floor mirrors enough for the mirror image to belong to the silhouette.
    """
    columns = np.flatnonzero(found.mask.any(axis=0))
    place = np.s_[first : last + 1, int(columns[0]) : int(columns[-1]) + 1]
    mask, levels = found.mask[place] != 0, np.abs(found.difference[place]).max(axis=2)
    height = len(mask)
    reach = round(GLOSS_REACH * height)
    best, mirrored = GLOSS_LIKENESS, False
    for feet in range(round(GLOSS_FEET[0] * height), min(round(GLOSS_FEET[1] * height), height - reach) + 1):
        above, below = mask[feet - reach : feet][::-1], mask[feet : feet + reach]
        common = above & below
        likeness = int(np.count_nonzero(common)) / max(1, int(np.count_nonzero(above | below)))
        if likeness > best:
            bright = float(levels[feet - reach : feet][::-1][common].mean())
            faint = float(levels[feet : feet + reach][common].mean())
            best, mirrored = likeness, faint < GLOSS_CONTRAST * bright
    return mirrored
