"""Tests of the terminal display and the remote control of a replay."""

import io
import os
import time
from collections.abc import Callable

import msgspec
import pytest
from rich.console import Console

from zenocap.common.runtime.keyboard import Key
from zenocap.tools.record.replay import controls
from zenocap.tools.record.replay.controls import Remote, StatusLine, display, status_lines, status_text
from zenocap.tools.record.replay.player import Command, Status

HALF = Status(place_ns=15_000_000_000, begin_ns=5_000_000_000, end_ns=25_000_000_000, rate=2.0, paused=False, lap=1, sent=7)


def test_status_text_has_time_percentage_rate_and_state() -> None:
    assert status_text(HALF).split() == ["10.0", "of", "20.0", "s", "50", "%", "rate", "2", "playing", "7", "messages"]


@pytest.mark.parametrize(
    ("status", "expected"),
    [
        (Status(0, 0, 10, 0.0, False, 1, 0), "as fast as consumers keep up"),
        (Status(0, 0, 10, 1.0, True, 1, 0), "paused"),
        (Status(0, 0, 10, 1.0, False, 3, 0), "lap 3"),
        (Status(0, 0, 0, 1.0, False, 1, 0), "100 %"),
    ],
)
def test_status_text_shows_special_states(status: Status, expected: str) -> None:
    assert expected in status_text(status)


def test_output_without_a_terminal_is_plain_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(controls, "LINE_S", 0.0)
    out = io.StringIO()
    with display(Console(file=out), keys=False) as show:
        show(HALF)
        show(HALF)
    assert out.getvalue() == f"{status_text(HALF)}\n" * 2


def test_output_on_a_terminal_updates_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(controls, "REFRESH_S", 0.0)
    out = io.StringIO()
    with display(Console(file=out, force_terminal=True, width=120), keys=True) as show:
        show(HALF)
        show(HALF)
    assert "space pauses" in out.getvalue()
    assert out.getvalue().count("\n") < 4


def commands_of(text: str) -> list[Command | Key]:
    remote = Remote(io.StringIO(text))
    found: list[Command | Key] = []
    end_s = time.monotonic() + 10
    while Key.QUIT not in found:
        assert time.monotonic() < end_s
        found += remote.pressed()
    return found


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ('{"paused":true}', Command(paused=True)),
        ('{"place_s":1.5,"paused":null,"rate":null}', Command(place_ns=1_500_000_000)),
        ('{"rate":4,"paused":false}', Command(paused=False, rate=4.0)),
    ],
)
def test_input_line_is_a_command_and_end_of_input_quits(line: str, command: Command) -> None:
    assert commands_of(line + "\n") == [command, Key.QUIT]


def test_invalid_commands_are_reported_and_skipped(capsys: pytest.CaptureFixture[str]) -> None:
    assert commands_of('{"rate":0}\nnonsense\n{"paused":true}\n') == [Command(paused=True), Key.QUIT]
    assert capsys.readouterr().err.count("invalid command") == 2


def test_reading_commands_does_not_block() -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading) as stream:
        assert Remote(stream).pressed() == []
        os.close(writing)  # the end, for its thread


def test_status_is_a_json_line_in_seconds() -> None:
    stream = io.StringIO()
    write: Callable[[Status], None] = status_lines(stream)
    write(Status(3_000_000_000, 1_000_000_000, 11_000_000_000, 2.0, True, 1, 40))
    write(Status(3_100_000_000, 1_000_000_000, 11_000_000_000, 2.0, True, 1, 41))  # too soon
    (line,) = stream.getvalue().splitlines()
    assert msgspec.json.decode(line, type=StatusLine) == StatusLine(
        place_s=2.0, duration_s=10.0, rate=2.0, paused=True, lap=1
    )
