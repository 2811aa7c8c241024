"""`zenocap show`: a take on the page without a rig."""

import asyncio
import signal
from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.page_client import Updates, connected, read_until
from tests.support.pose_tracks import moving
from tests.support.processes import PATIENCE_S, completed, ended, output_of, started, wait_until
from zenocap.common.bus.zenoh_session import free_ports

pytestmark = pytest.mark.nightly


async def updates_until_pose(port: int) -> Updates:
    """Updates of a page by type, until it has a pose, a position of the player, and the answer to a request."""
    updates: Updates = {}
    async with await connected(port) as connection:
        await connection.send('{"type":"select_feed","feed":"take"}')
        await read_until(connection, updates, lambda p: "pose" in p and p["player"]["position_s"], "a pose")
        await connection.send('{"type":"request","what":"measure"}')
        await read_until(connection, updates, lambda p: "notice" in p, "the answer")
    return updates


def test_a_take_is_played_in_a_loop_until_it_is_interrupted(tmp_path: Path) -> None:
    take = write_take(tmp_path / "my walk.mcap", messages_of_track(moving(30, rate=30.0)))
    (port,) = free_ports(1)
    with started(["show", take, "--port", port], tmp_path) as process:
        wait_until(lambda: f"my walk.mcap: open http://127.0.0.1:{port}/ in a browser" in output_of(tmp_path), tmp_path)
        updates = asyncio.run(asyncio.wait_for(updates_until_pose(port), PATIENCE_S))
        assert ended(process, signal.SIGINT) == 0, output_of(tmp_path)
    assert (updates["hello"]["rig"], updates["hello"]["live"]) == ("my walk", False)
    assert updates["player"]["take"] == "my walk.mcap"
    assert updates["verdict"] == {"type": "verdict", "rating": "", "reasons": [], "parts": []}
    assert "without a rig" in str(updates["notice"]["text"])
    assert "Traceback" not in output_of(tmp_path)


@pytest.mark.parametrize(("name", "text"), [("gone.mcap", "no such file"), ("text.mcap", "is no MCAP file")])
def test_a_file_that_is_not_a_take_is_one_error_line(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "text.mcap").write_text("not a take")
    result = completed(["show", tmp_path / name, "--port", 0], tmp_path)
    assert result.returncode == 1
    assert result.stderr.startswith(f"error: {tmp_path / name}")
    assert text in result.stderr
    assert result.stderr.count("\n") == 1
