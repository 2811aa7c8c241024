"""The server of the page: files and a WebSocket on one port, in a thread of its own.

Only who may look gets an answer.  On an address of this machine alone, the browser must have asked for such an address by
name: a page of somebody else, whose name was made to lead here, cannot.  On any other, a token is needed.  A WebSocket is
opened only to a page that this server served.  The page is told to load nothing from elsewhere.
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

from common.runtime.animator_table import PageTable, is_loopback
from services.animator.page.hub import Hub, Page
from services.animator.page.wire import Got, Notice, Wish, encode, wish_of

logger = logging.getLogger(__name__)

SOCKET = "/socket"
KINDS = {"html": "text/html", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
LONGEST_WISH = 4096  # bytes
PING_S, PATIENCE_S = 10.0, 20.0  # a page that does not answer is let go
LINGER_S = 1.0


class PageError(Exception):
    """The page cannot be served; the text is for the person who started the program."""


class PageServer:
    """Serves from `start` to `close`.

    heard: called, in the server's thread, with what a page asks for, and the page.  opened: see `Hub`.
    """

    def __init__(self, table: PageTable, heard: Callable[[Page, Wish], None], opened: Callable[[], None]) -> None:
        self._table, self._heard = table, heard
        self._files = _files()
        self._loop = asyncio.new_event_loop()
        self.hub = Hub(self._loop, opened)
        self._ended = asyncio.Event()
        self._started = threading.Event()
        self._problem: OSError | None = None
        self._port = table.port
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)

    @property
    def address(self) -> str:
        """Where a browser on this machine finds the page, token included."""
        own = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self._table.host, self._table.host)
        host = f"[{own}]" if ":" in own else own
        token = f"?token={self._table.token}" if self._table.token else ""
        return f"http://{host}:{self._port}/{token}"

    def start(self) -> None:
        """Raises PageError when its address cannot be had."""
        self._thread.start()
        self._started.wait()
        if self._problem is not None:
            self._thread.join()
            raise PageError(
                f"animator.page: {self._table.host}:{self._table.port} cannot be served: "
                f"{self._problem.strerror or self._problem}: another program, or another animator, may be there; "
                "allowed: another animator.page.port, or 0 for any free one"
            )

    def close(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
            self._thread.join(2 * LINGER_S)

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
            process_request=self._answer,
            compression=None,  # costs more time than loopback or a house's network needs
            max_size=LONGEST_WISH,
            max_queue=8,
            ping_interval=PING_S,
            ping_timeout=PATIENCE_S,
            close_timeout=LINGER_S,
            server_header=None,
            logger=_quiet(),
        ) as server:
            self._port = _port(server)
            self._started.set()
            await self._ended.wait()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """A file, or None to go on to a WebSocket."""
        parts = urlsplit(request.path)
        problem = self._refusal(request, parts.query, parts.path)
        if problem is not None:
            return _text(HTTPStatus.FORBIDDEN, problem)
        if parts.path == SOCKET:
            return None
        found = self._files.get(parts.path.lstrip("/") or "index.html")
        if found is None:
            return _text(HTTPStatus.NOT_FOUND, "there is nothing here")
        return _response(HTTPStatus.OK, *found)

    def _refusal(self, request: Request, query: str, path: str) -> str | None:
        """Why this request is not answered."""
        host = request.headers.get("Host", "")
        if is_loopback(self._table.host) and not is_loopback(_name(host)):
            return "this page is for its own machine: open it as http://127.0.0.1 or http://localhost"
        if path == SOCKET:
            origin = request.headers.get("Origin")
            if origin is not None and urlsplit(origin).netloc != host:
                return "opened by another site"
        if self._table.token is not None and path in ("/", "/index.html", SOCKET):
            given = parse_qs(query).get("token", [""])[0]
            if not hmac.compare_digest(given.encode(), self._table.token.encode()):
                return "a token is needed: open the address that the animator says"
        return None

    async def _attend(self, connection: ServerConnection) -> None:
        page = Page()
        try:
            self.hub.enter(page)
        except ValueError as problem:
            await connection.close(1013, str(problem))
            return
        sender = asyncio.create_task(_send(connection, page))
        try:
            async for text in connection:
                try:
                    wish = wish_of(text)
                    if isinstance(wish, Got):
                        page.got()
                    else:
                        self._heard(page, wish)
                except ValueError as problem:
                    await connection.send(b"[" + encode(Notice(str(problem))) + b"]", text=True)
        except ConnectionClosed:
            pass
        finally:
            self.hub.leave(page)
            sender.cancel()


def _quiet() -> logging.Logger:
    """The library calls every file that is served a rejected connection."""
    own = logging.getLogger("websockets.page")
    own.setLevel(logging.ERROR)
    return own


async def _send(connection: ServerConnection, page: Page) -> None:
    try:
        while True:
            await connection.send(await page.take(), text=True)
    except ConnectionClosed:
        return


def _port(server: Server) -> int:
    return int(next(iter(server.sockets)).getsockname()[1])


def _name(host: str) -> str:
    """The name in a Host header, without its port."""
    return urlsplit(f"//{host}").hostname or ""


def _files() -> dict[str, tuple[bytes, str]]:
    """Content and type of everything that is served, by name: nothing else can be asked for."""
    folder = resources.files("services.animator.page").joinpath("static")
    return {
        file.name: (file.read_bytes(), KINDS[file.name.rpartition(".")[2]]) for file in folder.iterdir() if file.is_file()
    }


def _text(status: HTTPStatus, words: str) -> Response:
    return _response(status, f"{words}\n".encode(), "text/plain")


def _response(status: HTTPStatus, body: bytes, kind: str) -> Response:
    headers = Headers()
    headers["Content-Type"] = f"{kind}; charset=utf-8"
    headers["Content-Length"] = str(len(body))
    headers["Content-Security-Policy"] = POLICY
    headers["X-Content-Type-Options"] = "nosniff"
    headers["Referrer-Policy"] = "no-referrer"
    headers["Cache-Control"] = "no-store"
    headers["Connection"] = "close"
    return Response(int(status), status.phrase, headers, body)
