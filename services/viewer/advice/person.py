"""Measures of the person in one image: contrast to the room, holes, mirror image, size and border."""

from dataclasses import dataclass, replace
from math import ceil

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Floats, Floats32, Image, Mask
from zenocap.common.vision.background import Background
from zenocap.common.vision.empty_scene import UNCOVERED, outline_shares
from zenocap.services.viewer import parameters as p

GAIN_RANGE = (0.5, 2.0)  # of the light of an image over that of the room
THIRDS = 3
SIDES, BELOW = 0.15, 0.3  # of the person's height, what is measured beside and below


@dataclass(frozen=True)
class PersonSample:
    """contrast: (3,) levels of the upper, middle and lower third.  holes: missing area, % of the silhouette.  height: px.

    mirrored: the silhouette contains a mirror image.  cut: by the border of the image.  people, uncovered: see `others`.
    """

    time_s: float
    contrast: Floats
    holes: float
    mirrored: bool
    height: float
    cut: bool
    people: bool = False
    uncovered: bool = False


@dataclass(frozen=True)
class ReducedSurroundings:
    """Reduced surroundings of a person.

    difference: from the room in its present light (h, w, 3), levels.  distance: the same in sigmas of the noise, (h, w).
    mask: silhouette (h, w).
    """

    difference: Floats32
    distance: Floats32
    mask: Mask


