"""Animator as a user runs it: real rig, page client, playback of the recorded take."""

import asyncio
import json
import signal
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection

from tests.support.demo_rigs import written_demo
from tests.support.networks import free_endpoint
from tests.support.page_client import Updates, connected, read_until
from tests.support.processes import PATIENCE_S, ended, messages_in, output_of, recomputed_poses, run, started, wait_until
from tests.support.session_rigs import SessionRig
from zenocap.common import messages as m
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.rig.rig import demo_rig_file


def rig_file(folder: Path, port: int) -> Path:
    """Write the demo rig with its page on another port."""
    return written_demo(folder, f"[animator.page]\nport = {port}\n")


def phase_of(updates: Updates, service: str) -> str:
    rows = updates.get("services", {}).get("services", [])
    return next((str(row["phase"]) for row in rows if row["name"] == service), "")


def measuring_again(updates: Updates) -> bool:
    """Whether the integrator is measuring a body, or has measured another one."""
    return "body" in updates or phase_of(updates, "integrator") != "tracking"


@pytest.mark.core
def test_a_page_shows_a_running_rig(two_view_rig: SessionRig) -> None:
    async def visit() -> None:
        updates: Updates = {}
        async with await asyncio.wait_for(connected(two_view_rig.page), PATIENCE_S) as connection:
            await read_until(connection, updates, lambda p: {"pose", "view", "services"} <= p.keys(), "a pose and a view")
            await read_until(connection, updates, lambda p: phase_of(p, "integrator") == "tracking", "tracking")
            assert updates["services"]["recording"] is True

    asyncio.run(visit())


@pytest.mark.nightly
def test_a_page_shows_the_rig_requests_measuring_and_recording_and_plays_the_take(tmp_path: Path) -> None:
    (port,) = free_ports(1)

    async def visit() -> None:
        updates: Updates = {}
        async with await asyncio.wait_for(connected(port), PATIENCE_S) as connection:
            await read_until(connection, updates, lambda p: "pose" in p and "view" in p, "a pose and a view")
            last_frame = int(str(updates["pose"]["frame"])) + 40  # services publish their input trace once a second
            await read_until(connection, updates, lambda p: int(str(p["pose"]["frame"])) > last_frame, "more poses")
            updates.pop("body", None)
            await connection.send('{"type":"request","what":"measure"}')  # at once, if still in T-pose
            await read_until(connection, updates, measuring_again, "measuring again")
            await connection.send('{"type":"request","what":"stop_recording"}')
            await read_until(connection, updates, lambda p: p["services"]["recording"] is False, "no take any more")
            await connection.send('{"type":"list_takes"}')
            await read_until(connection, updates, lambda p: "takes" in p, "the list")
            ((take, *_),) = updates["takes"]["takes"]
            await play(connection, updates, str(take))
            await connection.send('{"type":"request","what":"record"}')
            # Of the live rig: the services of the take that was played say that one is being written, too.
            await read_until(connection, updates, lambda p: p.get("recording", {}).get("recording"), "another take")

    with started(["up", rig_file(tmp_path, port)], tmp_path) as process:
        asyncio.run(visit())
        assert ended(process, signal.SIGINT) == 0, output_of(tmp_path)
    text = output_of(tmp_path)
    assert f"http://127.0.0.1:{port}" in text
    assert "Traceback" not in text
    first, second = sorted((tmp_path / "recordings").glob("*.mcap"))
    assert [request.what for request in messages_in(first, m.Request)] == ["measure", "stop_recording"]
    assert messages_in(second, m.Request) == []  # it starts after the request
    assert recomputed_poses(first) > 5


async def play(connection: ClientConnection, updates: Updates, take: str) -> None:
    """Play a take and use all its controls."""
    updates.clear()
    await connection.send('{"type":"select_feed","feed":"take"}')
    await connection.send(json.dumps({"type": "play_take", "take": take}))
    await read_until(connection, updates, lambda p: "pose" in p and _position(p) > 0, "a pose of the take")
    await connection.send('{"type":"control_player","paused":true}')
    await read_until(connection, updates, lambda p: p["player"]["paused"] is True, "paused")
    await connection.send('{"type":"control_player","position_s":1.0}')
    await read_until(connection, updates, lambda p: _position(p) == pytest.approx(1.0, abs=0.2), "at 1 s")
    await connection.send('{"type":"control_player","paused":false,"rate":4.0}')
    await read_until(connection, updates, lambda p: p["player"]["rate"] == 4.0 and _position(p) > 1.5, "continued, faster")
    await connection.send('{"type":"control_player","stop":true}')
    await read_until(connection, updates, lambda p: p["player"]["take"] == "", "stopped")
    assert updates["player"]["problem"] == ""
    await connection.send('{"type":"select_feed","feed":"live"}')


def _position(updates: Updates) -> float:
    return updates.get("player", {}).get("position_s", 0.0)


@pytest.mark.nightly
def test_a_second_animator_is_refused_and_a_port_in_use_is_reported(tmp_path: Path) -> None:
    port, other = free_ports(2)
    command, place = ["animator", rig_file(tmp_path, port), "--no-multicast-scouting"], free_endpoint()
    with started([*command, "-l", place], tmp_path) as first:
        wait_until(lambda: "the page is at" in output_of(tmp_path), tmp_path)
        for options, words in (
            (["-e", place, "--port", other], "animator main of rig demo is already running"),
            ([], f"animator.page: 127.0.0.1:{port} cannot be served"),
        ):
            status, text = run(tmp_path, *command, *options)
            assert status == 1
            assert words in text
        assert ended(first) == 0
    assert "Traceback" not in output_of(tmp_path)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--host", "0.0.0.0"], "animator.page.host = '0.0.0.0': allowed: an address of this machine only"),
        (["--token", "short"], "page: "),
    ],
)
def test_an_open_page_needs_a_token(options: list[str], words: str, tmp_path: Path) -> None:
    status, text = run(tmp_path, "animator", demo_rig_file("two-view"), *options)
    assert status == 1
    assert words in text
