"""A take on the page: a real replay in a process of its own, as far as pages are told of it."""

import asyncio
import json
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import msgspec
import pytest

from common.bus.protocol import Envelope
from common.codec import encode
from common.runtime.clock import RealClock
from common.take.recording import Recording
from common.topics import topic_of
from services.animator.page import wire
from services.animator.page.hub import Hub, Piece
from services.animator.page.wire import Feed
from services.animator.playback import Playback
from services.animator.shell import TOPICS
from tests.pose_tracks import moving
from tests.test_poses import START_NS, said_of

pytestmark = pytest.mark.system
COUNT = 30
PATIENCE_S = 60.0


class Page(Hub):
    """One page that is always open.  told: the pieces, oldest first."""

    def __init__(self) -> None:
        super().__init__(asyncio.new_event_loop(), lambda: None)
        self.told: list[dict[str, object]] = []

    @property
    def pages(self) -> int:
        return 1

    def publish(self, feed: Feed | None, pieces: Iterable[Piece]) -> None:
        self.told += [json.loads(piece.data) for piece in pieces]

    def problems(self) -> list[object]:
        return [piece["problem"] for piece in self.told if piece["is"] == "player" and piece["problem"]]

    def sees(self, kind: str) -> bool:
        return any(piece["is"] == kind for piece in self.told)

    def until(self, what: Callable[[], bool]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not what():
            assert time.monotonic() < end_s, self.told[-3:]
            time.sleep(0.02)


@pytest.fixture
def page() -> Page:
    return Page()


@pytest.fixture
def playback(tmp_path: Path, page: Page) -> Iterator[Playback]:
    one = Playback(tmp_path, page, RealClock(), TOPICS)
    yield one
    one.close()


def take(path: Path, of_another_version: Callable[[int], bool]) -> None:
    """Poses, some of them as a later version of zenocap says them."""
    recording = Recording(path, rig="studio", start_ns=START_NS)
    for k, message in enumerate(said_of(moving(COUNT, rate=15.0))):
        topic = topic_of(type(message))
        data = encode(message)
        if of_another_version(k):
            data = msgspec.msgpack.encode(msgspec.msgpack.decode(data) | {"version": 2, "mood": "good"})
        key = topic.at("studio", **topic.names_of(message))
        recording.record(Envelope(key, topic, message, message.captured_ns, data))
    recording.close()


def test_a_take_whose_messages_are_of_another_version_says_so_and_shows_nothing(
    tmp_path: Path, page: Page, playback: Playback
) -> None:
    take(tmp_path / "later.mcap", lambda k: True)
    playback.order(wire.Play("later.mcap"))
    page.until(lambda: bool(page.problems()))
    assert all(str(problem).endswith("messages cannot be read by this version") for problem in page.problems())
    assert not page.sees("pose")


def test_what_can_be_read_of_a_take_with_some_messages_of_another_version_is_shown(
    tmp_path: Path, page: Page, playback: Playback
) -> None:
    take(tmp_path / "mixed.mcap", lambda k: k > 5 and k % 2 == 0)
    playback.order(wire.Play("mixed.mcap"))
    page.until(lambda: page.sees("pose") and bool(page.problems()))
    assert "messages cannot be read by this version" in str(page.problems()[0])


def test_a_take_that_is_not_there_is_said_to_be_none(page: Page, playback: Playback) -> None:
    playback.order(wire.Play("gone.mcap"))
    page.until(lambda: page.problems() == ["gone.mcap: no such take"])
