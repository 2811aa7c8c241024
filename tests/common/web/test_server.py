"""Server of the page: access, updates of a page, and isolation of slow pages."""

import asyncio
import json
import re
import socket
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidStatus

from tests.support.animator_stand_in import bap, pose_at, stand_in
from tests.support.places import ROOT
from zenocap.common.errors import UserError
from zenocap.common.messages import Preview, Request
from zenocap.common.rig.animator import PageTable
from zenocap.common.web.content import PageContent
from zenocap.common.web.messages import Decoder
from zenocap.common.web.page import Page
from zenocap.common.web.parameters import MAX_PAGES, MAX_UNACKNOWLEDGED

TOKEN = "a-token-of-sixteen-letters"
T = TypeVar("T")


def fetched(address: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    request = urllib.request.Request(address, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
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


async def updates_until(connection: ClientConnection, kind: str) -> list[dict[str, object]]:
    """All updates up to the first of a type."""
    found: list[dict[str, object]] = []
    while not any(update["type"] == kind for update in found):
        found += await updates_of(connection)
    return found


async def updates_of(connection: ClientConnection) -> list[dict[str, object]]:
    """The next list, acknowledged."""
    updates: list[dict[str, object]] = json.loads(await asyncio.wait_for(connection.recv(), 60))
    await connection.send('{"type":"acknowledge"}')
    return updates


async def first_list(connection: ClientConnection) -> str:
    return str(await connection.recv())


def test_the_page_and_its_files_have_a_content_security_policy(tmp_path: Path) -> None:
    with stand_in(tmp_path) as animator:
        for name, kind in (("", "text/html"), ("main.js", "text/javascript"), ("style.css", "text/css")):
            status, headers, body = fetched(animator.address + name)
            assert status == 200
            assert headers["Content-Type"].startswith(kind)
            assert "default-src 'none'" in headers["Content-Security-Policy"]
            assert "unsafe" not in headers["Content-Security-Policy"]
            assert body
        for name in ("nothing", "..%2f..%2fshell.py", "../server.py"):
            assert fetched(animator.address + name)[0] == 404


def test_a_foreign_host_name_is_refused(tmp_path: Path) -> None:
    """DNS rebinding: the browser takes this server for the site of an attacker."""
    with stand_in(tmp_path) as animator:
        port = animator.address.split(":")[2].strip("/")
        assert fetched(animator.address, Host=f"evil.example:{port}")[0] == 403
        assert fetched(animator.address, Host=f"localhost:{port}")[0] == 200


@pytest.mark.parametrize("allowed", [[], ["https://rig.example"]])
def test_a_socket_is_opened_for_pages_of_this_server_and_of_origins_that_the_rig_allows(
    tmp_path: Path, allowed: list[str]
) -> None:
    with stand_in(tmp_path, origins=allowed) as animator:
        for origin in (animator.address.rstrip("/"), *allowed):
            assert "hello" in talk(animator.address, first_list, origin=origin)
        for origin in ("https://evil.example", "http://["):
            with pytest.raises(InvalidStatus, match="403"):
                talk(animator.address, first_list, origin=origin)


@pytest.mark.parametrize("wrong", ["", "?token=", "?token=a-token-of-sixteen-lettern", "?tok=" + TOKEN])
def test_without_the_token_there_is_neither_page_nor_socket(tmp_path: Path, wrong: str) -> None:
    with stand_in(tmp_path, host="0.0.0.0", token=TOKEN) as animator:
        right = animator.address.replace("0.0.0.0", "127.0.0.1")
        assert fetched(right)[0] == 200
        assert "hello" in talk(right, first_list)
        bad = right.partition("?")[0] + wrong
        assert fetched(bad)[0] == 403
        assert fetched(bad.replace("/?", "//?"))[0] in (403, 404)  # it was the page
        with pytest.raises(InvalidStatus, match="403"):
            talk(bad, first_list)


def test_the_health_text_has_no_token(tmp_path: Path) -> None:
    with stand_in(tmp_path, token=TOKEN) as animator:
        assert TOKEN in animator.address
        assert TOKEN not in animator.bridge.health_text()


def test_a_page_that_opens_gets_all_updates(tmp_path: Path) -> None:
    async def listen(connection: ClientConnection) -> set[object]:
        first = await updates_until(connection, "hello")
        animator.tick()  # in the service, the first open page triggers it
        return {update["type"] for update in [*first, *await updates_until(connection, "services")]}

    with stand_in(tmp_path) as animator:
        animator.begin()
        animator.send_frame_set(0.0)
        assert {"hello", "body", "pose", "camera", "view", "services"} <= talk(animator.address, listen)


def test_valid_commands_become_requests_and_others_are_refused(tmp_path: Path) -> None:
    async def ask(connection: ClientConnection) -> tuple[list[Request], str]:
        await connection.send('{"type":"request","what":"measure"}')
        await connection.send('{"type":"request","what":"explode"}')
        refused = await updates_until(connection, "notice")
        return list(animator.bridge.requests()), str(refused[-1]["text"])

    with stand_in(tmp_path) as animator:
        asked, refused = talk(animator.address, ask)
    assert [(request.what, request.frame) for request in asked] == [("measure", 0)]
    assert "invalid command from a page" in refused


@pytest.mark.nightly
def test_a_page_that_never_reads_skips_frames_and_costs_no_memory(tmp_path: Path) -> None:
    async def block_reading(blocked: ClientConnection) -> tuple[int, int]:
        raw = blocked.transport
        raw.pause_reading()  # the kernel's buffers fill up
        async with connect(socket_of(animator.address), compression=None) as reading:
            seen = 0
            for k in range(120):
                large = Preview(frame=k, captured_ns=0, viewer="1", jpeg=bytes(200_000))
                animator.receive(large, bap(k, animator.clock.now_ns(), pose_at(k / 60)))
                seen += sum(update["type"] == "pose" for update in await updates_of(reading))
            assert animator.bridge._feed is not None
            return seen, max(len(page.waiting) for page in animator.bridge._feed.page.updates._pages)

    with stand_in(tmp_path) as animator:
        animator.begin()
        seen, waiting = talk(animator.address, block_reading)
    assert seen > 60
    assert 0 < waiting < 20  # updates, one of each key


@pytest.mark.slow
def test_a_page_that_is_behind_gets_the_latest_pose_next(tmp_path: Path) -> None:
    async def acknowledge_late(connection: ClientConnection) -> list[int]:
        await updates_until(connection, "hello")
        frames: list[int] = []
        for k in range(50):
            animator.receive(bap(k, animator.clock.now_ns(), pose_at(0.0)))
            await asyncio.sleep(0.002)
        for _ in range(MAX_UNACKNOWLEDGED):  # sent before it stopped acknowledging
            frames += [int(str(p["frame"])) for p in json.loads(await connection.recv()) if p["type"] == "pose"]
        await connection.send('{"type":"acknowledge"}')
        frames += [int(str(p["frame"])) for p in await updates_of(connection) if p["type"] == "pose"]
        return frames

    with stand_in(tmp_path) as animator:
        animator.begin()
        frames = talk(animator.address, acknowledge_late)
    assert frames[-1] == 49
    assert len(frames) <= MAX_UNACKNOWLEDGED + 1


@pytest.mark.slow
def test_pages_beyond_the_maximum_are_refused(tmp_path: Path) -> None:
    async def many(connection: ClientConnection) -> tuple[int | None, str | None]:
        others = [await connect(socket_of(animator.address), compression=None) for _ in range(MAX_PAGES)]
        await others[-1].wait_closed()
        for other in others:
            await other.close()
        return others[-1].close_code, others[-1].close_reason

    with stand_in(tmp_path) as animator:
        assert talk(animator.address, many) == (1013, f"{MAX_PAGES} pages are open already")


def test_a_port_in_use_is_one_clear_error() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        content: PageContent[object] = PageContent({}, Decoder(None), "animator", "animator.page.")
        page = Page(PageTable(port=port), content)
        refusal = rf"animator.page: 127.0.0.1:{port} cannot be served.*another animator.page.port"
        with pytest.raises(UserError, match=refusal):
            page.open()
        page.close()


def test_a_command_that_is_too_long_closes_that_page_only(tmp_path: Path) -> None:
    async def send_too_much(connection: ClientConnection) -> int:
        await connection.send("x" * 100_000)
        await connection.wait_closed()
        return connection.close_code or 0

    with stand_in(tmp_path) as animator:
        assert talk(animator.address, send_too_much) == 1009
        assert "hello" in talk(animator.address, first_list)


def test_the_page_sets_html_from_its_own_literals_only() -> None:
    """Health, labels and names of takes are texts of others: only `textContent`, never markup."""
    folders = (ROOT / "services" / "animator" / "page" / "static", ROOT / "common" / "web" / "static")
    scripts = "\n".join(path.read_text() for folder in folders for path in sorted(folder.glob("*.js")))
    assert not re.search(r"outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function", scripts)
    values = re.findall(r"\.innerHTML\s*\+?=\s*(.*)", scripts)
    assert values
    assert all(re.fullmatch(r"'[^'`$]*';", value) for value in values)
