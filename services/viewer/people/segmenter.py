"""The network beside the frames: asked at a slow pace, in a thread of its own or at fixed frames.

Live, one thread of the viewer computes one crop at a time, and the frame path only cuts the crop and takes up the last
result.  `zenocap track` computes it at once, whenever the time of the frames has advanced by the period, so that two runs
give equal bytes.
"""

from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

import numpy as np

from zenocap.common.arrays import Floats32, Image
from zenocap.common.vision.semantics import Semantics, verdicts
from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import PEOPLE_PERIOD_NS
from zenocap.services.viewer.people.crops import Square, around, cut, tiles
from zenocap.services.viewer.people.network import Find


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
