"""Tests of the terminal display and the remote control of a replay."""

import io
import os
from dataclasses import replace

import msgspec
import pytest
from rich.console import Console

from tests.support.live_cameras import until
from zenocap.common.runtime.keyboard import Key
from zenocap.tools.record.replay import controls
from zenocap.tools.record.replay.controls import Remote, StatusLine, display, status_lines, status_text
from zenocap.tools.record.replay.player import Command, Status

HALF = Status(place_ns=15_000_000_000, begin_ns=5_000_000_000, end_ns=25_000_000_000, rate=2.0, paused=False, lap=1, sent=7)


def test_status_text_has_time_percentage_rate_and_state() -> None:
    assert status_text(HALF).split() == ["10.0", "of", "20.0", "s", "50", "%", "rate", "2", "playing", "7", "messages"]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"rate": 0.0}, "as fast as consumers keep up"),
        ({"paused": True}, "paused"),
        ({"lap": 3}, "lap 3"),
        ({"end_ns": HALF.begin_ns}, "100 %"),
    ],
)
def test_status_text_shows_special_states(changes: dict[str, object], expected: str) -> None:
    assert expected in status_text(replace(HALF, **changes))


def shown_twice(keys: bool, **options: object) -> str:
    """The output of a display that shows a status twice."""
    out = io.StringIO()
    with display(Console(file=out, **options), keys=keys) as show:
        show(HALF)
        show(HALF)
    return out.getvalue()


def test_output_is_plain_lines_and_on_a_terminal_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(controls, "LINE_S", 0.0)
    monkeypatch.setattr(controls, "REFRESH_S", 0.0)
    assert shown_twice(keys=False) == f"{status_text(HALF)}\n" * 2
    terminal = shown_twice(keys=True, force_terminal=True, width=120)
    assert "space pauses" in terminal
    assert terminal.count("\n") < 4


def commands_of(text: str) -> list[Command | Key]:
    remote, found = Remote(io.StringIO(text)), list[Command | Key]()
    until(lambda: found.extend(remote.pressed()) or Key.QUIT in found, "the end of input")
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
    write = status_lines(stream)
    write(HALF)
    write(replace(HALF, place_ns=15_100_000_000))  # too soon
    (line,) = stream.getvalue().splitlines()
    expected = StatusLine(place_s=10.0, duration_s=20.0, rate=2.0, paused=False, lap=1)
    assert msgspec.json.decode(line, type=StatusLine) == expected
