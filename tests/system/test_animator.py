"""Animator as a user runs it: real rig, page client, playback of the recorded take."""

import asyncio
import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect

from tests.support.places import ROOT
from tests.support.processes import PATIENCE_S, ZENOCAP, ended, output_of, recomputed_poses, started, wait_until
from tests.support.session_rigs import SessionRig
from zenocap.common import messages as m
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.rig.rig import demo_rig_file
from zenocap.tools.record.launcher.peer_mesh import free_ports

Updates = dict[str, dict[str, object]]  # the last of each type


def rig_file(folder: Path, port: int, method: str = "two-view") -> Path:
    """Write the demo rig of a method with its page on another port."""
    source = demo_rig_file(method)
    text = source.read_text().replace("demo-calibration.toml", str(source.with_name("demo-calibration.toml")))
    path = folder / "rig.toml"
    path.write_text(f"{text}\n[animator.page]\nport = {port}\n")
    return path


async def read_until(
    connection: ClientConnection, updates: Updates, condition: Callable[[Updates], bool], text: str
) -> None:
    """Read updates until a condition holds."""

    async def read() -> None:
        while not condition(updates):
            for update in json.loads(await connection.recv()):
                updates[str(update["type"])] = update
            await connection.send('{"type":"acknowledge"}')

    try:
        await asyncio.wait_for(read(), PATIENCE_S)
    except TimeoutError:
        raise AssertionError(f"not seen: {text}; services {updates.get('rows')}, player {updates.get('player')}") from None


async def page(port: int) -> ClientConnection:
    while True:
        try:
            return await connect(f"ws://127.0.0.1:{port}/socket", compression=None)
        except OSError:
            await asyncio.sleep(0.1)


def phase_of(updates: Updates, service: str) -> str:
    rows = updates.get("services", {}).get("services", [])
    assert isinstance(rows, list)
    return next((str(row["phase"]) for row in rows if row["name"] == service), "")


def measuring_again(updates: Updates) -> bool:
    """Whether the integrator is measuring a body, or has measured another one."""
    return "body" in updates or phase_of(updates, "integrator") != "tracking"


@pytest.mark.core
def test_a_page_shows_a_running_rig(two_view_rig: SessionRig) -> None:
    async def visit() -> None:
        updates: Updates = {}
        async with await asyncio.wait_for(page(two_view_rig.page), PATIENCE_S) as connection:
            await read_until(connection, updates, lambda p: {"pose", "view", "services"} <= p.keys(), "a pose and a view")
            await read_until(connection, updates, lambda p: phase_of(p, "integrator") == "tracking", "tracking")
            assert updates["services"]["recording"] is True

    asyncio.run(visit())


@pytest.mark.nightly
def test_a_page_shows_the_rig_requests_measuring_and_recording_and_plays_the_take(tmp_path: Path) -> None:
    (port,) = free_ports(1)

    async def visit() -> None:
        updates: Updates = {}
        async with await asyncio.wait_for(page(port), PATIENCE_S) as connection:
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
            takes = updates["takes"]["takes"]
            assert isinstance(takes, list)
            assert len(takes) == 1
            await play(connection, updates, str(takes[0][0]))
            await connection.send('{"type":"request","what":"record"}')
            await read_until(connection, updates, lambda p: p["services"]["recording"] is True, "another take")

    with started(["up", rig_file(tmp_path, port)], tmp_path) as process:
        asyncio.run(visit())
        assert ended(process, signal.SIGINT) == 0, output_of(tmp_path)
    text = output_of(tmp_path)
    assert f"http://127.0.0.1:{port}" in text
    assert "Traceback" not in text
    first, second = sorted((tmp_path / "recordings").glob("*.mcap"))
    assert requests_in(first) == ["measure", "stop_recording"]
    assert requests_in(second) == []  # it starts after the request
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
    place = updates.get("player", {}).get("position_s", 0.0)
    assert isinstance(place, float)
    return place


def requests_in(path: Path) -> list[str]:
    found = [received.message for one in TakeReader(path).messages() if (received := envelope(one)) is not None]
    return [message.what for message in found if isinstance(message, m.Request)]


@pytest.mark.nightly
def test_a_second_animator_is_refused_and_a_port_in_use_is_reported(tmp_path: Path) -> None:
    port, other, net = free_ports(3)
    rig = rig_file(tmp_path, port)
    first_net = ["--no-multicast-scouting", "-l", f"tcp/127.0.0.1:{net}"]
    with started(["animator", rig, *first_net], tmp_path) as first:
        wait_until(lambda: "the page is at" in output_of(tmp_path), tmp_path)
        second_net = ["--no-multicast-scouting", "-e", f"tcp/127.0.0.1:{net}"]
        with started(["animator", rig, "--port", other, *second_net], tmp_path) as second:
            assert second.wait(PATIENCE_S) == 1
        assert "animator main of rig demo is already running" in output_of(tmp_path)
        with started(["animator", rig, "--no-multicast-scouting"], tmp_path) as third:
            assert third.wait(PATIENCE_S) == 1
        assert f"animator.page: 127.0.0.1:{port} cannot be served" in output_of(tmp_path)
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
    result = subprocess.run(
        [*ZENOCAP, "animator", str(demo_rig_file("two-view")), *options],
        capture_output=True, text=True, cwd=ROOT, timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert result.returncode == 1
    assert words in result.stderr
    assert "Traceback" not in result.stderr
