"""The animator as a user runs it: beside a real rig, as a page's own client sees it, with a take of it played back."""

import asyncio
import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect

from common import messages as m
from common.runtime.rig import demo_rig_file
from common.take.reading import Take, envelope
from services.launcher.mesh import free_ports
from tests.test_system import PATIENCE_S, ROOT, ZENOCAP, recomputed_poses, said, started, until

pytestmark = pytest.mark.system
Pieces = dict[str, dict[str, object]]  # the last of each kind


def rig_file(folder: Path, port: int) -> Path:
    """The demo's rig with its page on another port."""
    source = demo_rig_file()
    text = source.read_text().replace("demo-calibration.toml", str(source.with_name("demo-calibration.toml")))
    path = folder / "rig.toml"
    path.write_text(f"{text}\n[animator.page]\nport = {port}\n")
    return path


async def seen(connection: ClientConnection, pieces: Pieces, what: Callable[[Pieces], bool], words: str) -> None:
    """Read until something is so."""

    async def read() -> None:
        while not what(pieces):
            for piece in json.loads(await connection.recv()):
                pieces[str(piece["is"])] = piece
            await connection.send('{"is":"got"}')

    try:
        await asyncio.wait_for(read(), PATIENCE_S)
    except TimeoutError:
        raise AssertionError(f"not seen: {words}; rows {pieces.get('rows')}, player {pieces.get('player')}") from None


async def page(port: int) -> ClientConnection:
    while True:
        try:
            return await connect(f"ws://127.0.0.1:{port}/socket", compression=None)
        except OSError:
            await asyncio.sleep(0.1)


def state_of(pieces: Pieces, service: str) -> str:
    rows = pieces.get("rows", {}).get("rows", [])
    assert isinstance(rows, list)
    return next((str(row["state"]) for row in rows if row["name"] == service), "")


def measured_anew(pieces: Pieces) -> bool:
    """The integrator looks for a body, or has another one already."""
    return "body" in pieces or "tracking" not in state_of(pieces, "integrator")


def test_a_page_sees_the_rig_asks_it_to_measure_and_to_record_and_plays_the_take(tmp_path: Path) -> None:
    (port,) = free_ports(1)

    async def visit() -> None:
        pieces: Pieces = {}
        async with await asyncio.wait_for(page(port), PATIENCE_S) as connection:
            await seen(connection, pieces, lambda p: "pose" in p and "view" in p, "a pose and a view")
            enough = int(str(pieces["pose"]["frame"])) + 40  # services say once a second what they were fed
            await seen(connection, pieces, lambda p: int(str(p["pose"]["frame"])) > enough, "more poses")
            pieces.pop("body", None)
            await connection.send('{"is":"ask","what":"measure"}')  # who still stands in the initial posture has it at once
            await seen(connection, pieces, measured_anew, "measuring anew")
            await connection.send('{"is":"ask","what":"stop_recording"}')
            await seen(connection, pieces, lambda p: p["rows"]["recording"] is False, "no take any more")
            await connection.send('{"is":"list"}')
            await seen(connection, pieces, lambda p: "takes" in p, "the list")
            takes = pieces["takes"]["takes"]
            assert isinstance(takes, list)
            assert len(takes) == 1
            await play(connection, pieces, str(takes[0][0]))
            await connection.send('{"is":"ask","what":"record"}')
            await seen(connection, pieces, lambda p: p["rows"]["recording"] is True, "another take")

    with started(["up", rig_file(tmp_path, port)], tmp_path) as process:
        asyncio.run(visit())
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0, said(tmp_path)
    text = said(tmp_path)
    assert f"http://127.0.0.1:{port}" in text
    assert "Traceback" not in text
    first, second = sorted((tmp_path / "recordings").glob("*.mcap"))
    assert requests_in(first) == ["measure", "stop_recording"]
    assert requests_in(second) == []  # it began with the request
    assert recomputed_poses(first) > 5


async def play(connection: ClientConnection, pieces: Pieces, take: str) -> None:
    """A take, with all that its buttons do."""
    pieces.clear()
    await connection.send('{"is":"watch","feed":"take"}')
    await connection.send(json.dumps({"is": "play", "take": take}))
    await seen(connection, pieces, lambda p: "pose" in p and _place(p) > 0, "a pose of the take")
    await connection.send('{"is":"control","paused":true}')
    await seen(connection, pieces, lambda p: p["player"]["paused"] is True, "paused")
    await connection.send('{"is":"control","place_s":1.0}')
    await seen(connection, pieces, lambda p: _place(p) == pytest.approx(1.0, abs=0.2), "at 1 s")
    await connection.send('{"is":"control","paused":false,"rate":4.0}')
    await seen(connection, pieces, lambda p: p["player"]["rate"] == 4.0 and _place(p) > 1.5, "going on, faster")
    await connection.send('{"is":"control","stop":true}')
    await seen(connection, pieces, lambda p: p["player"]["take"] == "", "stopped")
    assert pieces["player"]["problem"] == ""
    await connection.send('{"is":"watch","feed":"live"}')


def _place(pieces: Pieces) -> float:
    place = pieces.get("player", {}).get("place_s", 0.0)
    assert isinstance(place, float)
    return place


def requests_in(path: Path) -> list[str]:
    found = [received.message for one in Take(path).messages() if (received := envelope(one)) is not None]
    return [message.what for message in found if isinstance(message, m.Request)]


def test_a_second_animator_is_refused_and_a_page_that_cannot_be_served_is_said(tmp_path: Path) -> None:
    port, other, net = free_ports(3)
    rig = rig_file(tmp_path, port)
    first_net = ["--no-multicast-scouting", "-l", f"tcp/127.0.0.1:{net}"]
    with started(["animator", rig, *first_net], tmp_path) as first:
        until(lambda: "the page is at" in said(tmp_path), tmp_path)
        second_net = ["--no-multicast-scouting", "-e", f"tcp/127.0.0.1:{net}"]
        with started(["animator", rig, "--port", other, *second_net], tmp_path) as second:
            assert second.wait(PATIENCE_S) == 1
        assert "animator main of rig demo is already running" in said(tmp_path)
        with started(["animator", rig, "--no-multicast-scouting"], tmp_path) as third:
            assert third.wait(PATIENCE_S) == 1
        assert f"animator.page: 127.0.0.1:{port} cannot be served" in said(tmp_path)
        first.send_signal(signal.SIGTERM)
        assert first.wait(30) == 0
    assert "Traceback" not in said(tmp_path)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--host", "0.0.0.0"], "animator.page.host = '0.0.0.0': allowed: an address of this machine alone"),
        (["--token", "short"], "page: "),
    ],
)
def test_an_open_page_needs_a_token(options: list[str], words: str, tmp_path: Path) -> None:
    result = subprocess.run(
        [*ZENOCAP, "animator", str(demo_rig_file()), *options],
        capture_output=True, text=True, cwd=ROOT, timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert result.returncode == 1
    assert words in result.stderr
    assert "Traceback" not in result.stderr
