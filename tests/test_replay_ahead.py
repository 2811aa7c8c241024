"""Reading ahead: in order, bounded, and what goes wrong reaches the reader after everything before it."""

import threading
from collections.abc import Iterator

import pytest

from common.topics import SIGHTING
from services.takes.replay import ahead as ahead_module
from services.takes.replay.ahead import Ahead
from services.takes.replay.laps import Ready
from services.takes.replay.shifting import Shift


def ready(number: int, size: int = 10) -> Ready:
    return Ready(number, number, number, 1, SIGHTING, "zenocap/r/viewer/1/sighting", bytes(size), number, number, Shift())


def all_of(ahead: Ahead) -> list[int]:
    found = []
    while (one := ahead.peek(5.0)) is not None:
        found.append(one.frame)
        ahead.take()
    return found


@pytest.mark.parametrize("size", [0, 100, 20_000_000 // 16])
def test_everything_comes_in_order(size: int) -> None:
    count = 50 if size > 1000 else 10_000
    ahead = Ahead(ready(number, size) for number in range(count))
    assert all_of(ahead) == list(range(count))
    assert ahead.ended
    ahead.close()


def test_no_more_is_read_than_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ahead_module, "MAX_MESSAGES", 8)
    monkeypatch.setattr(ahead_module, "MAX_BYTES", 1000)
    asked, full = [0], threading.Event()

    def endless() -> Iterator[Ready]:
        while True:
            asked[0] += 1
            if asked[0] == 9:
                full.set()
            yield ready(asked[0])

    ahead = Ahead(endless())
    assert full.wait(5.0)
    assert ahead.buffered == (8, 80)
    for _ in range(100):
        assert ahead.peek(5.0) is not None
        ahead.take()
        assert ahead.buffered[0] <= 8
    ahead.close()
    assert asked[0] <= 110
    assert not any(thread.name == "read-ahead" for thread in threading.enumerate())


def test_a_message_larger_than_the_buffer_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ahead_module, "MAX_BYTES", 100)
    ahead = Ahead(iter([ready(1), ready(2, 1000), ready(3)]))
    assert all_of(ahead) == [1, 2, 3]


def test_a_failure_comes_after_what_was_read() -> None:
    def breaking() -> Iterator[Ready]:
        yield ready(1)
        raise OSError("the disk is gone")

    ahead = Ahead(breaking())
    assert ahead.peek(5.0) == ready(1)
    ahead.take()
    with pytest.raises(OSError, match="the disk is gone"):
        ahead.peek(5.0)
    ahead.close()
