"""Timing of `zenocap replay`: deviation from recorded intervals, processor time, and speed with a live integrator.

The player is a separate process; this process subscribes and compares the interval between consecutive messages with the
recorded one.
"""

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

from benchmarks.harness.case import Case, Column, Figures, Kind, case
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
from zenocap.tools.replay.selection import Selection

ZENOCAP = (sys.executable, "-m", "zenocap")
RIG = "demo"

EVERYTHING = Selection()  # the default of the command: without messages that only verification needs


def run(one: Case) -> Figures:
    """Replay of a recorded demo.  Options: rate, 0 as fast as a live integrator keeps up; seconds."""
    sys.setswitchinterval(0.0005)  # threads that take arrival times must not wait for decoding
    seconds, rate = one.option("seconds", 60.0), one.option("rate", 1.0)
    with tempfile.TemporaryDirectory() as folder:
        take = recorded_demo(Path(folder), seconds)
        return timing(take, seconds, rate) if rate else lockstep(take, seconds)


def timing(take: Path, seconds: float, rate: float) -> dict[str, float]:
    """Deviation of the received intervals from the recorded ones, losses and processor time."""
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
    return {
        "median": float(p50),
        "p99": float(p99),
        "worst": float(deviations.max()),
        "lost": len(recorded) - len(arrivals),
        "changed": len(arrivals) - len(matched),
        "processor": 100 * (cpu_s - before_s) * rate / seconds,
    }


def lockstep(take: Path, seconds: float) -> dict[str, float]:
    """Speed of a live integrator that is fed in place of the viewers, and its poses that equal those of the take."""
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
        raise RuntimeError(f"{take}: no pose within its first {seconds:g} s was published again")
    return {
        "speed": seconds / elapsed_s,
        "lost": superseded,
        "poses": len(recorded),
        "equal poses": sum(a == b for a, b in both),
    }


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


REPLAY = Kind(
    "replay",
    "Replay of 60 s of the demo: deviation of the intervals in another process from the recorded ones; at rate 0 a live "
    "integrator is fed in place of the viewers, as fast as it keeps up.",
    run,
    (
        *(Column(name, "ms", 1, joined="median") for name in ("median", "p99", "worst")),
        *(Column(name, "messages", 0, joined="sum") for name in ("lost", "changed")),
        Column("processor", "%", 1),
        Column("speed", "× real time", 1, "low"),
        *(Column(name, "", 0, joined="sum") for name in ("poses", "equal poses")),
    ),
    {f"rate {rate:g}": case("demo", rate=rate) for rate in (1.0, 4.0, 0.0)},
    case("demo", seconds=12.0),
    rows="rate",
    timed=True,
)
