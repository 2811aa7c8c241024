"""Limits of the animator's connections: pending handshakes, permitted web pages.

A connection without a handshake costs its peer nothing and the animator a descriptor: a thousand of them would use up the
table of open files.  The oldest one therefore makes room for a new one, so that a page still opens while they come.
"""

from collections.abc import Callable, Collection, Hashable
from urllib.parse import urlsplit

from zenocap.common.rig.animator import ANY_ORIGIN, is_loopback


class WaitingConnections:
    """Connections without a completed handshake.  most: number at a time.  Belongs to one asyncio loop.

    displaced: number that were closed to make room.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._waiting: dict[Hashable, Callable[[], None]] = {}
        self.displaced = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, connection: Hashable, abort: Callable[[], None]) -> None:
        """Add a connection that was accepted; closes the oldest one with its `abort` when there are too many."""
        if len(self._waiting) >= self._most:
            oldest = next(iter(self._waiting))
            self.displaced += 1
            self._waiting.pop(oldest)()
        self._waiting[connection] = abort

    def remove(self, connection: Hashable) -> None:
        """Remove a connection that has completed its handshake or is closed; has no effect on others."""
        self._waiting.pop(connection, None)


def is_allowed_origin(origin: str | None, allowed: Collection[str]) -> bool:
    """Whether a page of `origin` may connect: a program (None), a page of this machine, or one of `allowed`."""
    if origin is None or ANY_ORIGIN in allowed or origin in allowed:
        return True
    parts = urlsplit(origin)
    return parts.scheme in ("http", "https") and is_loopback(parts.hostname or "")
