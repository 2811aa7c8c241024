"""Camera pictures for the page on a take, at the player's time."""

import logging
import threading
import time
from collections.abc import Callable, Iterable

from zenocap.common.errors import UserError
from zenocap.common.web.broadcast import Broadcaster, encoded
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.parameters import MAX_PICTURE_LEAD_S, PICTURES_PER_S

logger = logging.getLogger(__name__)

Pictures = Callable[[int], Iterable[tuple[str, bytes]]]
"""Viewer and picture (JPEG) of every camera at a time of the take, ns."""


class PictureFeed:
    """A thread that sends pictures while the player moves.  start_ns: time of the take at position 0."""

    def __init__(self, pictures: Pictures, start_ns: int, broadcaster: Broadcaster) -> None:
        self._pictures, self._start_ns, self._broadcaster = pictures, start_ns, broadcaster
        self._wanted: tuple[float, float] | None = None  # position of the player and its rate
        self._lead_s = 0.0  # time that the last pictures took
        self._changed = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="pictures", daemon=True)
        self._thread.start()

    def show(self, position_s: float, rate: float = 0.0) -> None:
        """Send the pictures of a position of the player; callable from any thread, never blocks.

        rate: at which the take plays, 0 while it is paused: pictures are of the position that it reaches while they are
        made, as long as the last ones took.
        """
        if (position_s, rate) != self._wanted:
            self._wanted = position_s, rate
            self._changed.set()

    def close(self) -> None:
        self._closed = True
        self._changed.set()
        self._thread.join(5.0)

    def _run(self) -> None:
        while True:
            self._changed.wait()
            self._changed.clear()
            if self._closed:
                return
            begun, wanted = time.monotonic(), self._wanted
            if wanted is None or self._broadcaster.pages == 0:
                continue
            position_s = wanted[0] + wanted[1] * min(self._lead_s, MAX_PICTURE_LEAD_S)
            try:
                found = list(self._pictures(self._start_ns + round(1e9 * position_s)))
            except UserError as error:
                logger.warning("no more pictures: %s", error)
                return
            self._broadcaster.publish(
                "take", [encoded(f"preview/{id}", pm.PreviewUpdate(id, jpeg, position_s)) for id, jpeg in found]
            )
            self._lead_s = time.monotonic() - begun
            time.sleep(max(0.0, 1.0 / PICTURES_PER_S - (time.monotonic() - begun)))
