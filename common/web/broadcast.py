"""Distribution of updates to pages: the latest of every key, at each page's own pace.

An update replaces one with the same key that is still waiting for a page, and further updates are sent to a page only
after its acknowledgement.  A slow page therefore skips frames without delay, and queues do not grow.
"""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import msgspec

from zenocap.common.web.messages import encode
from zenocap.common.web.parameters import MAX_PAGES, MAX_UNACKNOWLEDGED


@dataclass(frozen=True)
class EncodedUpdate:
    """Update of a page.  key: "pose/two-view" and so on.  data: JSON."""

    key: str
    data: bytes


def encoded(key: str, update: msgspec.Struct) -> EncodedUpdate:
    """An update of a page as JSON."""
    return EncodedUpdate(key, encode(update))


@dataclass(eq=False)
class PageQueue:
    """Updates for one open page.

    feed: name of what it shows.  waiting: updates by key, in the order in which their keys first came.
    superseded: number of updates that were replaced.
    unacknowledged: lists that were sent and not acknowledged.
    """

    feed: str = ""
    waiting: dict[str, bytes] = field(default_factory=dict)
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    unacknowledged: int = 0
    superseded: int = 0

    def put(self, update: EncodedUpdate) -> None:
        if update.key in self.waiting:
            self.superseded += 1
        self.waiting[update.key] = update.data
        self._set_ready()

    async def take(self) -> bytes:
        """Return all waiting updates as one JSON list; waits for an update, and for the page's acknowledgements."""
        await self.ready.wait()
        updates, self.waiting = self.waiting, {}
        self.unacknowledged += 1
        self._set_ready()
        return b"[" + b",".join(updates.values()) + b"]"

    def acknowledge(self) -> None:
        """Count one list as received by the page."""
        self.unacknowledged = max(0, self.unacknowledged - 1)
        self._set_ready()

    def _set_ready(self) -> None:
        if self.waiting and self.unacknowledged < MAX_UNACKNOWLEDGED:
            self.ready.set()
        else:
            self.ready.clear()


class Broadcaster:
    """Sends updates to all open pages.  Belongs to one asyncio loop; `publish`, `clear` and `pages` are thread-safe.

    on_first_page: called in the loop when a page opens and none was open: the full state must be published again.
    feeds: names of what a page can show; a page has one of them.
    """

    def __init__(
        self, loop: asyncio.AbstractEventLoop, on_first_page: Callable[[], None], feeds: Sequence[str] = ("",)
    ) -> None:
        self._loop = loop
        self._on_first_page = on_first_page
        self._pages: set[PageQueue] = set()
        self._latest: dict[str, dict[str, bytes]] = {feed: {} for feed in feeds}

    @property
    def pages(self) -> int:
        """Number of open pages."""
        return len(self._pages)

    def publish(self, feed: str | None, updates: Iterable[EncodedUpdate], *, kept: bool = True) -> None:
        """Send updates to all pages that show a feed; to all pages for None.  kept: also to pages that open later."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self.put, feed, tuple(updates), kept)

    def clear(self, feed: str) -> None:
        """Discard the latest updates of a feed, which pages that open later would get."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._latest[feed].clear)

    def put(self, feed: str | None, updates: tuple[EncodedUpdate, ...], kept: bool = True) -> None:
        """Same as `publish`, called in the loop."""
        for one in self._latest if feed is None else (feed,):
            if kept:
                self._latest[one].update((update.key, update.data) for update in updates)
        for page in self._pages:
            if feed in (None, page.feed):
                for update in updates:
                    page.put(update)

    def add(self, page: PageQueue) -> None:
        """Add a page and send it the latest updates.  Raises ValueError when there are MAX_PAGES already."""
        if len(self._pages) >= MAX_PAGES:
            raise ValueError(f"{MAX_PAGES} pages are open already")
        self._pages.add(page)
        self.send_latest(page)
        if len(self._pages) == 1:
            self._on_first_page()

    def remove(self, page: PageQueue) -> None:
        self._pages.discard(page)

    def select_feed(self, page: PageQueue, feed: str) -> None:
        """Change the feed that a page shows."""
        page.feed = feed
        self.send_latest(page)

    def send_latest(self, page: PageQueue) -> None:
        for key, data in self._latest[page.feed].items():
            page.put(EncodedUpdate(key, data))
