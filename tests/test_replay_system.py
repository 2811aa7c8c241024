"""`zenocap replay` as a user runs it: real processes, a real Zenoh mesh, a real integrator, a real terminal."""

import os
import pty
import select
import signal
import subprocess
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from common import messages as m
from common.bus.protocol import Alive, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime.clock import RealClock
from common.runtime.rig import demo_rig_file
from common.take.reading import Take
from common.topics import HEALTH, PARTIAL_BDP, TOPICS, UNIVERSAL_BAP
from services.launcher.mesh import Place, free_ports, mesh
from tests.replay_takes import RIG, spoken, written
from tests.test_system import ENVIRONMENT, ZENOCAP, poses_in, said, started, until

pytestmark = pytest.mark.system


def said_by_viewers(take: Path) -> list[bytes]:
    """Everything of the viewers that is replayed: what they say of their own steps is not."""
    return sorted(
        each.data
        for each in Take(take).messages()
        if each.topic.startswith("zenocap/") and "/viewer/" in each.topic and not each.topic.endswith("/handled")
    )


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return written(tmp_path / "take.mcap", spoken(200), flush_every=100)


def options(place: Place) -> ZenohOptions:
    return ZenohOptions("peer", place.connect, (place.listen,), multicast_scouting=False)


def network(place: Place) -> list[object]:
    found: list[object] = ["--no-multicast-scouting", "--listen", place.listen]
    for endpoint in place.connect:
        found += ["--connect", endpoint]
    return found


def received(bus: ZenohBus, wait_s: float) -> Iterator[Envelope]:
    """Messages until none comes for `wait_s`."""
    while (event := bus.receive(wait_s)) is not None:
        if isinstance(event, Envelope):
            yield event


def test_a_listener_gets_every_byte(take: Path, tmp_path: Path) -> None:
    here, there = mesh(free_ports(2))
    heard: list[Envelope] = []
    with ZenohBus.open(options(here), "lab", RealClock()) as bus:
        for topic in TOPICS:
            bus.subscribe(topic, every=True)
        bus.watch_alive()
        with started(["replay", take, "--rig", "lab", "--rate", "2", *network(there)], tmp_path) as player:
            while player.poll() is None:
                heard += received(bus, 0.2)
        heard += received(bus, 0.5)
    assert player.returncode == 0, said(tmp_path)
    recorded = spoken(200)
    assert sorted((each.key, each.data) for each in heard) == sorted(
        (each.key.replace(f"/{RIG}/", "/lab/"), each.data) for each in recorded
    )
    assert f"rig lab: {len(recorded)} messages" in said(tmp_path)
    assert "Traceback" not in said(tmp_path)


def test_who_comes_late_gets_the_state_and_sees_the_services(take: Path, tmp_path: Path) -> None:
    here, there = mesh(free_ports(2))
    with started(["replay", take, "--loop", *network(there)], tmp_path) as player:
        until(lambda: "standing in for" in said(tmp_path), tmp_path)
        time.sleep(2.0)
        with ZenohBus.open(options(here), RIG, RealClock()) as bus:
            bus.subscribe(PARTIAL_BDP)
            bus.watch_alive()
            found, alive = set(), set()
            end_s = time.monotonic() + 10
            while len(found) < 2 or len(alive) < 3:
                assert time.monotonic() < end_s, (found, alive)
                match bus.receive(0.1):
                    case Envelope(message=m.PartialBdp(viewer=viewer)):
                        found.add(viewer)
                    case Alive(service=service, id=id, alive=True):
                        alive.add((service, id))
        assert alive == {("integrator", "main"), ("viewer", "1"), ("viewer", "2")}
        player.send_signal(signal.SIGINT)
        assert player.wait(10) == 0
    assert "Traceback" not in said(tmp_path)


def test_a_replay_of_a_running_service_is_refused_in_one_line(take: Path, tmp_path: Path) -> None:
    here, there = mesh(free_ports(2))
    with ZenohBus.open(options(here), RIG, RealClock()) as bus:
        bus.declare_alive("integrator", "main")
        bus.subscribe(UNIVERSAL_BAP)
        with started(["replay", take, *network(there)], tmp_path) as player:
            assert player.wait(30) == 1
        (line,) = [line for line in said(tmp_path).splitlines() if "error" in line]
        assert line.startswith("error: integrator main of rig demo is already running")
        assert "--topics 'viewer/**'" in line
        assert "--rig NAME" in line
        assert list(received(bus, 0.1)) == []
        with started(["replay", take, "--topics", "viewer/**", "--duration", "0.2", *network(there)], tmp_path) as player:
            assert player.wait(30) == 0, said(tmp_path)


