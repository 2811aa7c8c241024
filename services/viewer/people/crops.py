"""Image crops for the network: around the person, or tiles in turn."""

from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.parameters import PEOPLE_MARGIN, PEOPLE_SMALLEST_PX


@dataclass(frozen=True)
class Square:
    """A square of an image, which may reach beyond it.  left, top: of its corner, px.  side: px."""

    left: int
    top: int
    side: int

    def inside(self, size: tuple[int, int]) -> tuple[int, int, int, int]:
        """Left, top, right, bottom (exclusive) of the part inside an image of size (width, height)."""
        width, height = size
        right, bottom = min(width, self.left + self.side), min(height, self.top + self.side)
        return max(0, self.left), max(0, self.top), right, bottom


def around(person: Extents, size: tuple[int, int]) -> Square:
    """Square around a person with a margin, inside the image of size (width, height) where it fits."""
    tall = max(person.rightmost - person.leftmost, person.lowest - person.highest) + 1
    side = max(PEOPLE_SMALLEST_PX, round(tall * (1.0 + 2.0 * PEOPLE_MARGIN)))
    x, y = person.centre()
    return Square(_fitted(x - side / 2, side, size[0]), _fitted(y - side / 2, side, size[1]), side)


def _fitted(start: float, side: int, length: int) -> int:
    """First pixel of a square along an axis of the image: shifted into it, or centred on it when the square is longer."""
    if side >= length:
        return (length - side) // 2
    return int(min(max(0, round(start)), length - side))


def tiles(size: tuple[int, int]) -> tuple[Square, ...]:
    """Squares that cover an image of size (width, height) with half overlap: of its short side, then of half of that."""
    found = []
    for side in (min(size), min(size) // 2):
        columns, rows = _starts(size[0], side), _starts(size[1], side)
        found += [Square(left, top, side) for top in rows for left in columns]
    return tuple(found)


def _starts(length: int, side: int) -> list[int]:
    count = 1 + -(-2 * (length - side) // side)
    return [round(k * (length - side) / max(1, count - 1)) for k in range(count)]


T = TypeVar("T", np.uint8, np.float32)


def cut(image: NDArray[T], square: Square) -> NDArray[T]:
    """The pixels of a square, (side, side, 3); beyond the border of the image its last pixels are repeated."""
    height, width = image.shape[:2]
    left, top, right, bottom = square.inside((width, height))
    part = image[top:bottom, left:right]
    above, before = top - square.top, left - square.left
    below, after = square.top + square.side - bottom, square.left + square.side - right
    return np.asarray(cv2.copyMakeBorder(part, above, below, before, after, cv2.BORDER_REPLICATE), dtype=image.dtype)
