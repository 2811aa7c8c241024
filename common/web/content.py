"""Content of a page server: files, computed answers, sockets, commands."""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Generic

from websockets.asyncio.server import ServerConnection

from zenocap.common.web.messages import Acknowledge, C

CONTENT_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}

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
