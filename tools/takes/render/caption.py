"""Captions of a picture: title, time, recognized posture, and progress of the film."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.messages import Posture
from zenocap.common.recording.reader import TakeReader
from zenocap.common.topics import POSTURE
from zenocap.services.animator.parameters import CAPTION_HEIGHT_PX, FONT_OVERSAMPLING
from zenocap.tools.takes.render.theme import Bgr, Theme, bgr

FONT = cv2.FONT_HERSHEY_DUPLEX


@dataclass(frozen=True)
class Caption:
    """Texts of a picture.  title, time: bottom left and bottom right.  label: top left, such as a posture; "" for none.

    warning: in place of the label, such as "person lost".  progress: share of the film; None for no progress bar.
    """

    title: str
    time: str
    label: str = ""
    warning: str = ""
    progress: float | None = None


def write(image: Image, caption: Caption, theme: Theme) -> None:
    """Write a caption onto an image (h, w, 3) in place."""
    height, width = image.shape[:2]
    unit = min(height, width) / CAPTION_HEIGHT_PX
    margin = round(28 * unit)
    text, faint, accent = bgr(theme.text), bgr(theme.faint), bgr(theme.accent)
    line = height - margin - round(10 * unit)
    _put(image, caption.title, (margin, line), 0.60 * unit, text)
    _put(image, caption.time, (width - margin, line), 0.60 * unit, faint, right=True)
    if caption.warning or caption.label:
        colour = faint if caption.warning else accent
        _put(image, caption.warning or caption.label, (margin, margin + round(26 * unit)), 1.05 * unit, colour)
    if caption.progress is not None:
        thick = max(2, round(4 * unit))
        ended = round(width * min(max(caption.progress, 0.0), 1.0))
        image[height - thick :] = (0.75 * image[height - thick :] + 0.25 * np.array(faint)).astype(np.uint8)
        image[height - thick :, :ended] = accent


def _put(image: Image, text: str, at: tuple[int, int], scale: float, colour: Bgr, right: bool = False) -> None:
    """Write a line of text that starts, or with `right` ends, at a pixel; clipped at the image border."""
    thick = max(1, round(1.3 * FONT_OVERSAMPLING * scale))
    (width, above), below = cv2.getTextSize(text, FONT, scale * FONT_OVERSAMPLING, thick)
    if not width:
        return
    pad = 2 * FONT_OVERSAMPLING
    mask = np.zeros((above + below + 2 * pad, width + 2 * pad), dtype=np.uint8)
    cv2.putText(mask, text, (pad, pad + above), FONT, scale * FONT_OVERSAMPLING, 255, thick, cv2.LINE_AA)
    size = (max(1, mask.shape[1] // FONT_OVERSAMPLING), max(1, mask.shape[0] // FONT_OVERSAMPLING))
    coverage = cv2.resize(mask, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    left, top = at[0] - (size[0] if right else 0), at[1] - (pad + above) // FONT_OVERSAMPLING
    x, y = max(left, 0), max(top, 0)
    part = image[y : top + size[1], x : left + size[0]]
    coverage = coverage[y - top : y - top + part.shape[0], x - left : x - left + part.shape[1], None]
    part[:] = (part + coverage * (np.array(colour, dtype=np.float32) - part)).astype(np.uint8)


@dataclass(frozen=True)
class CaptionSpan:
    """A posture between two times, both inclusive, nanoseconds since the Unix epoch."""

    label: str
    start_ns: int
    end_ns: int


def read_labels(take: Path) -> tuple[CaptionSpan, ...]:
    """Return the recognized postures of a take, by their start.  Raises UserError."""
    found = []
    for received in TakeReader(take).envelopes([POSTURE]):
        if isinstance(received.message, Posture) and received.message.label is not None:
            found.append(CaptionSpan(received.message.label, received.message.start_ns, received.message.end_ns))
    return tuple(sorted(found, key=lambda span: span.start_ns))


def label_at(spans: tuple[CaptionSpan, ...], at_ns: int) -> str:
    """Return the posture at a time, of several the one that started last; "" for none."""
    return next((span.label for span in reversed(spans) if span.start_ns <= at_ns <= span.end_ns), "")
