"""Access to a port: connections without a handshake, hosts, origins of web pages, tokens.

A connection without a handshake costs its peer nothing and this process a descriptor: a thousand of them would use up the
table of open files.  The oldest one therefore makes room for a new one, so that a page still opens while they come.
"""

import asyncio
import hmac
import logging
from collections.abc import Callable, Collection, Hashable, Mapping
from ipaddress import ip_address
from socket import gethostname
from typing import Any
from urllib.parse import urlsplit

from zenocap.common.rig.animator import ANY_ORIGIN, PageTable, is_loopback
from zenocap.common.runtime.logs import OncePerInterval
from zenocap.common.web.parameters import ERROR_LINE_PERIOD_S, MAX_WAITING


class Connections:
    """Connections to a port that have no completed handshake, and errors of clients.  Belongs to one asyncio loop.

    most: that wait at a time.  errors: counted, and logged in one line per kind and ERROR_LINE_PERIOD_S, without the
    tracebacks that asyncio would write.  name: of the port in these lines.
    """

    def __init__(self, logger: logging.Logger, name: str = "", most: int = MAX_WAITING) -> None:
        self._logger, self._prefix, self._most = logger, f"{name}: " if name else "", most
        self._waiting: dict[Hashable, Callable[[], None]] = {}
        self._displaced = 0
        self.errors = OncePerInterval(logger, ERROR_LINE_PERIOD_S)

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, connection: Hashable, abort: Callable[[], None]) -> None:
        """Add a connection that was accepted; closes the oldest one with its `abort` when there are too many."""
        if len(self._waiting) >= self._most:
            oldest = next(iter(self._waiting))
            self._displaced += 1
            self._waiting.pop(oldest)()
        self._waiting[connection] = abort

    def remove(self, connection: Hashable) -> None:
        """Remove a connection that has completed its handshake or is closed; has no effect on others."""
        self._waiting.pop(connection, None)

    def count_error(self, text: str, error: BaseException | None = None) -> None:
        """Count an error, such as bytes that are no HTTP request."""
        info = (type(error), error, None) if error is not None else None
        record = self._logger.makeRecord(self._logger.name, logging.ERROR, "", 0, f"{self._prefix}{text}", (), info)
        self.errors.handle(record)

    def on_loop_error(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handler for errors of the loop, such as a full table of open files."""
        self.count_error(str(context.get("message")), context.get("exception"))

    def counts(self) -> Mapping[str, int]:
        """Connections closed to make room (displaced), and errors (malformed), where there are any."""
        found = {"displaced": self._displaced, "malformed": self.errors.counts.total()}
        return {kind: count for kind, count in found.items() if count}


def refusal(
    headers: Mapping[str, str], table: PageTable, *, socket: bool, token: str | None, program: str, options: str
) -> str | None:
    """Reason for refusing a request; None for a permitted one.

    socket: whether it is for a WebSocket.  token: that was given; None where none is required.  program, options: see
    `PageContent`.
    """
    host = headers.get("Host", "")
    if is_loopback(table.host) and not is_loopback(host_name(host)):
        return "this page is served to its own machine only: open it as http://127.0.0.1 or http://localhost"
    if table.token is None and not is_own_name(host_name(host), table.host):
        return f"Host {host_name(host)[:64]!r}: allowed: the address of this machine, or its name"
    if socket and not is_allowed_origin(headers.get("Origin"), table.origins, host):
        return other_site(options)
    if table.token is not None and token is not None and not hmac.compare_digest(token.encode(), table.token.encode()):
        return f"a token is required: open the address that the {program} prints"
    return None


def host_name(host: str) -> str:
    """Name or address in a `Host` header or an origin; "" where there is none."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:  # brackets without an address
        return ""


def is_own_name(name: str, listened: str = "") -> bool:
    """Whether only a program that means this machine asks for this name: an address, or a name of a local network.

    DNS rebinding asks for a name of the attacker's, which is one of the public DNS.  listened: the host of this server.
    """
    try:
        ip_address(name)
    except ValueError:
        own = (listened.lower(), gethostname().lower())
        return bool(name) and ("." not in name or name.endswith(".local") or name in own)
    return True


def is_allowed_origin(origin: str | None, allowed: Collection[str], own: str | None = None) -> bool:
    """Whether a page of `origin` may connect: a program (None), a page of this server, or one of `allowed`.

    own: host and port of this server; None: pages of any server on this machine may connect.
    """
    if origin is None or ANY_ORIGIN in allowed or origin in allowed:
        return True
    scheme, _, netloc = origin.partition("://")
    return netloc == own if own is not None else scheme in ("http", "https") and is_loopback(host_name(netloc))


def other_site(options: str) -> str:
    """Reason for refusing a page of another origin.  options: prefix of those of the server."""
    hint = "" if options.startswith("-") else f"; allowed: also {options}origins of the rig file"
    return f"requested by a page of another site{hint}"
