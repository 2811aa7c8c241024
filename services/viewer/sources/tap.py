"""The images of a running source, for a film."""

from collections.abc import Callable
from typing import Protocol

from zenocap.common.arrays import Image
from zenocap.common.messages import FilmQuery, FilmReply
from zenocap.common.runtime.clock import Clock


class Tap:
    """Passes the images of a running source on, at the calibrated size and not rectified, while a film is open.

    away: how often the camera failed since `open`.  failure: always empty: a viewer opens its camera again.
    """

    def __init__(self, size: tuple[int, int], fps: float) -> None:
        """size: calibrated (width, height), px.  fps: of the viewer."""
        self._size, self._fps = size, fps
        self._receive: Callable[[Image, int], None] | None = None
        self.away, self.failure = 0, ""

    @property
    def is_open(self) -> bool:
        return self._receive is not None

    def offer(self, image: Image, captured_ns: int) -> None:
        """Called by the source for every frame."""
        receive = self._receive
        if receive is not None:
            receive(image, captured_ns)

    def lost(self) -> None:
        """Called by the source when its camera fails and will be opened again."""
        self.away += self.is_open

    def size_and_rate(self, query: FilmQuery) -> tuple[tuple[int, int], float]:
        return self._size, self._fps

    def open(self, query: FilmQuery, receive: Callable[[Image, int], None]) -> None:
        self.away = 0
        self._receive = receive

    def close(self) -> None:
        self._receive = None


class Films(Protocol):
    """What films the images of a `Tap` at the command of another program."""

    def sender(self) -> str: ...

    def answer(self, query: FilmQuery) -> FilmReply: ...

    def check(self) -> None: ...

    def close(self) -> None: ...


Filming = Callable[[Tap, Clock], Films]
