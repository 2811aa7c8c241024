"""Timing of `zenocap replay`: deviation from recorded intervals, processor time, and speed with live services.

    python -m benchmarks.replay_timing [TAKE] [--seconds N] [--rates 1 4] [--runs N]

The player is a separate process; this process subscribes and compares the interval between consecutive messages with the
recorded one.  Without TAKE the demo is recorded first.  Then the take is played at rate 0, in place of the viewers, to a
live integrator: speed relative to real time, and lost messages.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import time
from collections import defaultdict, deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.table import Cell, table
from zenocap.common.arrays import Ints
from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.messages import Health, UniversalBap
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import HEALTH, TOPICS, UNIVERSAL_BAP
from zenocap.tools.launcher.peer_mesh import Peer, free_ports, peer_mesh
from zenocap.tools.replay.selection import ReplaySelection

ZENOCAP = (sys.executable, "-m", "zenocap")
RIG = "demo"

EVERYTHING = ReplaySelection()  # the default of the command: without messages that only verification needs


def main(take: Path, seconds: float, rates: Sequence[float], runs: int) -> None:
    sys.setswitchinterval(0.0005)  # threads that take arrival times must not wait for decoding
    rows: list[list[Cell]] = []
    for rate in rates:
        for run in range(runs):
            rows.append([f"rate {rate:g}, run {run + 1}", *timing(take, seconds, rate)])
    columns = ["deviation of intervals, ms", "p50", "p99", "max", "messages", "not received", "bytes differ", "CPU %"]
    print(table(f"Replay of {seconds:g} s of a take, received by another process", columns, rows))
    rows = [[f"run {run + 1}", *lockstep(take, seconds)] for run in range(runs)]
    columns = [
        "rate 0, a live integrator",
        "x real time",
        "poses",
        "of recorded",
        "superseded",
        "p50 deg",
        "max deg",
        "equal",
    ]
    print(table("As fast as a live integrator keeps up, fed in place of the viewers", columns, rows))


def timing(take: Path, seconds: float, rate: float) -> list[Cell]:
    """p50, p99, maximum of |received interval - recorded interval| (ms), messages, lost, changed, processor share (%)."""
    own, other = peer_mesh(free_ports(2))
    arrivals: list[tuple[str, int, bytes]] = []
    before_s = cpu_s = 0.0
    with listening_bus(own) as bus:
        for topic in TOPICS:
            bus.subscribe(topic, every=True)
        arguments = ["--rate", str(rate), "--until", f"{seconds}s", *network(other)]
        with player(take, arguments) as process:
            while process.poll() is None:
                arrivals += received(bus)
                before_s = before_s or (cpu_seconds(process.pid) if arrivals else 0.0)
                cpu_s = cpu_seconds(process.pid) or cpu_s
        time.sleep(0.2)
        arrivals += received(bus)
    recorded = messages(take, seconds)
    log_ns: defaultdict[tuple[str, bytes], deque[int]] = defaultdict(deque)  # equal bytes may occur more than once
    for key, at_ns, data in recorded:
        log_ns[key, data].append(at_ns)
    arrivals.sort(key=lambda one: one[1])
    matched = [(at_ns, log_ns[key, data].popleft()) for key, at_ns, data in arrivals if log_ns[key, data]]
    found: Ints = np.array(matched, dtype=np.int64)
    deviations = np.abs(np.diff(found[:, 0]) - np.diff(found[:, 1]) / rate) / 1e6
    p50, p99 = np.percentile(deviations, [50, 99])
    return [
        f"{p50:.3f}", f"{p99:.3f}", f"{deviations.max():.3f}", len(recorded), len(recorded) - len(arrivals),
        len(arrivals) - len(matched), f"{100 * (cpu_s - before_s) * rate / seconds:.1f}",
    ]  # fmt: skip


def lockstep(take: Path, seconds: float) -> list[Cell]:
    """Speed, poses of the live integrator and of the take, superseded messages, and the difference of their poses."""
    own, live, other = peer_mesh(free_ports(3))
    poses: dict[int, UniversalBap] = {}
    superseded = -1
    command = [*ZENOCAP, "integrator", str(demo_rig_file("two-view")), "--no-log", *network(live)]
    with listening_bus(own) as bus:
        bus.subscribe(UNIVERSAL_BAP, every=True)
        bus.subscribe(HEALTH, service="integrator")
        bus.watch_alive()
        integrator = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        try:
            await_service(bus, "integrator")
            arguments = ["--rate", "0", "--until", f"{seconds}s", "--topics", "viewer/**", *network(other)]
            with player(take, arguments) as process:
                out = process.communicate()[0]
            end_s = time.monotonic() + 2.5
            while time.monotonic() < end_s:
                match bus.receive(0.1):
                    case Envelope(message=UniversalBap() as pose):
                        poses[pose.captured_ns] = pose
                    case Envelope(message=Health() as health):
                        superseded = health.counts.get("dropped_superseded", 0)
        finally:
            integrator.terminate()
            integrator.wait(10)
    summary = re.search(r"messages in ([\d.]+) s", out)
    elapsed_s = float(summary[1]) if summary else float("nan")
    recorded = poses_of(take, seconds)
    both = [(poses[at_ns], pose) for at_ns, pose in recorded.items() if at_ns in poses]
    if not both:
        raise SystemExit(f"{take}: no pose within its first {seconds:g} s was published again: --seconds is too short")
    differences = np.degrees([max(abs(a.angles[n] - b.angles[n]) for n in b.angles) for a, b in both])
    equal = sum(a == b for a, b in both)
    return [
        f"{seconds / elapsed_s:.1f}", len(poses), len(recorded), superseded,
        f"{np.median(differences):.4f}", f"{differences.max():.2f}", equal,
    ]  # fmt: skip


@contextmanager
def listening_bus(place: Peer) -> Iterator[ZenohBus]:
    options = ZenohOptions("peer", place.connect, (place.listen,), multicast_scouting=False)
    with ZenohBus.open(options, RIG, RealClock()) as bus:
        yield bus


@contextmanager
def player(take: Path, arguments: Sequence[str]) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [*ZENOCAP, "replay", str(take), *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            process.wait(10)


def network(place: Peer) -> list[str]:
    arguments = ["--no-multicast-scouting", "--listen", place.listen]
    for endpoint in place.connect:
        arguments += ["--connect", endpoint]
    return arguments


def received(bus: ZenohBus) -> list[tuple[str, int, bytes]]:
    """Key, time of arrival and bytes of all queued messages; waits briefly for the first."""
    found, event = [], bus.receive(0.2)
    while event is not None:
        if isinstance(event, Envelope):
            found.append((event.key, event.received_ns, event.data))
        event = bus.receive(0.0)
    return found


def await_service(bus: ZenohBus, name: str) -> None:
    end_s = time.monotonic() + 60
    while time.monotonic() < end_s:
        match bus.receive(0.2):
            case Alive(service=service, alive=True) if service == name:
                return
    raise RuntimeError(f"no {name} within a minute")


def messages(take: Path, seconds: float) -> list[tuple[str, int, bytes]]:
    """Key, log_time and bytes of the take's first seconds."""
    replayed = (r for r in Take(take).messages() if r.encoding == "msgpack" and EVERYTHING.takes(r.topic))
    found = [(r.topic, r.log_ns, r.data) for r in replayed]
    return [item for item in found if item[1] < found[0][1] + seconds * 1e9]


def poses_of(take: Path, seconds: float) -> dict[int, UniversalBap]:
    found: dict[int, UniversalBap] = {}
    start_ns = 0
    for recorded in Take(take).messages():
        start_ns = start_ns or recorded.log_ns
        if recorded.log_ns < start_ns + seconds * 1e9:
            received = envelope(recorded)
            if received is not None and isinstance(received.message, UniversalBap):
                found[received.message.captured_ns] = received.message
    return found


def cpu_seconds(pid: int) -> float:
    """User and system time (s) of a process; 0 when it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / 100


def recorded_demo(folder: Path, seconds: float) -> Path:
    arguments = ["demo", "--method", "two-view", "--seconds", str(seconds + 12), "--recordings", str(folder)]
    subprocess.run([*ZENOCAP, *arguments], check=True, stdout=subprocess.DEVNULL)
    return next(folder.glob("demo-*.mcap"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("take", type=Path, nargs="?")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rates", type=float, nargs="*", default=[1.0, 4.0])
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        path = options.take or recorded_demo(Path(temporary), options.seconds)
        main(path, options.seconds, options.rates, options.runs)
