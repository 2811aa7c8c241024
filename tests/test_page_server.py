"""The page's server: who may look, what a page gets, and that a slow one harms nobody."""

import asyncio
import json
import socket
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

import pytest
from animator_stand_in import bap, pose_at, stand_in
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidStatus

from common.messages import Preview, Request
from common.runtime.animator_table import PageTable
from services.animator.page.hub import MOST_PAGES, UNDER_WAY
from services.animator.page.server import PageError, PageServer

TOKEN = "a-token-of-sixteen-letters"
T = TypeVar("T")


def fetched(address: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    request = urllib.request.Request(address, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, dict(answer.headers), answer.read()
    except urllib.error.HTTPError as error:
        return error.code, dict(error.headers), error.read()


def socket_of(address: str) -> str:
    """The WebSocket's address, with the page's token."""
    base, _, query = address.partition("?")
    return base.replace("http", "ws") + "socket" + (f"?{query}" if query else "")


def talk(address: str, act: Callable[[ClientConnection], Awaitable[T]], origin: str | None = None) -> T:
    async def run() -> T:
        async with connect(socket_of(address), origin=origin, compression=None) as connection:  # type: ignore[arg-type]
            return await asyncio.wait_for(act(connection), 60)

    return asyncio.run(run())


async def pieces_until(connection: ClientConnection, kind: str) -> list[dict[str, object]]:
    """All pieces up to the first of a kind."""
    found: list[dict[str, object]] = []
    while not any(piece["is"] == kind for piece in found):
        found += await pieces_of(connection)
    return found


async def pieces_of(connection: ClientConnection) -> list[dict[str, object]]:
    """The next list, which the page says to have got."""
    pieces: list[dict[str, object]] = json.loads(await asyncio.wait_for(connection.recv(), 30))
    await connection.send('{"is":"got"}')
    return pieces


def test_the_page_and_its_files_come_with_a_policy_that_keeps_it_at_home(tmp_path: Path) -> None:
    with stand_in(tmp_path) as animator:
        for name, kind in (("", "text/html"), ("main.js", "text/javascript"), ("style.css", "text/css")):
            status, headers, body = fetched(animator.address + name)
            assert status == 200
            assert headers["Content-Type"].startswith(kind)
            assert "default-src 'none'" in headers["Content-Security-Policy"]
            assert "unsafe" not in headers["Content-Security-Policy"]
            assert body
        assert fetched(animator.address + "nothing")[0] == 404
        assert fetched(animator.address + "..%2f..%2fshell.py")[0] == 404
        assert fetched(animator.address + "../server.py")[0] == 404


def test_a_name_that_was_made_to_lead_here_is_refused(tmp_path: Path) -> None:
    """DNS rebinding: the browser believes to talk to somebody else's site."""
    with stand_in(tmp_path) as animator:
        port = animator.address.split(":")[2].strip("/")
        assert fetched(animator.address, Host=f"evil.example:{port}")[0] == 403
        assert fetched(animator.address, Host=f"localhost:{port}")[0] == 200


def test_another_sites_page_opens_no_socket(tmp_path: Path) -> None:
    async def listen(connection: ClientConnection) -> str:
        return str(await connection.recv())

    with stand_in(tmp_path) as animator:
        with pytest.raises(InvalidStatus, match="403"):
            talk(animator.address, listen, origin="https://evil.example")
        assert "hello" in talk(animator.address, listen, origin=animator.address.rstrip("/"))


@pytest.mark.parametrize("wrong", ["", "?token=", "?token=a-token-of-sixteen-lettern", "?tok=" + TOKEN])
def test_without_the_token_there_is_neither_page_nor_socket(tmp_path: Path, wrong: str) -> None:
    async def listen(connection: ClientConnection) -> str:
        return str(await connection.recv())

    with stand_in(tmp_path, host="0.0.0.0", token=TOKEN) as animator:
        right = animator.address.replace("0.0.0.0", "127.0.0.1")
        assert fetched(right)[0] == 200
        assert "hello" in talk(right, listen)
        bad = right.partition("?")[0] + wrong
        assert fetched(bad)[0] == 403
        with pytest.raises(InvalidStatus, match="403"):
            talk(bad, listen)


def test_the_health_does_not_tell_the_token(tmp_path: Path) -> None:
    with stand_in(tmp_path, token=TOKEN) as animator:
        assert TOKEN in animator.address
        assert TOKEN not in animator.desk.where()


def test_a_page_that_opens_gets_everything_at_once(tmp_path: Path) -> None:
    async def listen(connection: ClientConnection) -> set[object]:
        first = await pieces_until(connection, "hello")
        animator.tick()  # the service's loop is woken by the first page that opens
        return {piece["is"] for piece in [*first, *await pieces_until(connection, "rows")]}

    with stand_in(tmp_path) as animator:
        animator.begin()
        animator.instant(0.0)
        assert {"hello", "body", "pose", "camera", "view", "rows"} <= talk(animator.address, listen)


def test_a_page_that_opens_later_gets_what_was_said_before(tmp_path: Path) -> None:
    async def both(first: ClientConnection) -> set[object]:
        await pieces_until(first, "pose")
        async with connect(socket_of(animator.address), compression=None) as second:
            return {piece["is"] for piece in await pieces_until(second, "pose")}

    async def listen(connection: ClientConnection) -> set[object]:
        await connection.recv()
        animator.instant(0.0)
        return await both(connection)

    with stand_in(tmp_path) as animator:
        animator.begin()
        assert {"hello", "body", "camera", "pose"} <= talk(animator.address, listen)


def test_wishes_become_requests_and_others_are_refused(tmp_path: Path) -> None:
    async def ask(connection: ClientConnection) -> tuple[list[Request], str]:
        await connection.send('{"is":"ask","what":"measure"}')
        await connection.send('{"is":"ask","what":"explode"}')
        refused = await pieces_until(connection, "notice")
        return list(animator.desk.asked()), str(refused[-1]["text"])

    with stand_in(tmp_path) as animator:
        asked, refused = talk(animator.address, ask)
    assert [(request.what, request.frame) for request in asked] == [("measure", 0)]
    assert "a page asks for what there is not" in refused


def test_a_page_that_never_reads_loses_frames_of_its_own_and_costs_no_memory(tmp_path: Path) -> None:
    async def starve(lazy: ClientConnection) -> tuple[int, int]:
        raw = lazy.transport
        raw.pause_reading()  # the kernel's buffers fill up
        async with connect(socket_of(animator.address), compression=None) as eager:
            seen = 0
            for k in range(120):
                large = Preview(frame=k, captured_ns=0, viewer="1", jpeg=bytes(200_000))
                animator.hear(large, bap(k, animator.clock.now_ns(), pose_at(k / 60)))
                seen += sum(piece["is"] == "pose" for piece in await pieces_of(eager))
            return seen, animator.desk.most_waiting

    with stand_in(tmp_path) as animator:
        animator.begin()
        seen, waiting = talk(animator.address, starve)
    assert seen > 60
    assert 0 < waiting < 20  # pieces, one of each name


def test_a_page_that_is_behind_gets_the_newest_next_and_nothing_in_between(tmp_path: Path) -> None:
    async def dawdle(connection: ClientConnection) -> list[int]:
        await pieces_until(connection, "hello")
        frames: list[int] = []
        for k in range(50):
            animator.hear(bap(k, animator.clock.now_ns(), pose_at(0.0)))
            await asyncio.sleep(0.002)
        for _ in range(UNDER_WAY):  # what was sent before it stopped to say so
            frames += [int(str(p["frame"])) for p in json.loads(await connection.recv()) if p["is"] == "pose"]
        await connection.send('{"is":"got"}')
        frames += [int(str(p["frame"])) for p in await pieces_of(connection) if p["is"] == "pose"]
        return frames

    with stand_in(tmp_path) as animator:
        animator.begin()
        frames = talk(animator.address, dawdle)
    assert frames[-1] == 49
    assert len(frames) <= UNDER_WAY + 1


def test_there_are_not_more_pages_than_can_be_served(tmp_path: Path) -> None:
    async def many(connection: ClientConnection) -> int:
        others = [await connect(socket_of(animator.address), compression=None) for _ in range(MOST_PAGES)]
        await others[-1].wait_closed()
        code = others[-1].close_code
        for other in others:
            await other.close()
        return code or 0

    with stand_in(tmp_path) as animator:
        assert talk(animator.address, many) == 1013


def test_a_port_that_is_taken_is_one_clear_error() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        server = PageServer(PageTable(port=port), lambda page, wish: None, lambda: None)
        with pytest.raises(
            PageError, match=rf"animator.page: 127.0.0.1:{port} cannot be served.*another animator.page.port"
        ):
            server.start()
        server.close()


def test_a_message_that_is_too_long_ends_the_page_and_nothing_else(tmp_path: Path) -> None:
    async def shout(connection: ClientConnection) -> int:
        await connection.send("x" * 100_000)
        await connection.wait_closed()
        return connection.close_code or 0

    async def listen(connection: ClientConnection) -> str:
        return str(await connection.recv())

    with stand_in(tmp_path) as animator:
        assert talk(animator.address, shout) == 1009
        assert "hello" in talk(animator.address, listen)
