"""Correction of a foreground by a network's mask: person, surely none, unknown; by pixel.

After RT-SBS (Cioppa, Van Droogenbroeck and Braham 2020): where the network is sure, its result replaces that of the
subtraction; elsewhere, and at the edge of the person, the subtraction is kept.  The network is slow.  Between two of its
results the last one counts for the pixels that have not changed since the image that it was computed from.
"""

# Paper (added): [Two-view 1] has the subtraction alone; with `people = true` a network overrules it.

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image, Labels, Mask
from zenocap.common.jit import leaf_kernel
from zenocap.common.vision.foreground import BACKGROUND, STRONG

KEEP: Final = 0  # the subtraction decides
NOT_PERSON: Final = 1
PERSON: Final = 2

SURE_PERSON = 0.9  # probability above which a pixel shows a person; chosen by hand
SURE_ROOM = 0.02  # probability below which it shows none; chosen by hand
SEEN_IN_ROOM = 0.3  # by which the probability must exceed that of the picture of the room; chosen by hand
INSIDE, OUTSIDE = 0.008, 0.04  # sides of the crop by which PERSON is shrunk, and NOT_PERSON keeps away; chosen by hand
UNCHANGED_SIGMAS = 4.5  # of the noise, a channel's change up to which a pixel is unchanged; chosen by hand
UNCHANGED_SHARE = 0.03  # of the brightness, added to that; chosen by hand
LONGEST_NS = 2_000_000_000  # ns for which a result counts; chosen by hand


@dataclass(frozen=True)
class Semantics:
    """Result of a network for a part of an image.

    captured_ns: capture time of the image.  left, top: of the part in the image, px.  image: (height, width, 3) the part.
    verdict: (height, width) KEEP, NOT_PERSON or PERSON.
    """

    captured_ns: int
    left: int
    top: int
    image: Image
    verdict: Mask


def verdicts(person: Floats32, room: Floats32 | None = None) -> Mask:
    """KEEP, NOT_PERSON or PERSON for every pixel of a crop, (height, width).

    person: (height, width) probability of a person.  room: the same of the picture of the room, where the network may
    take a poster for a person; None: not known.
    """
    height = person.shape[0]
    most = cv2.dilate(person, _disc(OUTSIDE * height))
    least = cv2.erode(person, _disc(INSIDE * height))
    result = np.full(person.shape, KEEP, dtype=np.uint8)
    result[most < SURE_ROOM] = NOT_PERSON
    sure = least > SURE_PERSON
    if room is not None:
        sure &= person - room > SEEN_IN_ROOM
    result[sure] = PERSON
    return result


def decision(semantics: Semantics | None, frame: Image, captured_ns: int, noise: float) -> Mask | None:
    """KEEP, NOT_PERSON or PERSON for every pixel of a frame (height, width, 3); None where there is no result to use.

    captured_ns: of the frame.  noise: of a channel, standard deviation in grey levels.
    """
    if semantics is None or not 0 <= captured_ns - semantics.captured_ns <= LONGEST_NS:
        return None
    height, width = semantics.verdict.shape
    place = np.s_[semantics.top : semantics.top + height, semantics.left : semantics.left + width]
    result = np.full(frame.shape[:2], KEEP, dtype=np.uint8)
    _unchanged(
        frame[place], semantics.image, semantics.verdict, np.float32(UNCHANGED_SIGMAS * noise), result[place]
    )  # fmt: skip
    return result


def overrule(labels: Labels, decided: Mask) -> None:
    """Label PERSON pixels STRONG and NOT_PERSON pixels BACKGROUND, in place."""
    np.copyto(labels, np.uint8(STRONG), where=decided == PERSON)
    np.copyto(labels, np.uint8(BACKGROUND), where=decided == NOT_PERSON)


@leaf_kernel
def _unchanged(frame: Image, before: Image, verdict: Mask, same: np.float32, out: Mask) -> None:
    """Copy the verdicts of the pixels whose colour is that of `before`."""
    for y in range(verdict.shape[0]):
        for x in range(verdict.shape[1]):
            if verdict[y, x] == KEEP:
                continue
            changed = 0
            for c in range(3):
                value = np.float32(before[y, x, c])
                if abs(np.float32(frame[y, x, c]) - value) > same + np.float32(UNCHANGED_SHARE) * value:
                    changed += 1
            if changed == 0:
                out[y, x] = verdict[y, x]


def _disc(radius: float) -> Mask:
    size = 2 * max(1, round(radius)) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), dtype=np.uint8)
