"""A TCP forwarder between services and router, in which the links of one service can be cut.

No privileges are needed: the process behind a connection is found by the port that it connects from.
"""

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Self

import psutil

HOST = "127.0.0.1"
CHUNK = 1 << 16


class LinkGate:
    """Forwards a port of this machine to another one; a context manager.

    owner: name of the service that a process id belongs to; None for other processes, whose links are never cut.
    """

    def __init__(
        self, port: int, router_port: int, owner: Callable[[int], str | None], pids: Callable[[], list[int]]
    ) -> None:
        self._port, self._router_port = port, router_port
        self._owner, self._pids = owner, pids
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="gate", daemon=True)
        self._ready, self._ended = threading.Event(), asyncio.Event()
        self._cut: dict[str, str] = {}  # service to kind of cut
        self._open = asyncio.Condition()
        self._links: dict[asyncio.StreamWriter, str | None] = {}
        self._unknown = 0

    def __enter__(self) -> Self:
        self._thread.start()
        self._ready.wait()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(5.0)

    @property
    def unknown(self) -> int:
        """Connections whose process was not found; they cannot be cut."""
        return self._unknown

    def links(self, service: str) -> int:
        """Number of open links of a service."""
        return sum(name == service for name in list(self._links.values()))

    def cut(self, service: str, kind: str) -> None:
        """Cut the links of a service.  kind: "silent" holds all bytes back, "reset" closes and refuses connections."""
        asyncio.run_coroutine_threadsafe(self._set(service, kind), self._loop).result(5.0)

    def restore(self, service: str) -> None:
        asyncio.run_coroutine_threadsafe(self._set(service, None), self._loop).result(5.0)

    async def _set(self, service: str, kind: str | None) -> None:
        async with self._open:
            if kind is None:
                self._cut.pop(service, None)
            else:
                self._cut[service] = kind
            self._open.notify_all()
        if kind == "reset":
            for writer in [writer for writer, name in self._links.items() if name == service]:
                writer.transport.abort()

    def _run(self) -> None:
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        async with await asyncio.start_server(self._forward, HOST, self._port):
            self._ready.set()
            await self._ended.wait()
        for task in asyncio.all_tasks():
            if task is not asyncio.current_task():
                task.cancel()

    async def _forward(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        pid = process_of(writer.get_extra_info("peername")[1], self._port, self._pids())
        service = self._owner(pid) if pid is not None else None
        self._unknown += pid is None
        router_writer: asyncio.StreamWriter | None = None
        self._links[writer] = service
        try:
            if self._cut.get(service or "") == "reset":
                return
            await self._passable(service)
            router_reader, router_writer = await asyncio.open_connection(HOST, self._router_port)
            both = (self._pump(reader, router_writer, service), self._pump(router_reader, writer, service))
            tasks = [asyncio.ensure_future(one) for one in both]
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in tasks:
                task.cancel()
        except OSError:
            pass
        finally:
            self._links.pop(writer, None)
            for one in (writer, router_writer):
                if one is not None:
                    one.transport.abort()

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, service: str | None) -> None:
        with suppress(OSError):
            while data := await reader.read(CHUNK):
                await self._passable(service)
                writer.write(data)
                await writer.drain()

    async def _passable(self, service: str | None) -> None:
        """Wait while the links of a service are silent."""
        async with self._open:
            await self._open.wait_for(lambda: service not in self._cut)


def process_of(port: int, remote_port: int, pids: list[int]) -> int | None:
    """Which of these processes has the connection from `port` to `remote_port` of this machine; None for none."""
    for pid in pids:
        with suppress(psutil.Error):
            for link in psutil.Process(pid).net_connections("tcp4"):
                if link.raddr and (link.laddr.port, link.raddr.port) == (port, remote_port):
                    return pid
    return None
