"""The one line that says where a replay is."""

import io

import pytest
from rich.console import Console

from services.takes.replay import display as display_module
from services.takes.replay.display import display, words
from services.takes.replay.player import Status

HALF = Status(place_ns=15_000_000_000, begin_ns=5_000_000_000, end_ns=25_000_000_000, rate=2.0, paused=False, lap=1, sent=7)


def test_time_share_rate_and_state_are_said() -> None:
    assert words(HALF).split() == ["10.0", "of", "20.0", "s", "50", "%", "rate", "2", "playing", "7", "messages"]


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (Status(0, 0, 10, 0.0, False, 1, 0), "as fast as consumers keep up"),
        (Status(0, 0, 10, 1.0, True, 1, 0), "paused"),
        (Status(0, 0, 10, 1.0, False, 3, 0), "lap 3"),
        (Status(0, 0, 0, 1.0, False, 1, 0), "100 %"),
    ],
)
def test_what_is_unusual_is_said(status: Status, said: str) -> None:
    assert said in words(status)


def test_elsewhere_than_on_a_terminal_there_are_plain_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display_module, "LINE_S", 0.0)
    out = io.StringIO()
    with display(Console(file=out), keys=False) as show:
        show(HALF)
        show(HALF)
    assert out.getvalue() == f"{words(HALF)}\n" * 2


def test_on_a_terminal_one_line_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display_module, "REFRESH_S", 0.0)
    out = io.StringIO()
    with display(Console(file=out, force_terminal=True, width=120), keys=True) as show:
        show(HALF)
        show(HALF)
    assert "space pauses" in out.getvalue()
    assert out.getvalue().count("\n") < 4
