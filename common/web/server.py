"""Server of a page: files and a WebSocket on one port, in a thread of its own.

Access (`access.refusal`): on a loopback address, the browser must have requested a loopback host by name, which stops DNS
rebinding; a token is required where the table has one.  A WebSocket is opened only for a page from this server, or of an
origin that the table allows.  The content security policy forbids the page to load anything from elsewhere.

Limits: connections without a handshake by number and time, open pages by number, and what is logged of malformed requests.
"""

import asyncio
import logging
import os
import socket
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any, Generic, cast
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from zenocap.common.rig.animator import PageTable
from zenocap.common.runtime.signals import WAIT_S
from zenocap.common.web import parameters as p
from zenocap.common.web.access import Connections, refusal
from zenocap.common.web.broadcast import Broadcaster, PageQueue
from zenocap.common.web.content import OFFERED_PATH, Answer, OfferedFiles, PageContent
from zenocap.common.web.messages import Acknowledge, C, NoticeUpdate, encode

logger = logging.getLogger(__name__)

SOCKET_PATH, INDEX = "/socket", "index.html"
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


class PageServer(Generic[C]):
    """Serves a page from `listen` to `close`.

    on_command: called in the server's thread with every command of a page.  on_first_page: see `Broadcaster`.
    """

    def __init__(
        self, table: PageTable, on_command: Callable[[PageQueue, C], None], on_first_page: Callable[[], None],
        content: PageContent[C],
    ) -> None:  # fmt: skip
        self._table, self._on_command, self._content = table, on_command, content
        self._loop = asyncio.new_event_loop()
        self.updates = Broadcaster(self._loop, on_first_page, content.feeds)
        self.offered = OfferedFiles()
        self._connections = Connections(logger)
        self._refused = 0
        self._ended = asyncio.Event()
        self._started = threading.Event()
        self._problem: OSError | UnicodeError | None = None
        self._port = table.port
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)

    @property
    def address(self) -> str:
        """URL of the page for a browser on this machine, token included."""
        own = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self._table.host, self._table.host)
        host = f"[{own}]" if ":" in own else own
        token = f"?token={self._table.token}" if self._table.token else ""
        return f"http://{host}:{self._port}/{token}"

    @property
    def port(self) -> int:
        return self._port

    def listen(self) -> None:
        """Begin to serve.  Raises OSError and UnicodeError for an address that cannot be listened on."""
        self._thread.start()
        while not self._started.wait(WAIT_S):  # finding the address of a host may take long
            pass
        if self._problem is not None:
            self._thread.join()
            raise self._problem

    def counts(self) -> Mapping[str, int]:
        """Counts since the start: connections closed to make room, malformed requests, pages beyond the maximum."""
        refused = {"refused": self._refused} if self._refused else {}
        return {f"page_{kind}": count for kind, count in {**self._connections.counts(), **refused}.items()}

    def close(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
            self._thread.join(2 * p.CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        except (OSError, UnicodeError) as error:
            self._problem = error
        finally:
            self._started.set()
            self._loop.close()

    async def _serve(self) -> None:
        self._loop.set_exception_handler(self._connections.on_loop_error)
        async with serve(
            self._attend,
            self._table.host,
            self._table.port,
            process_request=self._respond,
            compression=None,  # costs more time than it saves on loopback or a local network
            max_size=max([p.MAX_COMMAND_BYTES, *(socket.max_bytes for socket in self._content.sockets.values())]),
            max_queue=8,
            open_timeout=p.HANDSHAKE_TIMEOUT_S,
            ping_interval=p.PING_PERIOD_S,
            ping_timeout=p.PING_TIMEOUT_S,
            close_timeout=p.CLOSE_TIMEOUT_S,
            server_header=None,
            logger=self._websockets_logger(),
            create_connection=cast("type[ServerConnection]", self._connection),
        ) as server:
            self._port = int(next(iter(server.sockets)).getsockname()[1])
            self._started.set()
            await self._ended.wait()

    def _connection(self, *arguments: Any, **options: Any) -> ServerConnection:
        return _LimitedConnection(self._connections, *arguments, **options)

    def _websockets_logger(self) -> logging.Logger:
        """Logger of this server's connections: only errors, because the library logs every served file as rejected.

        Failed handshakes, which some of its versions log with a traceback, are counted by the connections.
        """
        own = logging.Logger("websockets.page", logging.ERROR)
        own.addFilter(lambda record: record.msg != "opening handshake failed")
        own.addHandler(self._connections.errors)
        return own

    async def _respond(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return an answer or an error, or None to open a WebSocket."""
        method = getattr(request, "method", "GET")  # earlier versions of the library refuse others themselves
        parts = urlsplit(request.path)
        socket = self._is_socket(parts.path)
        if method not in ("GET", "HEAD") or (socket and method != "GET"):
            return _text(HTTPStatus.METHOD_NOT_ALLOWED, "allowed: GET, HEAD")
        problem = self._refusal(request, parts.query, parts.path)
        if problem is not None:
            return _text(HTTPStatus.FORBIDDEN, problem)
        if socket:
            return None
        response = await self._answer(parts.path, parts.query, request.headers)
        return Response(response.status_code, response.reason_phrase, response.headers) if method == "HEAD" else response

    async def _answer(self, path: str, query: str, headers: Headers) -> Response:
        missing = "not found"
        if path in self._content.made:
            found: Answer | None = await asyncio.to_thread(self._content.made[path], query, headers)
        elif path.startswith(OFFERED_PATH):
            found = await asyncio.to_thread(self.offered.read, path)
            missing = "this file is not offered any more: it is where it was saved"
        else:
            found = self._content.files.get(_file_name(path))
        return _text(HTTPStatus.NOT_FOUND, missing) if found is None else _response(HTTPStatus.OK, *found)

    def _refusal(self, request: Request, query: str, path: str) -> str | None:
        """Reason for refusing a request; None for a permitted one."""
        socket = self._is_socket(path)
        protected = socket or path in self._content.made or _file_name(path) == INDEX or path.startswith(OFFERED_PATH)
        token = parse_qs(query).get("token", [""])[0] if protected else None
        program, options = self._content.program, self._content.options
        return refusal(request.headers, self._table, socket=socket, token=token, program=program, options=options)

    def _is_socket(self, path: str) -> bool:
        return path in self._content.sockets or (path == SOCKET_PATH and self._content.decode is not None)

    async def _attend(self, connection: ServerConnection) -> None:
        """Serve one page until it closes, or another socket."""
        assert connection.request is not None  # the handshake is complete
        socket = self._content.sockets.get(urlsplit(connection.request.path).path)
        if socket is not None:
            self._connections.remove(connection)
            await socket.receive(connection)
            return
        page, decode = PageQueue(self._content.feeds[0]), self._content.decode
        assert decode is not None  # the socket is of a page
        try:
            self.updates.add(page)
        except ValueError as problem:
            self._refused += 1
            await connection.close(1013, str(problem))
            return
        self._connections.remove(connection)
        sender = asyncio.create_task(_send(connection, page))
        try:
            async for text in connection:
                if len(text) > p.MAX_COMMAND_BYTES:  # allowed by `max_size` for other sockets only
                    await connection.close(1009, f"a command has at most {p.MAX_COMMAND_BYTES} bytes")
                    return
                try:
                    command = decode(text)
                    if isinstance(command, Acknowledge):
                        page.acknowledge()
                    else:
                        self._on_command(page, command)
                except ValueError as problem:
                    await connection.send(b"[" + encode(NoticeUpdate(str(problem))) + b"]", text=True)
        except ConnectionClosed:
            pass
        finally:
            self.updates.remove(page)
            sender.cancel()


class _LimitedConnection(ServerConnection):
    """Connection that counts as waiting until a page is open on it."""

    def __init__(self, connections: Connections, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._connections = connections

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._connections.add(self, cast(asyncio.Transport, transport).abort)

    def connection_lost(self, exc: Exception | None) -> None:
        self._connections.remove(self)
        error = self.protocol.handshake_exc
        if self.request is None and error is not None and not isinstance(error.__cause__, EOFError):
            self._connections.count_error("malformed request to the page", error)
        super().connection_lost(exc)


async def _send(connection: ServerConnection, page: PageQueue) -> None:
    try:
        while True:
            await connection.send(await page.take(), text=True)
    except ConnectionClosed:
        return


def _file_name(path: str) -> str:
    """Name of the file at a path, which is empty for a request of `//`."""
    return path.removeprefix("/") or INDEX


def _text(status: HTTPStatus, text: str) -> Response:
    return _response(status, f"{text}\n".encode(), {"Content-Type": "text/plain; charset=utf-8"})


def _response(status: HTTPStatus, body: bytes, fields: Mapping[str, str]) -> Response:
    headers = Headers(fields)
    headers["Content-Length"] = str(len(body))
    headers["Content-Security-Policy"] = CONTENT_SECURITY_POLICY
    headers["X-Content-Type-Options"] = "nosniff"
    headers["Referrer-Policy"] = "no-referrer"
    headers["Cache-Control"] = "no-store"
    headers["Connection"] = "close"
    return Response(int(status), status.phrase, headers, body)


def listening_problem(error: OSError | UnicodeError) -> str:
    """Reason why an address cannot be listened on, without the address, which asyncio puts into its text."""
    if isinstance(error, socket.gaierror):
        return f"failed to look up the name: {error.strerror}"
    return os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
