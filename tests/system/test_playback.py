"""Playing a take on the page with a real replay process."""

import asyncio
import json
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import msgspec
import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track
from tests.support.pose_tracks import moving
from tests.support.processes import PATIENCE_S
from zenocap.common.bus.protocol import Envelope
from zenocap.common.codec import encode
from zenocap.common.recording.writer import Recording
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import topic_of
from zenocap.common.web.broadcast import Broadcaster, EncodedUpdate
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.playback import PlayFile, StopPlayer, TakePlayer
from zenocap.services.animator.states import TOPICS

pytestmark = pytest.mark.nightly
COUNT = 30


class Page(Broadcaster):
    """One page that is always open.  updates: oldest first."""

    def __init__(self) -> None:
        super().__init__(asyncio.new_event_loop(), lambda: None, ("take",))
        self.updates: list[dict[str, object]] = []

    @property
    def pages(self) -> int:
        return 1

    def publish(self, feed: str | None, updates: Iterable[EncodedUpdate]) -> None:
        self.updates += [json.loads(update.data) for update in updates]

    def problems(self) -> list[object]:
        return [update["problem"] for update in self.updates if update["type"] == "player" and update["problem"]]

    def sees(self, kind: str) -> bool:
        return any(update["type"] == kind for update in self.updates)

    def wait_until(self, condition: Callable[[], bool]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < end_s, self.updates[-3:]
            time.sleep(0.02)


@pytest.fixture
def page() -> Page:
    return Page()


@pytest.fixture
def playback(tmp_path: Path, page: Page) -> Iterator[TakePlayer]:
    one = TakePlayer(tmp_path, page, RealClock(), TOPICS)
    yield one
    one.close()


def take(path: Path, of_another_version: Callable[[int], bool]) -> None:
    """Write a take of poses, some of them as a later version of zenocap would encode them."""
    recording = Recording(path, rig="studio", start_ns=START_NS)
    for k, message in enumerate(messages_of_track(moving(COUNT, rate=15.0))):
        topic = topic_of(type(message))
        data = encode(message)
        if of_another_version(k):
            data = msgspec.msgpack.encode(msgspec.msgpack.decode(data) | {"version": 2, "mood": "good"})
        key = topic.at("studio", **topic.names_of(message))
        recording.record(Envelope(key, topic, message, message.captured_ns, data))
    recording.close()


def test_a_take_of_another_version_is_reported_and_shows_nothing(tmp_path: Path, page: Page, playback: TakePlayer) -> None:
    take(tmp_path / "later.mcap", lambda k: True)
    playback.send(pm.PlayTake("later.mcap"))
    page.wait_until(lambda: bool(page.problems()))
    assert all(str(problem).endswith("messages cannot be read by this version") for problem in page.problems())
    assert not page.sees("pose")


def test_readable_messages_of_a_take_are_shown_beside_those_of_another_version(
    tmp_path: Path, page: Page, playback: TakePlayer
) -> None:
    take(tmp_path / "mixed.mcap", lambda k: k > 5 and k % 2 == 0)
    playback.send(pm.PlayTake("mixed.mcap"))
    page.wait_until(lambda: page.sees("pose") and bool(page.problems()))
    assert "messages cannot be read by this version" in str(page.problems()[0])


class StartingReplay:
    """A replay that has not published anything yet."""

    running, status = True, None

    def __init__(self, path: Path, port: int) -> None: ...

    def __enter__(self) -> "StartingReplay":
        return self

    def __exit__(self, *_: object) -> None: ...


def test_the_first_pose_is_shown_before_the_replay_publishes(
    tmp_path: Path, page: Page, playback: TakePlayer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("zenocap.services.animator.playback.ReplayProcess", StartingReplay)
    take(tmp_path / "walk.mcap", lambda k: False)
    playback.send(pm.PlayTake("walk.mcap"))
    page.wait_until(lambda: page.sees("pose") and page.sees("place"))
    kinds = [update["type"] for update in page.updates]
    assert kinds.index("player") < kinds.index("pose")  # which makes pages forget the take before
    assert {"body", "camera", "pose"} <= set(kinds)
    (pose,) = (update for update in page.updates if update["type"] == "pose")
    assert pose["frame"] == moving(COUNT).frames[0]


def test_a_missing_take_is_reported(page: Page, playback: TakePlayer) -> None:
    playback.send(pm.PlayTake("gone.mcap"))
    page.wait_until(lambda: page.problems() == ["gone.mcap: no such take"])


def test_another_take_follows_without_a_state_of_no_take(tmp_path: Path, page: Page, playback: TakePlayer) -> None:
    """Pages go back to the live rig when no take is played."""
    (tmp_path / "dropped").mkdir()
    for path in (tmp_path / "a.mcap", tmp_path / "dropped" / "b.mcap"):
        take(path, lambda k: False)
    playback.send(pm.PlayTake("a.mcap"))
    page.wait_until(lambda: page.sees("pose"))
    assert playback.current == tmp_path / "a.mcap"
    playback.send(PlayFile(tmp_path / "dropped" / "b.mcap"))

    def players() -> list[dict[str, object]]:
        return [update for update in page.updates if update["type"] == "player"]

    page.wait_until(lambda: players()[-1]["take"] == "b.mcap")
    assert [playback.owns(path) for path in (tmp_path / "a.mcap", tmp_path / "dropped" / "b.mcap")] == [True, False]
    assert {(update["take"], update["opened"]) for update in players()} == {("a.mcap", 1), ("b.mcap", 2)}
    playback.send(StopPlayer())
    page.wait_until(lambda: players()[-1]["take"] == "")
    assert playback.current is None
