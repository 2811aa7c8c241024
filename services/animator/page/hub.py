"""Between the animator's one loop and any number of pages: the newest of everything for each page, at its own pace.

Everything shown has a name; a newer piece takes the place of one of the same name that a page has not been sent yet, and a
page is sent more only when it says that it got what it was sent.  So a slow page loses frames of its own and is never
behind, and neither memory nor the loop notices it.
"""

import asyncio
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from services.animator.page.wire import Feed

MOST_PAGES = 64
UNDER_WAY = 3  # lists that a page may be behind: enough for 60 a second 50 ms away


@dataclass(frozen=True)
class Piece:
    """name: "pose/two-view" and so on.  data: JSON."""

    name: str
    data: bytes


@dataclass(eq=False)
class Page:
    """One open page.  waiting: pieces by name, in the order in which their names first came.  sent, superseded: pieces.

    behind: lists that it was sent and has not said to have got.
    """

    feed: Feed = "live"
    waiting: dict[str, bytes] = field(default_factory=dict)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    behind: int = 0
    sent: int = 0
    superseded: int = 0

    def put(self, piece: Piece) -> None:
        if piece.name in self.waiting:
            self.superseded += 1
        self.waiting[piece.name] = piece.data
        self._look()

    async def take(self) -> bytes:
        """Everything that waits, as one JSON list; waits for something, and for the page."""
        await self.news.wait()
        pieces, self.waiting = self.waiting, {}
        self.sent += len(pieces)
        self.behind += 1
        self._look()
        return b"[" + b",".join(pieces.values()) + b"]"

    def got(self) -> None:
        """The page says that it got a list."""
        self.behind = max(0, self.behind - 1)
        self._look()

    def _look(self) -> None:
        """Whether there is something to send."""
        if self.waiting and self.behind < UNDER_WAY:
            self.news.set()
        else:
            self.news.clear()


class Hub:
    """Belongs to one asyncio loop; `publish` and `pages` are for other threads.

    opened: called, in the loop, when the first page opens after there was none: what is shown has to be said anew.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, opened: Callable[[], None]) -> None:
        self._loop = loop
        self._opened = opened
        self._pages: set[Page] = set()
        self._last: dict[Feed, dict[str, bytes]] = {"live": {}, "take": {}}

    @property
    def pages(self) -> int:
        """How many are open."""
        return len(self._pages)

    @property
    def most_waiting(self) -> int:
        """Pieces that wait for the slowest page."""
        return max((len(page.waiting) for page in tuple(self._pages)), default=0)

    def publish(self, feed: Feed | None, pieces: Iterable[Piece]) -> None:
        """Show these to all pages of a feed, to all for None."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self.put, feed, tuple(pieces))

    def forget(self, feed: Feed) -> None:
        """What was shown of a feed is over."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._last[feed].clear)

    def put(self, feed: Feed | None, pieces: tuple[Piece, ...]) -> None:
        """As `publish`, in the loop."""
        for one in (feed,) if feed else self._last:
            self._last[one].update((piece.name, piece.data) for piece in pieces)
        for page in self._pages:
            if feed in (None, page.feed):
                for piece in pieces:
                    page.put(piece)

    def enter(self, page: Page) -> None:
        """A page opens; it gets what was last shown.  Raises ValueError when there are MOST_PAGES."""
        if len(self._pages) >= MOST_PAGES:
            raise ValueError(f"{MOST_PAGES} pages are open already")
        self._pages.add(page)
        self.show_last(page)
        if len(self._pages) == 1:
            self._opened()

    def leave(self, page: Page) -> None:
        self._pages.discard(page)

    def watch(self, page: Page, feed: Feed) -> None:
        """A page turns to another feed."""
        page.feed = feed
        self.show_last(page)

    def show_last(self, page: Page) -> None:
        for name, data in self._last[page.feed].items():
            page.put(Piece(name, data))

    @property
    def last(self) -> Mapping[Feed, Mapping[str, bytes]]:
        """What a page that opens now gets."""
        return self._last
