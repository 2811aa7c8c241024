"""Progress of long work: its numbers, and one line every ten seconds away from a terminal."""

import pytest

from tests.support.live_cameras import until
from zenocap.tools.cli import progress as module
from zenocap.tools.cli.progress import WorkProgress, progress


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now_s = [0.0]
    monkeypatch.setattr(module, "monotonic", lambda: now_s[0])
    return now_s


def test_progress_line_has_count_total_rate_and_remaining_time(clock: list[float]) -> None:
    state = WorkProgress("tracking", "frames", 100)
    assert state.line() == "tracking: 0 of 100 frames, 0 s elapsed"
    clock[0] = 20.0
    state.update(10)  # compilation took the time before: it does not count
    clock[0] = 25.0
    state.update(60, note="searching")
    assert state.line() == "tracking: 60 of 100 frames, 10.0/s, 25 s elapsed, 4 s remaining  (searching)"


def test_without_a_total_there_is_no_remaining_time(clock: list[float]) -> None:
    state = WorkProgress("reading walk.mcap", "bytes")
    assert state.line() == "reading walk.mcap: 0 s elapsed"
    state.update(1_000_000)
    clock[0] = 2.0
    state.update(5_000_000)
    assert state.line() == "reading walk.mcap: 5 MB, 2.0/s, 2 s elapsed"
    assert state.remaining_s is None


def test_lines_are_printed_during_the_work_without_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LINE_S", 0.01)
    lines: list[str] = []
    monkeypatch.setattr(module.typer, "echo", lambda text, err: lines.append(text))
    with progress("drawing", "pictures", 3) as state:
        state.update(1)
        until(lambda: any("drawing: 1 of 3 pictures" in line for line in lines), "a line after the update")
    monkeypatch.setattr(module, "LINE_S", 10.0)
    lines.clear()
    with progress("drawing"):
        pass  # short work prints nothing
    assert lines == []


def test_a_second_part_of_the_work_has_its_own_rate(clock: list[float]) -> None:
    state = WorkProgress("tracking", "frames", 100)
    state.update(1)
    clock[0] = 10.0
    state.update(100)
    state.restart("tracking backwards", 80)
    assert state.line() == "tracking backwards: 0 of 80 frames, 0 s elapsed"
    state.update(1)
    clock[0] = 12.0
    state.update(21)
    assert state.line() == "tracking backwards: 21 of 80 frames, 10.0/s, 2 s elapsed, 6 s remaining"
