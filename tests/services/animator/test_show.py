"""A shown take: its pictures, takes dropped on it, formats to save it in."""

from pathlib import Path
from unittest.mock import Mock, call

import pytest
from msgspec import to_builtins
from websockets.asyncio.client import ClientConnection

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.common.web.test_server import talk, updates_until
from tests.services.animator.test_comparison import actor, timed
from tests.support.animator_stand_in import stand_in
from tests.support.package_rows import add_row
from tests.support.pose_tracks import moving
from zenocap.common.formats.export_format import FORMATS, ExportFormat
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.page.page_messages import DroppedUpdate, PlayerUpdate, PlayTake
from zenocap.services.animator.playback import PlayFile
from zenocap.services.animator.save_command import format_choices
from zenocap.services.animator.show import TakePage

SHIFT_NS = 40_000_000_000  # of the fifth repetition of a take of 10 s
DROPPED = Path("/tmp/x/b.mcap")


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> TakePage:
    page = TakePage(write_take(tmp_path / "a.mcap", messages_of_track(moving(10))), PageTable(port=0))
    monkeypatch.setattr(page, "_camera_feed", Mock())
    monkeypatch.setattr(page, "_start_ns", START_NS)
    return page


def test_pictures_follow_the_poses_while_a_take_plays_and_the_position_while_it_is_paused(page: TakePage) -> None:
    track, playing = timed(moving(10, rate=20.0)), PlayerUpdate("a.mcap", 0.2, 0.5)
    page._on_update(playing)  # no pose yet: the position
    page._on_pose(actor(track, 5, SHIFT_NS), SHIFT_NS)
    page._on_update(playing)  # behind the pose by up to a period of the player: not shown
    page._on_pose(actor(track, 6, SHIFT_NS), 0)  # its shift is not known yet: not shown
    page._on_update(PlayerUpdate("a.mcap", 0.4, 0.5, paused=True))
    page._on_pose(actor(track, 7, SHIFT_NS), SHIFT_NS)
    assert [call.args[0] for call in page._camera_feed.show.call_args_list] == pytest.approx([0.2, 0.25, 0.4])


def test_a_dropped_take_that_cannot_be_played_does_not_end_the_page(
    page: TakePage, monkeypatch: pytest.MonkeyPatch
) -> None:
    player = Mock()
    monkeypatch.setattr(page._feed, "player", player)
    page._on_update(PlayerUpdate("a.mcap", opened=1))
    page._on_drop(DROPPED)
    page._on_update(PlayerUpdate("b.mcap", opened=2))
    assert page.player.take == "a.mcap"
    page._on_update(PlayerUpdate("", problem="b.mcap: unreadable"))
    page._on_update(PlayerUpdate(""))  # end of the dropped one
    assert page.player.take == "a.mcap"
    assert player.send.call_args_list == [call(PlayFile(DROPPED)), call(PlayTake("a.mcap"))]
    page._on_update(PlayerUpdate("a.mcap", opened=3))
    page._on_update(PlayerUpdate("", problem="a.mcap: removed"))  # that of the page
    assert page.player.problem == "a.mcap: removed"


def test_a_take_that_is_dropped_before_the_page_plays_is_refused_in_words(
    page: TakePage, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish = Mock()
    monkeypatch.setattr(page._feed.page, "publish", publish)
    page._on_drop(DROPPED)
    publish.assert_called_once_with("dropped", DroppedUpdate(problem="b.mcap: the page is being opened; drop it again"))


def test_the_page_of_a_take_and_that_of_a_rig_offer_the_formats_of_the_table(
    page: TakePage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def hello(connection: ClientConnection) -> dict[str, object]:
        return (await updates_until(connection, "hello"))[0]

    add_row(monkeypatch, FORMATS, "sto", ExportFormat("sto", "more:write", (".sto",), title="STO: OpenSim"))
    publish = Mock()
    monkeypatch.setattr(page._feed.page, "publish", publish)
    page._switch(DROPPED, DroppedUpdate("b.mcap"))
    offered = publish.call_args.args[1].formats
    assert offered == format_choices()
    assert offered[-1].title == "STO: OpenSim"
    with stand_in(tmp_path) as animator:
        assert talk(animator.address, hello)["formats"] == to_builtins(offered)
