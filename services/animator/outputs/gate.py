"""Gate in front of a WebSocket server without limits of its own, such as Foxglove's.

It accepts connections, checks their request, and passes the bytes of admitted ones on in both directions.

Admitted: requests that are complete within HANDSHAKE_TIMEOUT_S, of a program or an allowed web page, up to a maximum
number of connections.  Others get an HTTP status with the reason.  The server behind it listens on an address of this
machine that only the gate has.
"""

import asyncio
import logging
import secrets
import socket
import sys
import threading
from collections import Counter
from collections.abc import Collection, Mapping
from contextlib import suppress
from http import HTTPStatus

from zenocap.common.runtime.foreign_text import printable
from zenocap.common.web.access import Connections, is_allowed_origin, other_site
from zenocap.common.web.parameters import CLOSE_TIMEOUT_S, HANDSHAKE_TIMEOUT_S
from zenocap.services.animator.parameters import MAX_HANDSHAKE_BYTES

logger = logging.getLogger(__name__)

PIECE = 1 << 16  # bytes passed on at a time, and kept for a receiver that does not read


class Refusal(Exception):
    """A request that is not passed on: status and reason of the answer."""

    def __init__(self, status: HTTPStatus, reason: str) -> None:
        super().__init__(reason)
        self.status = status


def hidden_host() -> str:
    """A loopback address for the server behind a gate; on Linux a random one, which a web page cannot find."""
    if sys.platform != "linux":
        return "127.0.0.1"
    return f"127.{secrets.randbelow(254) + 1}.{secrets.randbelow(256)}.{secrets.randbelow(254) + 1}"


class Gate:
    """Serves from construction to `close`, in a thread of its own.

    key: of the output in the rig file, for log lines.  behind: address and port of the server.  origins: of web pages that
    may connect, beside those of this machine.  most: connections at a time.
    """

    def __init__(
        self, key: str, host: str, port: int, behind: tuple[str, int], origins: Collection[str], most: int
    ) -> None:
        """Raises OSError when the address cannot be listened on."""
        self._key, self._behind, self._origins, self._most = key, behind, tuple(origins), most
        self._connections = Connections(logger, key)
        self._counts = Counter[str]()
        self._open = 0
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(self._connections.on_loop_error)
        try:
            serving = asyncio.start_server(self._serve, host, port, limit=MAX_HANDSHAKE_BYTES)
            self._server = self._loop.run_until_complete(serving)
        except OSError:
            self._loop.close()
            raise
        self._thread = threading.Thread(target=self._run, name=key, daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        return int(self._server.sockets[0].getsockname()[1])

    def counts(self) -> Mapping[str, int]:
        """Connections refused, malformed, closed without a request (timed_out) or to make room (displaced)."""
        return {**self._counts, **self._connections.counts()}

    def close(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(2 * CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        self._loop.run_forever()
        self._server.close()
        self._loop.run_until_complete(_end_tasks())
        self._loop.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._connections.add(writer, writer.transport.abort)
        try:
            request = await self._request(reader)
            await self._pass_on(request, reader, writer)
        except Refusal as refusal:
            self._counts["refused"] += 1
            with suppress(OSError, TimeoutError):
                writer.write(_answer(refusal))
                await asyncio.wait_for(writer.drain(), CLOSE_TIMEOUT_S)
        except TimeoutError:
            self._counts["timed_out"] += 1
        except (OSError, asyncio.CancelledError):  # it is gone, or the gate closes
            pass
        finally:
            self._connections.remove(writer)
            writer.close()

    async def _request(self, reader: asyncio.StreamReader) -> bytes:
        """The request with its headers, checked.  Raises Refusal, TimeoutError and OSError."""
        try:
            request = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), HANDSHAKE_TIMEOUT_S)
        except asyncio.IncompleteReadError as error:
            raise ConnectionResetError from error
        except asyncio.LimitOverrunError as error:
            raise self._malformed(f"a request of more than {MAX_HANDSHAKE_BYTES} bytes") from error
        first, *lines = request.decode("latin-1").split("\r\n")[:-2]
        if not (first.startswith("GET ") and first.endswith(" HTTP/1.1")):
            raise self._malformed(f"no GET request: {printable(first, 60)}")
        headers: dict[str, list[str]] = {}
        for line in lines:
            name, _, value = line.partition(":")
            headers.setdefault(name.lower(), []).append(value.strip())
        if headers.get("upgrade", [""])[0].lower() != "websocket":
            raise Refusal(HTTPStatus.UPGRADE_REQUIRED, "a WebSocket for Foxglove and Lichtblick: connect with one of these")
        origins = headers.get("origin", [])
        if len(origins) > 1 or not is_allowed_origin(next(iter(origins), None), self._origins):
            raise Refusal(HTTPStatus.FORBIDDEN, other_site(f"{self._key}."))
        return request

    async def _pass_on(self, request: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Connect to the server and pass everything on until either side ends."""
        if self._open >= self._most:
            raise Refusal(HTTPStatus.SERVICE_UNAVAILABLE, f"{self._most} programs are connected already")
        self._open += 1
        try:
            inner_reader, inner_writer = await asyncio.open_connection(*self._behind)
            self._connections.remove(writer)
            for one in (writer, inner_writer):
                one.transport.set_write_buffer_limits(PIECE)
                link: socket.socket = one.get_extra_info("socket")
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            inner_writer.write(request)
            ways = [asyncio.ensure_future(_copy(reader, inner_writer)), asyncio.ensure_future(_copy(inner_reader, writer))]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)
                inner_writer.close()
        finally:
            self._open -= 1

    def _malformed(self, what: str) -> Refusal:
        self._connections.count_error("malformed request")
        return Refusal(HTTPStatus.BAD_REQUEST, what)


async def _end_tasks() -> None:
    """Cancel all other tasks of this loop and wait until they have ended, at most CLOSE_TIMEOUT_S."""
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    for task in tasks:
        task.cancel()
    if tasks:
        await asyncio.wait(tasks, timeout=CLOSE_TIMEOUT_S)


async def _copy(source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
    """Pass bytes on until the source ends; waits for the sink, so that nothing piles up."""
    while data := await source.read(PIECE):
        sink.write(data)
        await sink.drain()


def _answer(refusal: Refusal) -> bytes:
    body = f"{refusal}\n".encode()
    head = f"HTTP/1.1 {int(refusal.status)} {refusal.status.phrase}\r\n"
    fields = f"Content-Type: text/plain; charset=utf-8\r\nContent-Length: {len(body)}\r\nConnection: close\r\n\r\n"
    return (head + fields).encode() + body
