"""Orders to a replay from the program that started it."""

import io
import os
import time
from collections.abc import Callable

import msgspec
import pytest

from common.runtime.keys import Key
from services.takes.replay.player import Order, Status
from services.takes.replay.remote import Remote, StatusLine, status_lines


def orders_of(text: str) -> list[Order | Key]:
    remote = Remote(io.StringIO(text))
    found: list[Order | Key] = []
    end_s = time.monotonic() + 10
    while Key.QUIT not in found:
        assert time.monotonic() < end_s
        found += remote.pressed()
    return found


@pytest.mark.parametrize(
    ("line", "order"),
    [
        ('{"paused":true}', Order(paused=True)),
        ('{"place_s":1.5,"paused":null,"rate":null}', Order(place_ns=1_500_000_000)),
        ('{"rate":4,"paused":false}', Order(paused=False, rate=4.0)),
    ],
)
def test_a_line_is_an_order_and_the_end_is_the_order_to_quit(line: str, order: Order) -> None:
    assert orders_of(line + "\n") == [order, Key.QUIT]


def test_what_is_no_order_is_said_and_passed_over(capsys: pytest.CaptureFixture[str]) -> None:
    assert orders_of('{"rate":0}\nnonsense\n{"paused":true}\n') == [Order(paused=True), Key.QUIT]
    assert capsys.readouterr().err.count("not an order") == 2


def test_looking_for_orders_never_waits() -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading) as stream:
        assert Remote(stream).pressed() == []
        os.close(writing)  # the end, for its thread


def test_the_status_is_a_line_of_seconds() -> None:
    stream = io.StringIO()
    say: Callable[[Status], None] = status_lines(stream)
    say(Status(3_000_000_000, 1_000_000_000, 11_000_000_000, 2.0, True, 1, 40))
    say(Status(3_100_000_000, 1_000_000_000, 11_000_000_000, 2.0, True, 1, 41))  # too soon
    (line,) = stream.getvalue().splitlines()
    assert msgspec.json.decode(line, type=StatusLine) == StatusLine(
        place_s=2.0, duration_s=10.0, rate=2.0, paused=True, lap=1
    )
