"""First pose of a take, shown while its replay starts."""

from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.pose_tracks import moving
from zenocap.services.animator import opening
from zenocap.services.animator.opening import opening_state
from zenocap.services.animator.states import TOPICS, AnimatorState

NOW_NS = START_NS + 90_000_000_000


def opened(path: Path, **track: object) -> AnimatorState:
    return opening_state(write_take(path, messages_of_track(moving(20, **track))), TOPICS, NOW_NS)


@pytest.mark.parametrize("track", [{"first": 3}, {"lost": (0, 1, 2)}], ids=["first frame 3", "lost before"])
def test_the_first_pose_of_a_person_has_its_body_and_cameras(tmp_path: Path, track: dict[str, object]) -> None:
    state = opened(tmp_path / "a.mcap", **track)
    (actor,) = state.actors.values()
    assert (actor.frame, actor.received_ns, state.now_ns) == (3, NOW_NS, NOW_NS)
    assert list(state.cameras) == ["1"]
    assert state.bodies


@pytest.mark.parametrize("content", [None, b"", b"no take", b"\x89MCAP0\r\n"])
def test_a_file_that_is_no_take_has_no_opening(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "a.mcap"
    if content is not None:
        path.write_bytes(content)
    assert not opening_state(path, TOPICS, NOW_NS).actors


def test_only_the_beginning_of_a_take_is_searched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = tuple(range(15))
    assert opened(tmp_path / "a.mcap", lost=lost).actors
    monkeypatch.setattr(opening, "MAX_OPENING_MESSAGES", 10)
    assert not opened(tmp_path / "b.mcap", lost=lost).actors
