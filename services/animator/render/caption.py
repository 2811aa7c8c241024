"""What is written on a picture: whose it is, when, what was recognised, and how far the film is."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from services.animator.render.look import Bgr, Look, bgr

Image = NDArray[np.uint8]

FONT = cv2.FONT_HERSHEY_DUPLEX
FINER = 3  # letters are drawn so much larger, because their lines have whole widths
AT_HEIGHT = 720  # of a picture in which sizes are as they are here


@dataclass(frozen=True)
class Caption:
    """title, moment: below on the left and on the right.  label: above, such as a posture; "" for none.

    warning: in its place, such as that the person is lost.  share: of the film that has been seen; None without a bar.
    """

    title: str
    moment: str
    label: str = ""
    warning: str = ""
    share: float | None = None


def write(image: Image, caption: Caption, look: Look) -> None:
    """Write on an image (h, w, 3) in place."""
    height, width = image.shape[:2]
    unit = min(height, width) / AT_HEIGHT
    margin = round(28 * unit)
    text, faint, accent = bgr(look.text), bgr(look.faint), bgr(look.accent)
    line = height - margin - round(10 * unit)
    _put(image, caption.title, (margin, line), 0.60 * unit, text)
    _put(image, caption.moment, (width - margin, line), 0.60 * unit, faint, right=True)
    if caption.warning or caption.label:
        colour = faint if caption.warning else accent
        _put(image, caption.warning or caption.label, (margin, margin + round(26 * unit)), 1.05 * unit, colour)
    if caption.share is not None:
        thick = max(2, round(4 * unit))
        ended = round(width * min(max(caption.share, 0.0), 1.0))
        image[height - thick :] = (0.75 * image[height - thick :] + 0.25 * np.array(faint)).astype(np.uint8)
        image[height - thick :, :ended] = accent


def _put(image: Image, words: str, place: tuple[int, int], scale: float, colour: Bgr, right: bool = False) -> None:
    """Words on a line that begins, or with `right` ends, at `place`; what is outside the image is left out."""
    thick = max(1, round(1.3 * FINER * scale))
    (width, above), below = cv2.getTextSize(words, FONT, scale * FINER, thick)
    if not width:
        return
    pad = 2 * FINER
    mask = np.zeros((above + below + 2 * pad, width + 2 * pad), dtype=np.uint8)
    cv2.putText(mask, words, (pad, pad + above), FONT, scale * FINER, 255, thick, cv2.LINE_AA)
    size = (max(1, mask.shape[1] // FINER), max(1, mask.shape[0] // FINER))
    share = cv2.resize(mask, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    left, top = place[0] - (size[0] if right else 0), place[1] - (pad + above) // FINER
    x, y = max(left, 0), max(top, 0)
    part = image[y : top + size[1], x : left + size[0]]
    share = share[y - top : y - top + part.shape[0], x - left : x - left + part.shape[1], None]
    part[:] = (part + share * (np.array(colour, dtype=np.float32) - part)).astype(np.uint8)
