"""Services at the limit of their memory or of their open files: ends are named, the others go on."""

import os
import re
import resource
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest
import zenoh
from msgspec import structs

from benchmarks.chaos.stated import wrong_statement
from benchmarks.chaos.takes import POSES, content
from tests.common.rig.test_hosted import rig as hosted_studio
from tests.support.demo_rigs import written_demo
from tests.support.hostile import HUGE_BYTES
from tests.support.mjpeg_server import MjpegServer
from tests.support.networks import client, free_endpoint
from tests.support.processes import (
    PATIENCE_S,
    all_run,
    children_of,
    ended,
    output_of,
    service_pids,
    shows,
    started,
    wait_for_frames,
    wait_until,
)
from tests.system.test_no_log import observed
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import configuration, free_ports
from zenocap.common.rig.hosted import assignment
from zenocap.common.rig.sources import most_first
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.signals import HANGS_S
from zenocap.common.topics import CAMERA, SILHOUETTE, TRACKER_POSE
from zenocap.services.camera.saved import SavedAssignment, write_saved
from zenocap.tools.record.launcher.shell import DONE, LOSS

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="sets limits of other processes, as Linux alone can"),
]
SETTLED = r"^ *(1[2-9]|[2-9]\d|\d{3,})\.\d s"  # of the display: a service that ends later is started again without end
FRAMES = 60  # with a pose, in which the others are seen to go on
CONNECTIONS = 200
LARGEST = (6680, 5010)  # px: just below the limit of an assignment
LARGEST_BYTES = 4 << 30  # of a viewer of that size
MEMORY = r"memory allocation of \d+ bytes failed|out of memory|MemoryError|Unable to allocate|Insufficient memory"


@dataclass
class Running:
    """up: the launcher.  folder: of its output.  place: where other programs connect.  page: port of the page."""

    up: subprocess.Popen[str]
    folder: Path
    place: str
    page: int

    def pids(self) -> dict[str, int]:
        return service_pids(self.up.pid)

    def end(self) -> tuple[int, str]:
        """Exit status and output of the rig after Ctrl-C."""
        status, text = ended(self.up, signal.SIGINT), output_of(self.folder)
        assert status in (DONE, LOSS), text
        assert "not started again" not in text
        assert "Traceback" not in text
        return status, text


@pytest.fixture(params=["two-view"])
def rig(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Running]:
    """The demo of a method, which tracks and whose services have run for long enough to be started again without end."""
    place, page = free_endpoint(), free_ports(1)[0]
    network = ["-m", "client", "-e", place, "--no-multicast-scouting"]
    file, takes = written_demo(tmp_path, method=request.param), tmp_path / "takes"
    line = ["up", file, "--port", page, "--recordings", takes, *network]
    with started(["router", "-l", place, "--no-multicast-scouting"], tmp_path), started(line, tmp_path) as up:
        wait_until(lambda: all_run(tmp_path) and shows(tmp_path, SETTLED), tmp_path, running=[up])
        yield Running(up, tmp_path, place, page)


@contextmanager
def limited(kind: int, most: dict[int, int]) -> Iterator[None]:
    """A lower limit of running processes, under which nothing more can be had.  most: by process."""
    before = {pid: resource.prlimit(pid, kind, (limit, resource.prlimit(pid, kind)[1])) for pid, limit in most.items()}
    try:
        yield
    finally:
        for pid, limits in before.items():
            with suppress(ProcessLookupError):
                resource.prlimit(pid, kind, limits)