def test_a_cut_take_is_played_as_far_as_it_goes(take: Path, tmp_path: Path) -> None:
    data = take.read_bytes()
    take.write_bytes(data[: len(data) // 2])
    (there,) = mesh(free_ports(1))
    with started(["replay", take, "--rate", "0", *network(there)], tmp_path) as player:
        assert player.wait(30) == 3
    assert "cut before its end" in said(tmp_path)
    assert "Traceback" not in said(tmp_path)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A take of the demo: the initial posture and some seconds of walking."""
    folder = tmp_path_factory.mktemp("demo")
    with started(["demo", "--seconds", "14"], folder) as demo:
        assert demo.wait(120) == 0, said(folder)
    (take,) = (folder / "recordings").glob("demo-*.mcap")
    return take


def test_a_live_integrator_finds_the_recorded_poses_without_losing_a_message(recorded: Path, tmp_path: Path) -> None:
    here, live, there = mesh(free_ports(3))
    log = tmp_path / "again.mcap"
    superseded: list[int] = []
    with (
        ZenohBus.open(options(here), RIG, RealClock()) as bus,
        started(["integrator", demo_rig_file(), "-o", log, *network(live)], tmp_path) as integrator,
    ):
        bus.watch_alive()
        bus.subscribe(HEALTH, service="integrator")
        until(lambda: isinstance(bus.receive(0.1), Alive), tmp_path)
        arguments = ["replay", recorded, "--rate", "0", "--topics", "viewer/**", *network(there)]
        with started(arguments, tmp_path) as player:
            assert player.wait(60) == 0, said(tmp_path)
        time.sleep(1.2)  # its next health
        for each in received(bus, 0.0):
            if isinstance(each.message, m.Health):
                superseded.append(each.message.counts.get("dropped_superseded", 0))
        integrator.send_signal(signal.SIGTERM)
        assert integrator.wait(30) == 0, said(tmp_path)
    assert superseded[-1] == 0
    assert "live: integrator main" in said(tmp_path)
    before, again = poses_in(recorded), poses_in(log)
    assert len(before) > 20
    # Where the recorded integrator has lost a message to a newer one, or heard two in another order, poses differ.
    equal = sum(one in again for one in before)
    assert len(again) >= len(before)
    assert equal > 0.9 * len(before)
    assert said_by_viewers(log) == said_by_viewers(recorded)


def test_keys_of_a_real_terminal(take: Path, tmp_path: Path) -> None:
    theirs, ours = pty.openpty()
    before = termios.tcgetattr(ours)
    heard = ""

    def own_terminal() -> None:
        import fcntl

        fcntl.ioctl(ours, termios.TIOCSCTTY, 0)

    (there,) = mesh(free_ports(1))
    arguments = [*ZENOCAP, "replay", str(take), "--pause", "--delay", "0.1", *map(str, network(there))]
    process = subprocess.Popen(
        arguments, stdin=ours, stdout=ours, stderr=ours, cwd=tmp_path, start_new_session=True, preexec_fn=own_terminal,
        env=ENVIRONMENT | {"TERM": "xterm", "COLUMNS": "200"},
    )  # fmt: skip

    def see(text: str) -> None:
        nonlocal heard
        end_s = time.monotonic() + 30
        while text not in heard:
            assert time.monotonic() < end_s, heard
            if select.select([theirs], [], [], 0.1)[0]:
                heard += os.read(theirs, 4096).decode()

    try:
        see("paused")
        os.write(theirs, b".")
        see(" 5 messages")
        os.write(theirs, b"+")
        see("rate 2")
        os.write(theirs, b" ")
        see("playing")
        os.write(theirs, b"q")
        see("rig demo: ")
        assert process.wait(10) == 0
        assert termios.tcgetattr(ours) == before
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        os.close(theirs)
        os.close(ours)
