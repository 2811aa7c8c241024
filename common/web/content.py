"""Content of a page server: files, computed answers, sockets, commands, saved files to download."""

import threading
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from secrets import token_urlsafe
from typing import Generic
from urllib.parse import quote

from websockets.asyncio.server import ServerConnection

from zenocap.common.web.messages import Acknowledge, C
from zenocap.common.web.parameters import MAX_OFFERED, MAX_OFFERED_BYTES

CONTENT_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}

OFFERED_PATH = "/saved/"

Answer = tuple[bytes, Mapping[str, str]]
"""Body and headers."""

Files = Mapping[str, Answer]
"""Every served file by name; nothing else can be requested."""

Made = Callable[[str, Mapping[str, str]], Answer]
"""Computes an answer of the query and the headers of a request; called in a thread."""


@dataclass(frozen=True)
class Socket:
    """A WebSocket beside that of the updates.  receive: serves a connection.  max_bytes: of one message."""

    receive: Callable[[ServerConnection], Awaitable[None]]
    max_bytes: int


@dataclass(frozen=True)
class PageContent(Generic[C]):
    """What a server serves.  decode: a command of a page; raises ValueError.  None: no updates and commands.

    program: that serves it; options: how host, port and origins are set, both for messages to users.
    sockets, made: by path.  feeds: names of what a page can show; the first is that of a page that opens.
    """

    files: Files
    decode: Callable[[str | bytes], C | Acknowledge] | None
    program: str
    options: str
    sockets: Mapping[str, Socket] = field(default_factory=dict)
    made: Mapping[str, Made] = field(default_factory=dict)
    feeds: Sequence[str] = ("",)


@cache
def page_files(package: str) -> Files:
    """The files of the folder `static` of a package, and those that all pages share."""
    folders = [resources.files(one).joinpath("static") for one in ("zenocap.common.web", package)]
    files = [file for folder in folders for file in folder.iterdir() if file.is_file()]
    kinds = {file.name: f"{CONTENT_TYPES[Path(file.name).suffix]}; charset=utf-8" for file in files}
    return {file.name: (file.read_bytes(), {"Content-Type": kinds[file.name]}) for file in files}


class OfferedFiles:
    """The latest MAX_OFFERED saved files, each at a path of its own that cannot be guessed; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[str, Path] = {}

    def offer(self, path: Path) -> str:
        """Return the path at which pages get a file; "" for a file that is larger than MAX_OFFERED_BYTES."""
        if path.stat().st_size > MAX_OFFERED_BYTES:
            return ""
        address = OFFERED_PATH + token_urlsafe(16)
        with self._lock:
            self._files[address] = path
            while len(self._files) > MAX_OFFERED:
                del self._files[next(iter(self._files))]
        return address

    def read(self, address: str) -> Answer | None:
        """Content of the file at a path, and headers by which a browser saves it under its name.

        None for another path, or for a file that was removed or has grown beyond MAX_OFFERED_BYTES.
        """
        with self._lock:
            path = self._files.get(address)
        try:
            if path is None or path.stat().st_size > MAX_OFFERED_BYTES:
                return None
            body = path.read_bytes()
        except OSError:
            return None
        disposition = f"attachment; filename*=UTF-8''{quote(path.name, safe='')}"
        return body, {"Content-Type": "application/octet-stream", "Content-Disposition": disposition}
