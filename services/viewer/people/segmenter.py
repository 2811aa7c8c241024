"""The network beside the frames: asked at a slow pace, in a thread of its own or at fixed frames.

Live, one thread of the viewer computes one crop at a time, and the frame path only cuts the crop and takes up the last
result.  `zenocap track` computes it at once, whenever the time of the frames has advanced by the period, so that two runs
give equal bytes.
"""

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from zenocap.common.arrays import Floats32, Image
from zenocap.common.vision.semantics import Semantics, verdicts
from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import PEOPLE_MARGIN, PEOPLE_PERIOD_NS, PEOPLE_SMALLEST_PX
from zenocap.services.viewer.people.network import Find

T = TypeVar("T", np.uint8, np.float32)


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


def cut(image: NDArray[T], square: Square) -> NDArray[T]:
    """The pixels of a square, (side, side, 3); beyond the border of the image its last pixels are repeated."""
    height, width = image.shape[:2]
    left, top, right, bottom = square.inside((width, height))
    part = image[top:bottom, left:right]
    above, before = top - square.top, left - square.left
    below, after = square.top + square.side - bottom, square.left + square.side - right
    return np.asarray(cv2.copyMakeBorder(part, above, below, before, after, cv2.BORDER_REPLICATE), dtype=image.dtype)


class PeopleSegmenter:
    """The network of one viewer, and its last result."""

    def __init__(self, find: Find, *, threaded: bool, period_ns: int = PEOPLE_PERIOD_NS) -> None:
        """find: see `Find`.  threaded: whether it runs in a thread.  period_ns: between two questions, at least, ns."""
        self._find, self._period_ns = find, period_ns
        self._pool = ThreadPoolExecutor(1, "people") if threaded else None
        self._future: Future[Semantics] | None = None
        self._semantics: Semantics | None = None
        self._asked_ns: int | None = None
        self._searched = 0  # tiles, since there was a person

    def latest(self, frame: Frame, room: Floats32 | None, person: Extents | None) -> Semantics | None:
        """The last result; a next one is begun when it is due.

        room: (height, width, 3) picture of the background model, None where it has none.  person: in the last frame.
        Raises what the network raised.
        """
        if self._future is not None and self._future.done():
            future, self._future = self._future, None
            self._semantics = future.result()
        if self._future is None and self._due(frame.captured_ns):
            self._asked_ns = frame.captured_ns
            square = self._square(frame, person)
            seen = cut(frame.image, square)
            empty = None if room is None else np.clip(np.rint(cut(room, square)), 0, 255).astype(np.uint8)
            size = (frame.image.shape[1], frame.image.shape[0])
            work = partial(semantics_of, self._find, seen, empty, square, size, frame.captured_ns)
            if self._pool is None:
                self._semantics = work()
            else:
                self._future = self._pool.submit(work)
        return self._semantics

    def close(self) -> None:
        """Wait for the end of the present crop, and end the thread."""
        if self._pool is not None:
            self._pool.shutdown()

    def _due(self, captured_ns: int) -> bool:
        """Also after a jump back in time, as from the video of the T-pose to the main one."""
        return self._asked_ns is None or not 0 <= captured_ns - self._asked_ns < self._period_ns

    def _square(self, frame: Frame, person: Extents | None) -> Square:
        size = (frame.image.shape[1], frame.image.shape[0])
        if person is not None:
            self._searched = 0
            return around(person, size)
        squares = tiles(size)
        self._searched += 1
        return squares[(self._searched - 1) % len(squares)]


def semantics_of(
    find: Find, seen: Image, empty: Image | None, square: Square, size: tuple[int, int], captured_ns: int
) -> Semantics:
    """Result of the network for a square of a frame.

    seen, empty: (side, side, 3) of the frame and of the picture of the room.  size: (width, height) of the frame.
    """
    verdict = verdicts(find(seen), None if empty is None else find(empty))
    left, top, right, bottom = square.inside(size)
    inside = np.s_[top - square.top : bottom - square.top, left - square.left : right - square.left]
    return Semantics(captured_ns, left, top, np.ascontiguousarray(seen[inside]), np.ascontiguousarray(verdict[inside]))