@pytest.mark.timeout(600)  # a hanging one is ended after HANGS_S
@pytest.mark.parametrize("rig", ["auto"], indirect=True)
@pytest.mark.parametrize("service", ["viewer 1", "integrator", "tracker", "recognizer", "animator"])
def test_a_service_without_memory_ends_with_the_reason_and_no_other_one(rig: Running, service: str) -> None:
    """What the take has not of the poses that others received, the end of the rig states."""
    before = rig.pids()
    pid = before[service]
    # What they receive, viewer 1 its own too; the recognizer receives poses alone.
    key = TRACKER_POSE.at("demo") if service == "recognizer" else CAMERA.at("demo", viewer="1")
    with observed(rig.place) as observer:
        with limited(resource.RLIMIT_AS, {pid: 1 << 20}), zenoh.open(configuration(client(rig.place))) as stranger:

            def is_gone() -> bool:
                stranger.put(key, bytes(HUGE_BYTES))
                return rig.pids().get(service) != pid

            wait_until(is_gone, rig.folder, HANGS_S + PATIENCE_S, [rig.up])
        wait_until(lambda: f"{service}: started again" in output_of(rig.folder), rig.folder, running=[rig.up])
        wait_for_frames(rig.folder, FRAMES)
        after = rig.pids()
        status, text = rig.end()
    assert {name for name in before if after.get(name) != before[name]} == {service}
    assert re.search(rf"{service}: (did nothing, or |died \(SIG\w+\)|failed \(exit status 1\))", text)
    assert re.search(MEMORY, text), text
    assert status == LOSS  # what it sent after its last health is not counted
    assert observer.messages.keys() >= {POSES[0], ("silhouette", "viewer 2"), ("health", "animator")}
    takes = [content(take) for take in (rig.folder / "takes").iterdir()]
    assert wrong_statement(text, status, takes, observer.messages) == []


@pytest.mark.timeout(600)
def test_the_largest_assignment_takes_a_limited_memory(tmp_path: Path) -> None:
    """All frames from which the background is learnt were kept: 5.3 GB after 45 s."""
    query, file, network = assignment(hosted_studio(tmp_path), "0", 5), tmp_path / "cam.json", free_endpoint()
    assert query.viewer is not None
    own = structs.replace(
        query.viewer, size=LARGEST, calibrated_size=LARGEST, background="first", empty_frames=most_first(LARGEST)
    )
    picture = np.zeros((*LARGEST[::-1], 3), np.uint8)
    with MjpegServer(LARGEST, own.fps, lambda: picture) as camera:
        write_saved(file, SavedAssignment(query=structs.replace(query, viewer=own), source=camera.url, previews=False))
        with (
            started(["viewer", "--assigned", file, "-l", network, "--no-multicast-scouting"], tmp_path) as viewer,
            ZenohBus.open(client(network), query.rig, RealClock()) as bus,
        ):
            bus.subscribe(SILHOUETTE)  # the first is of the frame after them
            wait_until(lambda: bus.receive(0.1) is not None, tmp_path, 3 * PATIENCE_S, [viewer])
            peak = re.search(r"VmHWM:\s*(\d+) kB", Path(f"/proc/{viewer.pid}/status").read_text())
            assert ended(viewer) == 0, output_of(tmp_path)
    assert peak is not None
    assert int(peak[1]) << 10 < LARGEST_BYTES


def test_a_full_table_of_files_in_the_whole_rig_stops_nothing_and_passes(rig: Running) -> None:
    before = rig.pids()
    every = [rig.up.pid, *children_of(rig.up.pid)]  # also the server that forks services
    used = {pid: len(os.listdir(f"/proc/{pid}/fd")) for pid in every}
    with limited(resource.RLIMIT_NOFILE, used), ExitStack() as stack:
        for _ in range(CONNECTIONS):  # they wait in the queue of the page's port
            with suppress(OSError):
                stack.enter_context(socket.create_connection(("127.0.0.1", rig.page), 0.1))
        wait_for_frames(rig.folder, FRAMES)
        assert rig.pids() == before
        os.kill(before["viewer 1"], signal.SIGKILL)
        wait_until(lambda: "viewer 1: died (SIGKILL)" in output_of(rig.folder), rig.folder, running=[rig.up])
        wait_for_frames(rig.folder, FRAMES)
    wait_until(lambda: rig.pids().keys() == before.keys(), rig.folder, running=[rig.up])
    wait_until(lambda: all_run(rig.folder), rig.folder, running=[rig.up])
    with urlopen(f"http://127.0.0.1:{rig.page}/", timeout=60) as answer:
        assert answer.status == 200
    assert {name: pid for name, pid in rig.pids().items() if name != "viewer 1"} == {
        name: pid for name, pid in before.items() if name != "viewer 1"
    }
    rig.end()
