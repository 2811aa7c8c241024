"""A page: what its commands become, and what a page that opens gets."""

from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import pytest
from websockets.asyncio.client import ClientConnection, connect

from tests.common.web.test_server import socket_of, talk, updates_until
from tests.support.live_cameras import until
from zenocap.common.errors import UserError
from zenocap.common.rig.animator import PageTable
from zenocap.common.web.broadcast import PageQueue
from zenocap.common.web.content import PageContent
from zenocap.common.web.messages import Decoder
from zenocap.common.web.page import Page
from zenocap.common.web.parameters import MOST_COMMANDS


class Count(msgspec.Struct, frozen=True, tag="count", tag_field="type"):
    number: int


class Now(msgspec.Struct, frozen=True, tag="now", tag_field="type"):
    number: int


class Value(msgspec.Struct, frozen=True, tag="value", tag_field="type"):
    number: int


Command = Count | Now


@contextmanager
def served(woken: list[int] | None = None) -> Iterator[Page[Command]]:
    """A page that answers `Now` in the server's thread."""

    def direct(queue: PageQueue, command: Command) -> bool:
        if isinstance(command, Now):
            page.publish("value", Value(command.number))
        return isinstance(command, Now)

    content: PageContent[Command] = PageContent({}, Decoder(Command), "test", "--")
    page = Page(PageTable(port=0), content, direct, lambda: woken.append(1) if woken is not None else None)
    page.open()
    page.publish("hello", Value(0))
    try:
        yield page
    finally:
        page.close()


async def send_counts_and_now(connection: ClientConnection) -> None:
    """Send three commands that wait, and one whose answer is awaited."""
    for number in range(3):
        await connection.send(f'{{"type":"count","number":{number}}}')
    await connection.send('{"type":"now","number":7}')
    while {"type": "value", "number": 7} not in await updates_until(connection, "value"):
        pass


def test_commands_wait_in_their_order_unless_they_are_answered_directly() -> None:
    woken: list[int] = []
    with served(woken) as page:
        talk(page.address, send_counts_and_now)
        assert list(page.commands()) == [Count(0), Count(1), Count(2)]
        assert list(page.commands()) == []
        assert len(woken) == 4  # a page has opened, and three commands wait


def test_commands_beyond_the_maximum_are_refused_with_a_reason() -> None:
    async def act(connection: ClientConnection) -> str:
        for number in range(MOST_COMMANDS + 1):
            await connection.send(f'{{"type":"count","number":{number}}}')
        return str((await updates_until(connection, "notice"))[-1]["text"])

    with served() as page:
        assert talk(page.address, act) == "refused: too many commands wait"
        assert len(list(page.commands())) == MOST_COMMANDS


def test_a_notice_is_for_the_pages_that_are_open() -> None:
    async def act(first: ClientConnection) -> tuple[object, list[dict[str, object]]]:
        await updates_until(first, "value")
        page.notice("once")
        seen = (await updates_until(first, "notice"))[-1]["text"]
        page.publish("end", Value(9))
        async with connect(socket_of(page.address), compression=None) as second:
            return seen, await updates_until(second, "value")

    with served() as page:
        seen, later = talk(page.address, act)
    assert seen == "once"
    assert all(update["type"] == "value" for update in later)


def test_openings_count_how_often_a_first_page_opens() -> None:
    async def act(first: ClientConnection) -> None:
        await updates_until(first, "value")
        async with connect(socket_of(page.address), compression=None) as second:
            await updates_until(second, "value")

    with served() as page:
        for number in range(1, 3):
            talk(page.address, act)
            assert page.openings == number
            until(lambda: not page.pages)


def test_a_page_runs_until_it_is_stopped() -> None:
    handled: list[Command] = []
    turns: list[int] = []

    def turn() -> bool:
        turns.append(1)
        return False

    with served() as page:
        talk(page.address, send_counts_and_now)
        page.run(lambda: len(turns) >= 3, handled.append, turn, 0.001)
    assert handled == [Count(0), Count(1), Count(2)]


def test_a_flood_of_commands_delays_neither_a_turn_nor_the_end() -> None:
    turns: list[int] = []
    with served() as page:

        def handle(command: Command) -> None:
            page._receive(PageQueue(), command)  # the next one is there at once

        page._receive(PageQueue(), Count(0))
        page.run(lambda: len(turns) >= 3, handle, lambda: turns.append(1) is None, 0.0)
    assert len(turns) == 3


def test_a_command_that_fails_is_said_and_the_page_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    handled: list[Command] = []
    texts: list[str] = []

    def handle(command: Command) -> None:
        handled.append(command)
        if command == Count(0):
            raise UserError("not now")
        if command == Count(1):
            raise ZeroDivisionError("a fault")

    with served() as page:
        monkeypatch.setattr(page, "notice", texts.append)
        for number in range(3):
            page._receive(PageQueue(), Count(number))
        page.run(lambda: len(handled) == 3, handle, lambda: False, 0.0)
    assert texts == ["not now", "Count: failed: a fault"]
