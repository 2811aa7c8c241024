"""Who may connect to a port: number of connections without a handshake, hosts, origins of web pages, tokens.

A connection without a handshake costs its peer nothing and this process a descriptor: a thousand of them would use up the
table of open files.  The oldest one therefore makes room for a new one, so that a page still opens while they come.
"""

import hmac
from collections.abc import Callable, Collection, Hashable, Mapping
from urllib.parse import urlsplit

from zenocap.common.rig.animator import ANY_ORIGIN, PageTable, is_loopback


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


def refusal(
    headers: Mapping[str, str], table: PageTable, *, socket: bool, token: str | None, program: str, options: str
) -> str | None:
    """Reason for refusing a request; None for a permitted one.

    socket: whether it is for a WebSocket.  token: that was given; None where none is required.  program, options: see
    `PageContent`.
    """
    host = headers.get("Host", "")
    if is_loopback(table.host) and not is_loopback(urlsplit(f"//{host}").hostname or ""):
        return "this page is served to its own machine only: open it as http://127.0.0.1 or http://localhost"
    if socket and not is_allowed_origin(headers.get("Origin"), table.origins, host):
        return other_site(options)
    if table.token is not None and token is not None and not hmac.compare_digest(token.encode(), table.token.encode()):
        return f"a token is required: open the address that the {program} prints"
    return None


def is_allowed_origin(origin: str | None, allowed: Collection[str], own: str | None = None) -> bool:
    """Whether a page of `origin` may connect: a program (None), a page of this server, or one of `allowed`.

    own: host and port of this server; None: pages of any server on this machine may connect.
    """
    if origin is None or ANY_ORIGIN in allowed or origin in allowed:
        return True
    parts = urlsplit(origin)
    if own is not None:
        return parts.netloc == own
    return parts.scheme in ("http", "https") and is_loopback(parts.hostname or "")


def other_site(options: str) -> str:
    """Reason for refusing a page of another origin.  options: prefix of those of the server."""
    hint = "" if options.startswith("-") else f"; allowed: also {options}origins of the rig file"
    return f"requested by a page of another site{hint}"
