"""The whole system as a user runs it: real processes, a real Zenoh mesh, the synthetic actor."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from common import messages as m
from common.bus.protocol import Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime.clock import RealClock
from common.runtime.rig import demo_rig_file
from common.take.reading import Take, envelope
from common.topics import UNIVERSAL_BAP
from services.launcher.mesh import free_ports, mesh
from services.takes.verify.recompute import verify

pytestmark = pytest.mark.system
ROOT = Path(__file__).resolve().parents[1]
PATIENCE_S = 90.0
ZENOCAP = (sys.executable, "-P", "-m", "services.cli")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}


@contextmanager
def started(arguments: Sequence[object], folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A `zenocap` process whose output goes to out.txt and err.txt; it is killed if it is still there at the end."""
    name = "-".join(str(argument) for argument in arguments[:1]) + str(time.monotonic_ns())
    with (folder / f"{name}.out").open("w") as out, (folder / f"{name}.err").open("w") as err:
        process = subprocess.Popen(
            [*ZENOCAP, *map(str, arguments)], cwd=folder, env=ENVIRONMENT, stdout=out, stderr=err, text=True
        )
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()


def said(folder: Path) -> str:
    """Everything that processes have written."""
    return "\n".join(path.read_text() for path in sorted(folder.glob("*.out")) + sorted(folder.glob("*.err")))


def until(what: Callable[[], bool], folder: Path, patience_s: float = PATIENCE_S) -> None:
    end_s = time.monotonic() + patience_s
    while not what():
        assert time.monotonic() < end_s, said(folder)
        time.sleep(0.05)


def poses_in(take: Path) -> list[m.UniversalBap]:
    read = Take(take)
    found = [
        received.message
        for recorded in read.messages()
        if (received := envelope(recorded)) is not None and isinstance(received.message, m.UniversalBap)
    ]
    assert read.cut is None
    return found


def recomputed_poses(take: Path) -> int:
    """How many poses of a live take come out of the pure steps again; whatever they say must be what was logged."""
    found = verify([take])
    assert found.first is None, found.first
    return found.equal[UNIVERSAL_BAP.at("demo")]


def children_of(pid: int) -> dict[int, str]:
    """Command lines of the living children of a process, by process id."""
    found = {}
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        try:
            found[int(child)] = Path(f"/proc/{child}/cmdline").read_text().replace("\0", " ")
        except OSError:
            continue  # it ended meanwhile
    return found


def last_line(folder: Path) -> str:
    """The last whole line that the demo has printed."""
    (path,) = folder.glob("demo*.out")
    lines = [line for line in path.read_text().splitlines(keepends=True) if line.endswith("\n")]
    return lines[-1] if lines else ""


def joined(line: str) -> bool:
    """Whether a line of the display says that both viewers take part in the pose."""
    return line.count("tracking") == 3 and "frame" in line and "without" not in line


def test_the_demo_runs_by_itself_and_leaves_a_take(tmp_path: Path) -> None:
    with started(["demo", "--seconds", "14"], tmp_path) as demo:
        assert demo.wait(PATIENCE_S) == 0, said(tmp_path)
    (take,) = (tmp_path / "recordings").glob("demo-*.mcap")
    poses = poses_in(take)
    assert len(poses) > 20
    whole = [pose for pose in poses if set(pose.scores) == {"1", "2"} and not pose.stale]
    assert len(whole) > len(poses) / 2
    assert recomputed_poses(take) == len(poses)
    text = said(tmp_path)
    assert str(take.relative_to(tmp_path)) in text
    assert ", 0 lost" in text
    assert "first pose" in text
    assert "viewer 1: 1" in text  # frames per second
    assert "Traceback" not in text


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds children in /proc")
def test_a_killed_viewer_comes_back_and_joins(tmp_path: Path) -> None:
    with started(["demo"], tmp_path) as demo:
        until(lambda: re.search(r"viewer 2: [\d.]+/s (flank|facade)", said(tmp_path)) is not None, tmp_path)
        victims = [pid for pid, line in children_of(demo.pid).items() if "viewer" in line and "--id 2" in line]
        assert len(victims) == 1
        os.kill(victims[0], signal.SIGKILL)
        until(lambda: "viewer 2: started again" in said(tmp_path), tmp_path)
        until(lambda: "without viewer 2" in said(tmp_path), tmp_path)
        until(lambda: joined(last_line(tmp_path)), tmp_path)
        children = children_of(demo.pid)
        demo.send_signal(signal.SIGINT)
        assert demo.wait(30) == 0, said(tmp_path)
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
    (take,) = (tmp_path / "recordings").glob("demo-*.mcap")
    stale = [bool(pose.stale) for pose in poses_in(take)]
    assert True in stale
    assert not stale[-1]
    assert recomputed_poses(take) == len(stale)
    assert "died (SIGKILL); starting it again" in said(tmp_path)


