"""People in images of the empty scene, and edges that tell which of two images shows them."""

from collections.abc import Sequence

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Floats32, Image, Mask
from zenocap.common.vision.background import learn_median
from zenocap.common.vision.extraction import extract
from zenocap.common.vision.silhouette import SilhouetteOptions

EDGE_RATIO = 1.5  # of edges at a pixel, from which only one of two images has one there; chosen by hand
REDUCED_PX = 160  # longest side of the images that are compared with each other; chosen by hand
SAMPLED = 15  # images whose median is compared with all of them; chosen by hand
FEWEST_IMAGES = 3  # among which people are looked for: of two, both may show one
LEAST_EMPTY, FEWEST_EMPTY = 4, 2  # images without people that a background needs, of 8 and more, of fewer; chosen by hand
UNCOVERED = 2.0  # from so many times the edges of the usual image, a person has left it in the others; chosen by hand
SHORTEST_BREAK = 2  # images without a person between two with one, which are taken for such too; chosen by hand
OPTIONS = SilhouetteOptions()
BOTH_ENDS = 2  # runs of images with people: a person leaves, and one enters; more is a thing that moves for ever


def with_people(images: Sequence[Image]) -> Bools:
    """(n,) images (height, width, 3) of the scene that show a person who is not in the others.

    All False where it cannot be decided: for two images, for a person in half of less than 8 or who stays in place, and for
    what comes and goes, such as a curtain or a screen.
    """
    none = np.zeros(len(images), dtype=np.bool_)
    if len(images) < FEWEST_IMAGES:
        return none
    step = max(1, round(max(images[0].shape[:2]) / REDUCED_PX))
    small = [np.ascontiguousarray(image[::step, ::step]) for image in images]
    usual = learn_median(small[:: -(-len(small) // SAMPLED)])
    found, here, known = none.copy(), 0.0, 0.0
    for k, image in enumerate(small):
        silhouette = extract(usual, image, OPTIONS)
        if silhouette is not None:
            found[k] = True
            shares = outline_shares(image, usual.mean, silhouette.mask)
            here, known = here + shares[0], known + shares[1]
    if known > UNCOVERED * here:  # the person is in most of the images, and has left an uncovered place in the others
        found = ~found
    found = _without_breaks(found)
    runs = int(np.count_nonzero(np.diff(np.concatenate([[False], found]).astype(np.int8)) == 1))
    return found if runs <= BOTH_ENDS else none


def outline_shares(image: Image, room: Floats32, mask: Mask) -> tuple[float, float]:
    """Share of the outline of a mask (height, width) at which only the image has an edge, and at which only the room has.

    About 1 and 0 for a person in front of the room, 0 and 1 for a place that one has left, 0 and 0 without an outline.
    """
    outline = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) != 0
    here, known, count = edges(image)[outline], edges(room)[outline], max(1, int(np.count_nonzero(outline)))
    return float(np.sum(here > EDGE_RATIO * known)) / count, float(np.sum(known > EDGE_RATIO * here)) / count


def edges(image: Image | Floats32) -> Floats32:
    """Strength of the edges, (height, width): the largest of the channels, of the slightly blurred image."""
    smooth = cv2.GaussianBlur(image, (3, 3), 0)
    across, down = cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    blue, green, red = cv2.split(cv2.magnitude(across, down))
    return np.asarray(cv2.max(cv2.max(blue, green), red), dtype=np.float32)


def _without_breaks(found: Bools) -> Bools:
    """Images with people, and short breaks; where FEWEST_EMPTY remain, the ones beside them too: a hand at the border."""
    beside = SHORTEST_BREAK + 1
    around = np.pad(found.astype(np.uint8), beside)[None]
    closed = cv2.morphologyEx(around, cv2.MORPH_CLOSE, np.ones((1, beside), np.uint8))[:, beside:-beside]
    wide = cv2.dilate(closed, np.ones((1, 3), np.uint8))
    return np.asarray((wide if np.count_nonzero(wide == 0) >= FEWEST_EMPTY else closed)[0] != 0, dtype=np.bool_)
