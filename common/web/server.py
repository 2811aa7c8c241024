"""Server of a page: files and a WebSocket on one port, in a thread of its own.

Access: on a loopback address, the browser must have requested a loopback host by name, which stops DNS rebinding; on any
other address a token is required.  A WebSocket is opened only for a page from this server, or of an origin that the rig
allows.  The content security policy forbids the page to load anything from elsewhere.

Limits: connections without a handshake by number and time, open pages by number, and what is logged of malformed requests.
"""

import asyncio
import hmac
import logging
import threading
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from http import HTTPStatus
from importlib import resources
from typing import Any, Generic, cast
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from zenocap.common.errors import UserError
from zenocap.common.rig.animator import ANY_ORIGIN, PageTable, is_loopback
from zenocap.common.runtime.logs import OncePerInterval
from zenocap.common.web.access import WaitingConnections
from zenocap.common.web.broadcast import Broadcaster, PageQueue
from zenocap.common.web.messages import Acknowledge, C, NoticeUpdate, encode
from zenocap.common.web.offered_files import OFFERED_PATH, OfferedFiles
from zenocap.common.web.parameters import (
    CLOSE_TIMEOUT_S,
    ERROR_LINE_PERIOD_S,
    HANDSHAKE_TIMEOUT_S,
    MAX_COMMAND_BYTES,
    MAX_WAITING,
    PING_PERIOD_S,
    PING_TIMEOUT_S,
)

logger = logging.getLogger(__name__)

SOCKET_PATH = "/socket"
CONTENT_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


Files = Mapping[str, tuple[bytes, str]]
"""Content and type of every served file by name; nothing else can be requested."""


@dataclass(frozen=True)
class Socket:
    """A WebSocket beside that of the updates.  receive: serves a connection.  max_bytes: of one message."""

    receive: Callable[[ServerConnection], Awaitable[None]]
    max_bytes: int


@dataclass(frozen=True)
class PageContent(Generic[C]):
    """What a server serves.  decode: a command of a page; raises ValueError.

    program: that serves it; options: how host, port and origins are set, both for messages to users.
    sockets: by path.  feeds: names of what a page can show; the first is that of a page that opens.
    """

    files: Files
    decode: Callable[[str | bytes], C | Acknowledge]
    program: str
    options: str
    sockets: Mapping[str, Socket] = field(default_factory=dict)
    feeds: Sequence[str] = ("",)


@cache
def page_files(package: str) -> Files:
    """The files of the folder `static` of a package, and those that all pages share."""
    folders = [resources.files(one).joinpath("static") for one in ("zenocap.common.web", package)]
    files = [file for folder in folders for file in folder.iterdir() if file.is_file()]
    return {file.name: (file.read_bytes(), CONTENT_TYPES[file.name.rpartition(".")[2]]) for file in files}


