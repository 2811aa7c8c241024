"""Prefetch: in order, bounded, and an error reaches the reader after everything read before it."""

import threading
import time
from collections.abc import Iterator

import pytest

from tests.support.live_cameras import until
from zenocap.common.topics import SIGHTING
from zenocap.tools.record.replay import prefetch as prefetch_module
from zenocap.tools.record.replay.playlist import PreparedMessage
from zenocap.tools.record.replay.prefetch import Prefetch
from zenocap.tools.record.replay.time_shift import Shift


def prepared(number: int, size: int = 10) -> PreparedMessage:
    key = SIGHTING.at("r", viewer="1")
    return PreparedMessage(number, number, number, 1, SIGHTING, key, bytes(size), number, number, Shift())


def all_of(prefetch: Prefetch) -> list[int]:
    found = []
    while (one := prefetch.peek(5.0)) is not None:
        found.append(one.frame)
        prefetch.take()
    return found


@pytest.mark.parametrize("size", [0, 100, 20_000_000 // 16])
def test_messages_are_returned_in_order(size: int) -> None:
    count = 50 if size > 1000 else 10_000
    prefetch = Prefetch(prepared(number, size) for number in range(count))
    assert all_of(prefetch) == list(range(count))
    assert prefetch.ended
    prefetch.close()


def test_prefetch_is_limited_by_the_buffer_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prefetch_module, "MAX_MESSAGES", 8)
    monkeypatch.setattr(prefetch_module, "MAX_BYTES", 1000)
    produced, full = [0], threading.Event()

    def endless() -> Iterator[PreparedMessage]:
        while True:
            produced[0] += 1
            if produced[0] == 9:
                full.set()
            yield prepared(produced[0])

    prefetch = Prefetch(endless())
    assert full.wait(60.0)
    assert prefetch.buffered == (8, 80)
    for _ in range(100):
        assert prefetch.peek(5.0) is not None
        prefetch.take()
        assert prefetch.buffered[0] <= 8
    prefetch.close()
    assert produced[0] <= 110
    assert not any(thread.name == "read-ahead" for thread in threading.enumerate())


def test_the_buffer_grows_with_what_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prefetch_module, "FIRST_MESSAGES", 4)
    monkeypatch.setattr(prefetch_module, "GROWTH", 2)
    monkeypatch.setattr(prefetch_module, "MAX_MESSAGES", 10)
    produced: list[int] = []

    def counted() -> Iterator[PreparedMessage]:
        for number in range(1000):
            produced.append(number)
            yield prepared(number)

    def settled(fewest: int) -> int:
        until(lambda: prefetch.buffered[0] >= fewest, "a full buffer")
        time.sleep(0.05)
        return prefetch.buffered[0]

    prefetch = Prefetch(counted())
    assert settled(4) == 4
    assert len(produced) == 5  # and one that waits
    for _ in range(12):
        assert prefetch.peek(5.0) is not None
        prefetch.take()
    assert 5 < settled(6) <= 10  # refilled at half of 10
    prefetch.close()


def test_a_message_larger_than_the_buffer_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prefetch_module, "MAX_BYTES", 100)
    prefetch = Prefetch(iter([prepared(1), prepared(2, 1000), prepared(3)]))
    assert all_of(prefetch) == [1, 2, 3]


def test_read_error_is_raised_after_the_messages_before_it() -> None:
    def breaking() -> Iterator[PreparedMessage]:
        yield prepared(1)
        raise OSError("the disk is gone")

    prefetch = Prefetch(breaking())
    assert prefetch.peek(5.0) == prepared(1)
    prefetch.take()
    with pytest.raises(OSError, match="the disk is gone"):
        prefetch.peek(5.0)
    prefetch.close()