@pytest.mark.parametrize(
    "order", [("integrator", "1", "2"), ("1", "integrator", "2"), ("2", "1", "integrator")], ids="-".join
)
def test_services_start_in_any_order(order: tuple[str, ...], tmp_path: Path) -> None:
    """Three terminals; each starts when the one before is up."""
    places = dict(zip(("integrator", "1", "2", "here"), mesh(free_ports(4)), strict=True))
    rig, take = demo_rig_file(), tmp_path / "take.mcap"

    def arguments(name: str) -> list[object]:
        network: list[object] = ["--no-multicast-scouting", "--listen", places[name].listen]
        for endpoint in places[name].connect:
            network += ["--connect", endpoint]
        role: list[object] = ["integrator", rig, "-o", take] if name == "integrator" else ["viewer", rig, "--id", name]
        return [*role, *network]

    here = ZenohOptions("peer", places["here"].connect, (places["here"].listen,), multicast_scouting=False)
    processes: list[subprocess.Popen[str]] = []
    with (
        ZenohBus.open(here, "demo", RealClock()) as bus,
        started(arguments(order[0]), tmp_path) as one,
        _after(1.0, arguments(order[1]), tmp_path) as two,
        _after(1.0, arguments(order[2]), tmp_path) as three,
    ):
        processes += [one, two, three]
        bus.subscribe(UNIVERSAL_BAP)
        whole = 0
        end_s = time.monotonic() + PATIENCE_S
        while whole < 20:
            assert time.monotonic() < end_s, said(tmp_path)
            match bus.receive(0.2):
                case Envelope(message=m.UniversalBap(stale=[])):
                    whole += 1
        for process in processes:
            process.send_signal(signal.SIGTERM)
        assert [process.wait(30) for process in processes] == [0, 0, 0], said(tmp_path)
    assert len(poses_in(take)) >= 20
    assert recomputed_poses(take) >= 20
    assert "Traceback" not in said(tmp_path)


def test_two_viewers_with_one_id_are_refused(tmp_path: Path) -> None:
    place, other = mesh(free_ports(2))
    arguments = ["viewer", demo_rig_file(), "--id", "1", "--epoch-ns", time.time_ns(), "--no-multicast-scouting"]
    with started([*arguments, "-l", place.listen], tmp_path) as one:
        until(lambda: one.poll() is not None or _listens(place.listen), tmp_path)
        with started([*arguments, "-l", other.listen, "-e", place.listen], tmp_path) as two:
            assert two.wait(PATIENCE_S) == 1
        assert "viewer 1 of rig demo is already running" in said(tmp_path)
        one.send_signal(signal.SIGTERM)
        assert one.wait(30) == 0


def test_a_video_that_cannot_be_played_ends_the_rig_with_its_reason(tmp_path: Path) -> None:
    text = (
        demo_rig_file()
        .read_text()
        .replace("demo-calibration.toml", str(demo_rig_file().with_name("demo-calibration.toml")))
    )
    (tmp_path / "cam.mp4").write_bytes(b"this is no video")
    head, mark, tail = text.rpartition('source = "actor:demo"')
    (tmp_path / "rig.toml").write_text(head + 'source = "cam.mp4"' + tail)
    assert mark
    with started(["up", "rig.toml", "--seconds", "60"], tmp_path) as process:
        assert process.wait(PATIENCE_S) == 1
    text = said(tmp_path)
    assert "cam.mp4: not a video that can be decoded" in text
    assert "Traceback" not in text


@contextmanager
def _after(seconds: float, arguments: Sequence[object], folder: Path) -> Iterator[subprocess.Popen[str]]:
    time.sleep(seconds)
    with started(arguments, folder) as process:
        yield process


def _listens(endpoint: str) -> bool:
    host, _, port = endpoint.removeprefix("tcp/").rpartition(":")
    with socket.socket() as probe:
        return probe.connect_ex((host, int(port))) == 0