class PageServer(Generic[C]):
    """Serves a page from `start` to `close`.

    on_command: called in the server's thread with every command of a page.  on_first_page: see `Broadcaster`.
    """

    def __init__(
        self,
        table: PageTable,
        on_command: Callable[[PageQueue, C], None],
        on_first_page: Callable[[], None],
        content: PageContent[C],
    ) -> None:
        self._table, self._on_command, self._content = table, on_command, content
        self._loop = asyncio.new_event_loop()
        self.broadcaster = Broadcaster(self._loop, on_first_page, content.feeds)
        self.offered = OfferedFiles()
        self._waiting = WaitingConnections(MAX_WAITING)
        self._errors = OncePerInterval(logger, ERROR_LINE_PERIOD_S)
        self._refused = 0
        self._ended = asyncio.Event()
        self._started = threading.Event()
        self._problem: OSError | None = None
        self._port = table.port
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)

    @property
    def address(self) -> str:
        """URL of the page for a browser on this machine, token included."""
        own = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self._table.host, self._table.host)
        host = f"[{own}]" if ":" in own else own
        token = f"?token={self._table.token}" if self._table.token else ""
        return f"http://{host}:{self._port}/{token}"

    def start(self) -> None:
        """Listen.  Raises UserError when the port is not available."""
        self._thread.start()
        self._started.wait()
        if self._problem is not None:
            self._thread.join()
            name = self._content.options.rstrip(".-") or "page"
            raise UserError(
                f"{name}: {self._table.host}:{self._table.port} cannot be served: "
                f"{self._problem.strerror or self._problem}: another program, such as a second {self._content.program}, "
                f"may use the port; allowed: another {self._port_option}, or 0 for any free one"
            )

    @property
    def _port_option(self) -> str:
        option = f"{self._content.options}port"
        return option if option == "--port" else f"{option} (or --port)"

    def counts(self) -> Mapping[str, int]:
        """Counts since the start: connections closed to make room, malformed requests, pages beyond the maximum."""
        counts = {"displaced": self._waiting.displaced, "malformed": self._errors.counts.total(), "refused": self._refused}
        return {f"page_{kind}": count for kind, count in counts.items() if count}

    def close(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
            self._thread.join(2 * CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        except OSError as error:
            self._problem = error
        finally:
            self._started.set()
            self._loop.close()

    async def _serve(self) -> None:
        self._loop.set_exception_handler(self._log_exception)
        async with serve(
            self._attend,
            self._table.host,
            self._table.port,
            process_request=self._respond,
            compression=None,  # costs more time than it saves on loopback or a local network
            max_size=max([MAX_COMMAND_BYTES, *(socket.max_bytes for socket in self._content.sockets.values())]),
            max_queue=8,
            open_timeout=HANDSHAKE_TIMEOUT_S,
            ping_interval=PING_PERIOD_S,
            ping_timeout=PING_TIMEOUT_S,
            close_timeout=CLOSE_TIMEOUT_S,
            server_header=None,
            logger=self._websockets_logger(),
            create_connection=cast("type[ServerConnection]", self._connection),
        ) as server:
            self._port = _port(server)
            self._started.set()
            await self._ended.wait()

    def _connection(self, *arguments: Any, **options: Any) -> ServerConnection:
        return _LimitedConnection(self._waiting, self._count_malformed, *arguments, **options)

    def _count_malformed(self, error: Exception) -> None:
        """Count a connection whose bytes are no HTTP request."""
        info = (type(error), error, None)
        self._errors.handle(logger.makeRecord(logger.name, logging.ERROR, "", 0, "malformed request to the page", (), info))

    def _log_exception(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Count errors of the loop, such as a full table of open files; asyncio would log a traceback of each."""
        error = context.get("exception")
        info = (type(error), error, None) if error is not None else None
        self._errors.handle(logger.makeRecord(logger.name, logging.ERROR, "", 0, str(context["message"]), (), info))

    def _websockets_logger(self) -> logging.Logger:
        """Logger of this server's connections: only errors, because the library logs every served file as rejected.

        Failed handshakes, which some of its versions log with a traceback, are counted by the connections.
        """
        own = logging.Logger("websockets.page", logging.ERROR)
        own.addFilter(lambda record: record.msg != "opening handshake failed")
        own.addHandler(self._errors)
        return own

    async def _respond(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return a file or an error, or None to open a WebSocket."""
        if getattr(request, "method", "GET") != "GET":  # earlier versions of the library refuse others themselves
            return _text(HTTPStatus.METHOD_NOT_ALLOWED, "allowed: GET")
        parts = urlsplit(request.path)
        problem = self._refusal(request, parts.query, parts.path)
        if problem is not None:
            return _text(HTTPStatus.FORBIDDEN, problem)
        if self._is_socket(parts.path):
            return None
        if parts.path.startswith(OFFERED_PATH):
            return await asyncio.to_thread(self._offered_file, parts.path)
        found = self._content.files.get(parts.path.lstrip("/") or "index.html")
        if found is None:
            return _text(HTTPStatus.NOT_FOUND, "not found")
        return _response(HTTPStatus.OK, *found)

    def _offered_file(self, path: str) -> Response:
        offered = self.offered.at(path)
        try:
            body = offered.path.read_bytes() if offered is not None else None
        except OSError:
            body = None
        if offered is None or body is None:
            return _text(HTTPStatus.NOT_FOUND, "this file is not offered any more: it is where it was saved")
        response = _response(HTTPStatus.OK, body, "application/octet-stream")
        response.headers["Content-Disposition"] = offered.disposition
        return response

    def _refusal(self, request: Request, query: str, path: str) -> str | None:
        """Return the reason for refusing a request; None for a permitted one."""
        host = request.headers.get("Host", "")
        if is_loopback(self._table.host) and not is_loopback(_host_name(host)):
            return "this page is served to its own machine only: open it as http://127.0.0.1 or http://localhost"
        if self._is_socket(path):
            origin = request.headers.get("Origin")
            same = origin is None or urlsplit(origin).netloc == host
            if not (same or origin in self._table.origins or ANY_ORIGIN in self._table.origins):
                return f"requested by a page of another site{self._origins_hint}"
        protected = path in ("/", "/index.html") or self._is_socket(path) or path.startswith(OFFERED_PATH)
        if self._table.token is not None and protected:
            given = parse_qs(query).get("token", [""])[0]
            if not hmac.compare_digest(given.encode(), self._table.token.encode()):
                return f"a token is required: open the address that the {self._content.program} prints"
        return None

    def _is_socket(self, path: str) -> bool:
        return path == SOCKET_PATH or path in self._content.sockets

    @property
    def _origins_hint(self) -> str:
        options = self._content.options
        return "" if options.startswith("-") else f"; allowed: also {options}origins of the rig file"

    async def _attend(self, connection: ServerConnection) -> None:
        """Serve one page until it closes, or another socket."""
        assert connection.request is not None  # the handshake is complete
        socket = self._content.sockets.get(urlsplit(connection.request.path).path)
        if socket is not None:
            self._waiting.remove(connection)
            await socket.receive(connection)
            return
        page = PageQueue(self._content.feeds[0])
        try:
            self.broadcaster.add(page)
        except ValueError as problem:
            self._refused += 1
            await connection.close(1013, str(problem))
            return
        self._waiting.remove(connection)
        sender = asyncio.create_task(_send(connection, page))
        try:
            async for text in connection:
                if len(text) > MAX_COMMAND_BYTES:  # allowed by `max_size` for other sockets only
                    await connection.close(1009, f"a command has at most {MAX_COMMAND_BYTES} bytes")
                    return
                try:
                    command = self._content.decode(text)
                    if isinstance(command, Acknowledge):
                        page.acknowledge()
                    else:
                        self._on_command(page, command)
                except ValueError as problem:
                    await connection.send(b"[" + encode(NoticeUpdate(str(problem))) + b"]", text=True)
        except ConnectionClosed:
            pass
        finally:
            self.broadcaster.remove(page)
            sender.cancel()


class _LimitedConnection(ServerConnection):
    """Connection that counts as waiting until a page is open on it."""

    def __init__(
        self, waiting: WaitingConnections, on_malformed: Callable[[Exception], None], *arguments: Any, **options: Any
    ) -> None:
        super().__init__(*arguments, **options)
        self._waiting, self._on_malformed = waiting, on_malformed

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._waiting.add(self, cast(asyncio.Transport, transport).abort)

    def connection_lost(self, exc: Exception | None) -> None:
        self._waiting.remove(self)
        error = self.protocol.handshake_exc
        if self.request is None and error is not None and not isinstance(error.__cause__, EOFError):
            self._on_malformed(error)
        super().connection_lost(exc)


async def _send(connection: ServerConnection, page: PageQueue) -> None:
    try:
        while True:
            await connection.send(await page.take(), text=True)
    except ConnectionClosed:
        return


def _port(server: Server) -> int:
    return int(next(iter(server.sockets)).getsockname()[1])


def _host_name(host: str) -> str:
    """Return the name in a Host header without its port."""
    return urlsplit(f"//{host}").hostname or ""


def _text(status: HTTPStatus, text: str) -> Response:
    return _response(status, f"{text}\n".encode(), "text/plain")


def _response(status: HTTPStatus, body: bytes, content_type: str) -> Response:
    headers = Headers()
    headers["Content-Type"] = f"{content_type}; charset=utf-8"
    headers["Content-Length"] = str(len(body))
    headers["Content-Security-Policy"] = CONTENT_SECURITY_POLICY
    headers["X-Content-Type-Options"] = "nosniff"
    headers["Referrer-Policy"] = "no-referrer"
    headers["Cache-Control"] = "no-store"
    headers["Connection"] = "close"
    return Response(int(status), status.phrase, headers, body)
