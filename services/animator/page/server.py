"""Server of the page: files and a WebSocket on one port, in a thread of its own.

Access: on a loopback address, the browser must have requested a loopback host by name, which stops DNS rebinding; on any
other address a token is required.  A WebSocket is opened only for a page from this server.  The content security policy
forbids the page to load anything from elsewhere.
"""

import asyncio
import hmac
import logging
import threading
from collections.abc import Callable
from http import HTTPStatus
from importlib import resources
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from zenocap.common.errors import UserError
from zenocap.common.rig.animator import PageTable, is_loopback
from zenocap.services.animator.page.broadcast import Broadcaster, PageQueue
from zenocap.services.animator.page.page_messages import Acknowledge, Command, NoticeUpdate, decode_command, encode
from zenocap.services.animator.parameters import CLOSE_TIMEOUT_S, MAX_COMMAND_BYTES, PING_PERIOD_S, PING_TIMEOUT_S

SOCKET_PATH = "/socket"
CONTENT_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


class PageServer:
    """Serves the page from `start` to `close`.

    on_command: called in the server's thread with every command of a page.  on_first_page: see `Broadcaster`.
    """

    def __init__(
        self, table: PageTable, on_command: Callable[[PageQueue, Command], None], on_first_page: Callable[[], None]
    ) -> None:
        self._table, self._on_command = table, on_command
        self._files = _files()
        self._loop = asyncio.new_event_loop()
        self.broadcaster = Broadcaster(self._loop, on_first_page)
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
            raise UserError(
                f"animator.page: {self._table.host}:{self._table.port} cannot be served: "
                f"{self._problem.strerror or self._problem}: another program, such as a second animator, may use the port; "
                "allowed: another animator.page.port (or --port), or 0 for any free one"
            )

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
        async with serve(
            self._attend,
            self._table.host,
            self._table.port,
            process_request=self._respond,
            compression=None,  # costs more time than it saves on loopback or a local network
            max_size=MAX_COMMAND_BYTES,
            max_queue=8,
            ping_interval=PING_PERIOD_S,
            ping_timeout=PING_TIMEOUT_S,
            close_timeout=CLOSE_TIMEOUT_S,
            server_header=None,
            logger=_websockets_logger(),
        ) as server:
            self._port = _port(server)
            self._started.set()
            await self._ended.wait()

    def _respond(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return a file or an error, or None to open a WebSocket."""
        parts = urlsplit(request.path)
        problem = self._refusal(request, parts.query, parts.path)
        if problem is not None:
            return _text(HTTPStatus.FORBIDDEN, problem)
        if parts.path == SOCKET_PATH:
            return None
        found = self._files.get(parts.path.lstrip("/") or "index.html")
        if found is None:
            return _text(HTTPStatus.NOT_FOUND, "not found")
        return _response(HTTPStatus.OK, *found)

    def _refusal(self, request: Request, query: str, path: str) -> str | None:
        """Return the reason for refusing a request; None for a permitted one."""
        host = request.headers.get("Host", "")
        if is_loopback(self._table.host) and not is_loopback(_host_name(host)):
            return "this page is served to its own machine only: open it as http://127.0.0.1 or http://localhost"
        if path == SOCKET_PATH:
            origin = request.headers.get("Origin")
            if origin is not None and urlsplit(origin).netloc != host:
                return "requested by a page of another site"
        if self._table.token is not None and path in ("/", "/index.html", SOCKET_PATH):
            given = parse_qs(query).get("token", [""])[0]
            if not hmac.compare_digest(given.encode(), self._table.token.encode()):
                return "a token is required: open the address that the animator prints"
        return None

    async def _attend(self, connection: ServerConnection) -> None:
        """Serve one page until it closes."""
        page = PageQueue()
        try:
            self.broadcaster.add(page)
        except ValueError as problem:
            await connection.close(1013, str(problem))
            return
        sender = asyncio.create_task(_send(connection, page))
        try:
            async for text in connection:
                try:
                    command = decode_command(text)
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


def _websockets_logger() -> logging.Logger:
    """Logger that drops warnings: the library logs every served file as a rejected connection."""
    own = logging.getLogger("websockets.page")
    own.setLevel(logging.ERROR)
    return own


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


def _files() -> dict[str, tuple[bytes, str]]:
    """Return content and type of every served file by name; nothing else can be requested."""
    folder = resources.files("zenocap.services.animator.page").joinpath("static")
    files = [file for file in folder.iterdir() if file.is_file()]
    return {file.name: (file.read_bytes(), CONTENT_TYPES[file.name.rpartition(".")[2]]) for file in files}


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
