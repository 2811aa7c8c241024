"""Rigs that run once for all system tests which only read from them, and the takes that they leave."""

import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from tests.common.rig.test_security import demo_with
from tests.support.processes import (
    all_run,
    both_contribute,
    ended,
    last_line,
    output_of,
    shows,
    started,
    wait_for_frames,
    wait_until,
)
from zenocap.common import messages as m
from zenocap.common.bus.access import OPERATOR, REPLAY, Member
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports
from zenocap.common.rig.rig import Rig, demo_rig_file, load_rig
from zenocap.common.rig.security import needed_members, security_in
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import HEALTH, UNIVERSAL_BAP
from zenocap.tools.setup.certificates.folder import certify

START_S = 600.0  # time limit for a first pose, with kernels to be compiled before it (s)
TRACKED = 120  # frames of a take with the person tracked, 8 s
RING = demo_rig_file("two-view").with_name("ring.toml")
HOSTS = ("localhost", "127.0.0.1")


@dataclass
class SessionRig:
    """A rig that tracks.  file: of the rig.  folder: of its output and its take.  endpoint: where other programs connect.
    page: port of its page.  stop: signal that ends it.  processes: in the order in which they are to end."""

    file: Path
    folder: Path
    endpoint: str
    page: int
    stop: signal.Signals = signal.SIGINT
    processes: list[subprocess.Popen[str]] = field(default_factory=list)

    def end(self) -> Path:
        """End the rig, which must succeed; return its take."""
        for process in self.processes:
            if process.poll() is None:
                assert ended(process, self.stop) == 0, output_of(self.folder)
        (take,) = (self.folder / "recordings").glob("*.mcap")
        return take


@contextmanager
def two_view(folder: Path) -> Iterator[SessionRig]:
    """The two-view demo."""
    port, page = free_ports(2)
    rig = SessionRig(demo_rig_file("two-view"), folder, f"tcp/127.0.0.1:{port}", page)
    with _up(rig):
        wait_until(lambda: both_contribute(last_line(folder)) and all_run(folder), folder, START_S, rig.processes)
        wait_for_frames(folder, TRACKED)
        yield rig


@contextmanager
def ring(folder: Path) -> Iterator[SessionRig]:
    """Three cameras around a person, with the tracker and an output of datagrams that is not read."""
    port, page = free_ports(2)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        file = three_cameras(folder)
        file.write_text(f"{file.read_text()}\n[animator.udp]\nport = {listening.getsockname()[1]}\n")
        rig = SessionRig(file, folder, f"tcp/127.0.0.1:{port}", page)
        with _up(rig):
            wait_until(
                lambda: shows(folder, r"tracker: [\d.]+/s tracking ") and all_run(folder), folder, START_S, rig.processes
            )
            wait_for_frames(folder, TRACKED)
            yield rig


@contextmanager
def _up(rig: SessionRig) -> Iterator[None]:
    options = ["--listen", rig.endpoint, "--port", rig.page, "--recordings", rig.folder / "recordings"]
    with started(["up", rig.file, *options], rig.folder) as process:
        rig.processes.append(process)
        yield


@contextmanager
def secured(folder: Path) -> Iterator[SessionRig]:
    """The services of the two-view demo, each started by itself, around a router with certificates."""
    file, page = secured_rig_file(folder), free_ports(1)[0]
    rig = SessionRig(file, folder, load_rig(file).zenoh.connect[0], page, signal.SIGTERM)
    (folder / "recordings").mkdir()
    lines: list[list[object]] = [
        ["viewer", file, "--id", "1"], ["viewer", file, "--id", "2"], ["recognizer", file],
        ["animator", file, "--port", page], ["integrator", file, "-o", folder / "recordings" / "take.mcap"],
        ["router", file, "-l", rig.endpoint, "--no-multicast-scouting"],
    ]  # fmt: skip
    with ExitStack() as stack:
        rig.processes += [stack.enter_context(started(line, folder)) for line in lines]
        with ZenohBus.open(member(file, rig.endpoint, "reader"), "demo", RealClock()) as bus:
            bus.subscribe(UNIVERSAL_BAP)
            bus.subscribe(HEALTH)
            whole: list[m.UniversalBap] = []
            running: set[tuple[str, str]] = set()

            def tracked() -> bool:
                match bus.receive(0.2):
                    case Envelope(message=m.UniversalBap(stale=[]) as pose):
                        whole.append(pose)
                    case Envelope(message=m.Health(service=service, id=id)):
                        running.add((service, id))
                return len(whole) >= 30 and len(running) == len(lines) - 1  # all but the router

            wait_until(tracked, folder, START_S, rig.processes)
        yield rig


def three_cameras(folder: Path) -> Path:
    """The ring rig with its first three viewers."""
    head, *viewers = RING.read_text().split("[[viewer]]")
    calibration = RING.with_name("ring-calibration.toml")
    (folder / calibration.name).write_text(calibration.read_text())
    (folder / "ring.toml").write_text("[[viewer]]".join([head, *viewers[:3]]))
    return folder / "ring.toml"


def secured_rig_file(folder: Path) -> Path:
    """A secured two-view rig whose router is on a free port, with its authority and certificates beside it."""
    (port,) = free_ports(1)
    table = f'mode = "client"\nconnect = ["tls/127.0.0.1:{port}"]\nmulticast_scouting = false\n'
    path = demo_with(folder, f"\n[security]\n\n[zenoh]\n{table}")
    certificates(folder / "certs", load_rig(path))
    return path


def certificates(folder: Path, rig: Rig) -> None:
    members = {member: HOSTS for member in (*needed_members(rig), Member(REPLAY), Member(OPERATOR))}
    certify(folder, rig.name, members, datetime.now(UTC), 60)


def member(rig_file: Path, endpoint: str, name: str, folder: str = "certs") -> ZenohOptions:
    """Options of a member of a secured rig.  folder: of its certificates, beside the rig file."""
    security = security_in(rig_file.parent / folder, name)
    return ZenohOptions("client", (endpoint,), multicast_scouting=False, security=security)
