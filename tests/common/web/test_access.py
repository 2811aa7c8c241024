"""Connections to the page's port that are no page: silent, malformed, foreign."""

import asyncio
import logging
import os
import resource
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec
import pytest
from websockets.asyncio.client import ClientConnection

from tests.common.web.test_server import fetched, talk, updates_until
from tests.support.animator_stand_in import stand_in
from tests.support.bare_connections import bare_connections
from tests.support.live_cameras import until
from zenocap.common.rig.animator import PageTable
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.web import server as server_module
from zenocap.common.web.access import Connections
from zenocap.common.web.parameters import MAX_WAITING

SPARE = 350  # descriptors that the process may still open: more than MAX_WAITING


@contextmanager
def few_descriptors(spare: int) -> Iterator[None]:
    """A limit of open files as if the process was allowed only `spare` more."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    used = max(map(int, os.listdir("/proc/self/fd")))
    resource.setrlimit(resource.RLIMIT_NOFILE, (used + spare, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def wait_for_descriptors(at_most: int) -> None:
    """Until the process, which the server shares with the test, has few open files.  Raises AssertionError after 10 s."""
    for _ in range(200):
        with suppress(OSError):  # the table is full, also for this listing
            if len(os.listdir("/proc/self/fd")) < at_most:
                return
        time.sleep(0.05)
    raise AssertionError(f"{at_most} or more files are still open")


def port_of(address: str) -> int:
    return int(address.split(":")[2].split("/")[0])


async def hello(connection: ClientConnection) -> bool:
    return bool(await updates_until(connection, "hello"))


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="lists the open files of the process in /proc")
def test_a_thousand_connections_without_a_request_neither_end_the_server_nor_keep_a_page_out(tmp_path: Path) -> None:
    with stand_in(tmp_path) as animator, few_descriptors(SPARE):
        with bare_connections("127.0.0.1", port_of(animator.address), 1000) as count:
            assert count == 1000
            wait_for_descriptors(3 * MAX_WAITING)
            assert fetched(animator.address)[0] == 200
            assert talk(animator.address, hello)
            assert animator.bridge.counts()["page_displaced"] >= 1000 - MAX_WAITING
        assert talk(animator.address, hello)


def test_a_connection_without_a_request_is_closed_after_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_module.p, "HANDSHAKE_TIMEOUT_S", 0.2)
    with stand_in(tmp_path) as animator, socket.create_connection(("127.0.0.1", port_of(animator.address)), 10) as bare:
        bare.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")  # never completed
        started_s = time.monotonic()
        with suppress(ConnectionResetError):
            assert bare.recv(4096) == b""
        assert time.monotonic() - started_s < 5


@pytest.mark.nightly
def test_an_open_page_does_not_count_as_waiting(tmp_path: Path) -> None:
    async def many(connection: ClientConnection) -> bool:
        await updates_until(connection, "hello")
        for _ in range(MAX_WAITING + 10):
            _, writer = await asyncio.open_connection("127.0.0.1", port_of(animator.address))
            writers.append(writer)
        return await (await connection.ping()) >= 0.0

    writers: list[asyncio.StreamWriter] = []
    with stand_in(tmp_path) as animator:
        assert talk(animator.address, many)


def test_the_oldest_waiting_connection_makes_room() -> None:
    closed: list[int] = []
    waiting = Connections(logging.getLogger("test"), most=3)
    for number in range(5):
        waiting.add(number, lambda number=number: closed.append(number))
    waiting.remove(3)
    waiting.remove(99)
    assert closed == [0, 1]
    assert (len(waiting), waiting.counts()) == (2, {"displaced": 2})


@pytest.mark.parametrize("data", [b"\x16\x03\x01" + bytes(200) + b"\r\n\r\n", b"x\r\n\r\n"])
def test_malformed_requests_are_counted_and_logged_in_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, data: bytes
) -> None:
    with stand_in(tmp_path) as animator, caplog.at_level(logging.WARNING):
        for _ in range(20):
            with socket.create_connection(("127.0.0.1", port_of(animator.address)), 10) as one:
                one.sendall(data)
                while one.recv(4096):
                    pass
        until(lambda: animator.bridge.counts() == {"page_malformed": 20})
        assert fetched(animator.address)[0] == 200
    (line,) = [record for record in caplog.records if record.name != "asyncio"]
    assert line.exc_info is None
    assert line.getMessage().isprintable()
    assert len(line.getMessage()) < 500


def test_other_methods_than_get_are_refused(tmp_path: Path) -> None:
    with stand_in(tmp_path) as animator, socket.create_connection(("127.0.0.1", port_of(animator.address)), 10) as one:
        one.sendall(b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert not one.recv(4096).startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize("origin", ["rig.example", "https://rig.example/page", "null", ""])
def test_an_origin_that_is_none_is_an_error_of_the_rig_file(origin: str) -> None:
    with pytest.raises(msgspec.ValidationError, match="origins"):
        msgspec.convert({"origins": [origin]}, PageTable)


def test_the_recording_is_started_or_stopped_at_most_once_a_second(tmp_path: Path) -> None:
    async def ask(connection: ClientConnection) -> str:
        await connection.send('{"type":"request","what":"record"}')
        await connection.send('{"type":"request","what":"stop_recording"}')
        refused = (await updates_until(connection, "notice"))[-1]
        clock.advance(1_000_000_000)
        await connection.send('{"type":"request","what":"stop_recording"}')
        await connection.send('{"type":"request","what":"explode"}')
        await updates_until(connection, "notice")
        return str(refused["text"])

    clock = ManualClock(10**18)
    with stand_in(tmp_path, clock) as animator:
        refused = talk(animator.address, ask)
        assert refused == "refused: the recording was started or stopped less than a second ago; try it again"
        assert [request.what for request in animator.bridge.requests()] == ["record", "stop_recording"]