def seen_person(
    image: Image, room: Background, mask: Mask, time_s: float
) -> tuple[PersonSample, Floats32, int, int] | None:
    """Measures of the person of a silhouette (height, width), the gains of `gains`, and the person's first and last row.

    None for an empty silhouette.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    if not len(rows):
        return None
    top, bottom, gain = int(rows[0]), int(rows[-1]), gains(image, room.mean, mask)
    sample = person_sample(time_s, reduced(image, room, gain, mask, top, bottom), mask, top, bottom)
    people, uncovered = others(image, room, gain, mask)
    return replace(sample, people=people, uncovered=uncovered), gain, top, bottom


def others(image: Image, room: Background, gain: Floats32, mask: Mask) -> tuple[bool, bool]:
    """Whether another person is in the image, and whether a place shows that a person of the empty scene has left it.

    Edges along the outline tell a person from such a place; both are at least about half as large as the silhouette.
    Neither for a silhouette of so few pixels that the reduced image has none of them.
    """
    step = max(1, round(max(mask.shape) / p.OTHERS_PX))
    small, own = np.ascontiguousarray(image[::step, ::step]), np.ascontiguousarray(mask[::step, ::step])
    if not own.any():
        return False, False
    mean = np.ascontiguousarray(room.mean[::step, ::step])
    distance = np.sqrt((np.square(small - gain * mean) * room.weight[::step, ::step]).sum(axis=2))
    apart = ((distance > p.OTHERS_SIGMAS) & (cv2.dilate(own, np.ones((5, 5), np.uint8)) == 0)).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(cv2.medianBlur(apart, 3), connectivity=8)
    height, area = int(np.count_nonzero(own.any(axis=1))), int(np.count_nonzero(own))
    places = [(own != 0).astype(np.uint8)]
    for k in range(1, len(stats)):
        _, _, across, down, count = stats[k]
        if down >= max(across, p.OTHERS_HEIGHT * height) and count >= p.OTHERS_AREA * area:
            places.append((labels == k).astype(np.uint8))
    shares = [outline_shares(small, mean, place) for place in places]
    uncovered = [known > max(p.CLEARLY_LEFT, UNCOVERED * here) for here, known in shares]
    return len(places) - sum(uncovered) >= 2, any(uncovered)


def gains(image: Image, room: Floats32, mask: Mask) -> Floats32:
    """(3,) light of an image over that of the room, by colour, outside the silhouette, from every n-th pixel."""
    step = max(1, round(image.shape[1] / p.ADVICE_PX))
    outside = np.ascontiguousarray(1 - mask[::step, ::step])
    now, empty = (np.array(cv2.mean(np.ascontiguousarray(one[::step, ::step]), outside)[:3]) for one in (image, room))
    return np.asarray(np.clip(now / np.maximum(empty, 1.0), *GAIN_RANGE), dtype=np.float32)


def reduced(image: Image, room: Background, gain: Floats32, mask: Mask, top: int, bottom: int) -> ReducedSurroundings:
    """The person of rows `top` to `bottom` with what is around and below, about ADVICE_PERSON_PX tall."""
    height = bottom - top + 1
    step = max(1, round(height / p.ADVICE_PERSON_PX))
    columns = np.flatnonzero(mask[top : bottom + 1 : step].any(axis=0))
    margin, below = round(SIDES * height), round(BELOW * height)
    left, right = max(0, int(columns[0]) - margin), int(columns[-1]) + margin + 1
    place = np.s_[max(0, top - step) : bottom + below : step, left:right:step]
    difference = np.asarray(image[place] - gain * room.mean[place], dtype=np.float32)
    distance = np.sqrt((np.square(difference) * room.weight[place]).sum(axis=2))
    return ReducedSurroundings(difference, distance, np.ascontiguousarray(mask[place]))


def person_sample(time_s: float, found: ReducedSurroundings, mask: Mask, top: int, bottom: int) -> PersonSample:
    """Measures of a silhouette (height, width) whose rows are `top` to `bottom`."""
    rows = np.flatnonzero(found.mask.any(axis=1))
    cut = any(int(np.count_nonzero(line)) >= p.CONTACT_PX for line in (mask[0], mask[-1], mask[:, 0], mask[:, -1]))
    height = float(bottom - top + 1)
    if len(rows) < THIRDS:
        return PersonSample(time_s, np.full(THIRDS, np.nan), 0.0, False, height, cut)
    first, last = int(rows[0]), int(rows[-1])
    lost = missing(found, first, last)
    holes = 100.0 * int(np.count_nonzero(lost)) / int(np.count_nonzero(found.mask))
    return PersonSample(time_s, _contrast(found, lost | (found.mask != 0), first, last), holes,
                        is_mirrored(found, first, last), height, cut)  # fmt: skip


def missing(found: ReducedSurroundings, first: int, last: int) -> Bools:
    """Pixels (h, w) of the person that are missing in the silhouette of rows `first` to `last`: its holes and cracks.

    Gaps of the silhouette are also real, between an arm and the trunk or between the legs: there the image shows the room.
    A pixel is missing where it lies in a gap and differs from the room by more than the noise.  Left out are pixels that
    the person next to them covers in part, and those near the floor, where a shadow differs too.
    """
    width = max(3, round(p.CLOSING * (last - first + 1))) | 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))
    region = cv2.copyMakeBorder(found.mask, width, width, width, width, cv2.BORDER_CONSTANT, value=0)
    closed = cv2.morphologyEx(region, cv2.MORPH_CLOSE, disc)[width:-width, width:-width]
    lost: Bools = (closed != 0) & (found.mask == 0) & (found.distance > p.ROOM_SIGMAS)
    lost[round(first + (1.0 - p.FLOOR_SHARE) * (last - first + 1)) :] = False
    return lost & ~_partly_covered(found)


def _partly_covered(found: ReducedSurroundings) -> Bools:
    """Pixels (h, w) beside the silhouette whose difference from the room is a small share of that of the silhouette."""
    wide = np.pad(found.difference, ((1, 1), (1, 1), (0, 0)))
    inside = np.pad(found.mask, 1) != 0
    own = np.square(found.difference).sum(axis=2)
    height, columns = found.mask.shape
    partly: Bools = np.zeros(found.mask.shape, dtype=np.bool_)
    for y, x in ((0, 1), (2, 1), (1, 0), (1, 2)):
        place = np.s_[y : y + height, x : x + columns]
        beside = wide[place]
        along = (found.difference * beside).sum(axis=2)
        share = along / np.maximum(np.square(beside).sum(axis=2), 1.0)
        partly |= inside[place] & (share > 0.0) & (share < p.PARTLY_COVERED) & (own - share * along < p.OTHER_COLOUR * own)
    return partly


def _contrast(found: ReducedSurroundings, region: Bools, first: int, last: int) -> Floats:
    levels = np.abs(found.difference).max(axis=2)
    values = np.full(THIRDS, np.nan)
    for third, rows in enumerate(np.array_split(np.arange(first, last + 1), THIRDS)):
        inside = levels[rows[0] : rows[-1] + 1][region[rows[0] : rows[-1] + 1]]
        if len(inside):
            values[third] = float(np.quantile(inside, p.CONTRAST_QUANTILE))
    return values


def is_mirrored(found: ReducedSurroundings, first: int, last: int) -> bool:
    """Whether the lower half of the silhouette of rows `first` to `last` is a faint mirror image of the upper half.

    That is so where a glossy floor mirrors enough for the mirror image to belong to the silhouette.  Legs resemble the
    trunk above them in outline, and trousers may be fainter than a shirt: so colours and pattern are compared too.
    """
    columns = np.flatnonzero(found.mask.any(axis=0))
    place = np.s_[first : last + 1, int(columns[0]) : int(columns[-1]) + 1]
    mask, difference = found.mask[place] != 0, found.difference[place]
    height = len(mask)
    reach = round(p.GLOSS_REACH * height)
    best, mirrored = p.GLOSS_LIKENESS, False
    for feet in range(ceil(p.GLOSS_FEET[0] * height), min(round(p.GLOSS_FEET[1] * height), height - reach) + 1):
        above, below = mask[feet - reach : feet][::-1], mask[feet : feet + reach]
        common = above & below
        likeness = int(np.count_nonzero(common)) / max(1, int(np.count_nonzero(above | below)))
        if likeness > best:
            best = likeness
            bright, faint = difference[feet - reach : feet][::-1], difference[feet : feet + reach]
            mirrored = _is_faint_image(bright[common], faint[common])
    return mirrored


def _is_faint_image(bright: Floats32, faint: Floats32) -> bool:
    """Whether differences from the room (n, 3) are fainter than others (n, 3), and like them in colour and pattern."""
    if np.abs(faint).max(axis=1).mean() >= p.GLOSS_CONTRAST * np.abs(bright).max(axis=1).mean():
        return False
    if _cosine(bright, faint) < p.GLOSS_COLOUR:
        return False
    return _cosine(bright - bright.mean(axis=0), faint - faint.mean(axis=0)) >= p.GLOSS_PATTERN


def _cosine(a: Floats32, b: Floats32) -> float:
    return float((a * b).sum()) / max(1e-6, float(np.linalg.norm(a) * np.linalg.norm(b)))
