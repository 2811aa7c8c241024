"""Services forked from a process that has imported their modules."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.live_cameras import until
from tests.tools.record.launcher.test_child_processes import is_running
from zenocap.common.rig.rig import demo_rig_file
from zenocap.tools.record.launcher.child_processes import Process
from zenocap.tools.record.launcher.fork_server import COMMAND, ForkServer

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere processes are executed")
ENDPOINT = "tcp/127.0.0.1:0"
ROUTER = ("router", "--listen", ENDPOINT, "--no-multicast-scouting")  # a service without images


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    one = ForkServer(["integrator"])
    yield one
    one.close()


def started(server: ForkServer, *arguments: str) -> Process:
    return server.spawn([sys.executable, *COMMAND, *arguments])


def listening(process: Process) -> str:
    """The first line of a router, after which it runs."""
    return process.stderr.readline()


@pytest.mark.nightly
def test_the_output_and_the_exit_status_of_a_command_are_its_own(server: ForkServer) -> None:
    wrong = started(server, "viewer", "missing.toml", "--id", "1")
    assert wrong.wait(30.0) == 1
    assert "missing.toml" in wrong.stderr.read()
    assert started(server, "--version").wait(30.0) == 0
    assert started(server, "viewer", "--no-such-option").wait(30.0) == 2


@pytest.mark.nightly
def test_a_service_has_a_session_and_a_command_line_of_its_own_and_stops_on_a_signal(server: ForkServer) -> None:
    router = started(server, *ROUTER)
    assert "listens" in listening(router)
    assert os.getsid(router.pid) == router.pid
    words = Path(f"/proc/{router.pid}/cmdline").read_text().rstrip("\0").split("\0")
    assert words == [sys.executable, *COMMAND, *ROUTER]
    assert router.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        router.wait(0.05)
    router.send_signal(signal.SIGTERM)
    assert router.wait(60.0) == 0


@pytest.mark.nightly
def test_a_killed_service_has_the_status_of_the_signal_and_others_go_on(server: ForkServer) -> None:
    killed, other = started(server, *ROUTER), started(server, *ROUTER)
    for router in (killed, other):
        assert "listens" in listening(router)
    killed.kill()
    assert killed.wait(60.0) == -signal.SIGKILL
    killed.kill()  # has no effect
    assert other.poll() is None
    other.kill()
    assert other.wait(60.0) == -signal.SIGKILL


@pytest.mark.nightly
def test_other_programs_are_executed(server: ForkServer) -> None:
    program = server.spawn([sys.executable, "-c", "import sys; sys.exit(7)"])
    assert isinstance(program, subprocess.Popen)
    assert program.wait(60.0) == 7


@pytest.mark.nightly
def test_without_the_server_services_go_on_and_new_ones_are_executed() -> None:
    server = ForkServer(["integrator"])
    router, other = started(server, *ROUTER), started(server, *ROUTER)
    assert all("listens" in listening(one) for one in (router, other))
    server._process.kill()
    server._process.wait()
    assert router.poll() is None
    later = started(server, "--version")
    assert isinstance(later, subprocess.Popen)
    assert later.wait(30.0) == 0
    other.kill()  # its end is noticed while the first one runs
    assert other.wait(60.0) == 1
    assert router.poll() is None
    router.send_signal(signal.SIGTERM)
    assert router.wait(60.0) == 1  # its status is unknown
    server.close()


@pytest.mark.core
def test_a_server_that_runs_ends_by_itself_when_it_is_closed() -> None:
    """Its end of the connection stayed open while a thread waited in `recv` at the other, and it was killed after 5 s."""
    server = ForkServer([])
    assert started(server, "--version").wait(60.0) == 0
    server.close()
    assert server._process.returncode == 0


@pytest.mark.core
def test_a_launcher_that_is_to_stop_does_not_wait_for_the_imports_of_the_server() -> None:
    server = ForkServer(["tracker"], stopped=lambda: True)
    with pytest.raises(InterruptedError):
        started(server, *ROUTER)
    server.close()


@pytest.mark.core
def test_a_signal_right_after_the_fork_ends_the_service(server: ForkServer) -> None:
    """It was ignored until the service had set its own handlers: nine of twelve were lost."""
    for _ in range(20):
        router = started(server, *ROUTER)
        router.send_signal(signal.SIGTERM)
        assert router.wait(60.0) in (0, -signal.SIGTERM)


SHARED = """
import gc, os, socket, sys
from pathlib import Path
from zenocap.tools.record.launcher import fork_server

def private_kb():
    lines = Path("/proc/self/smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_Dirty"))

def serve(connection):
    if os.fork() == 0:
        before = private_kb()
        gc.collect()
        print(private_kb() - before, flush=True)
        os._exit(0)
    os.wait()

fork_server.serve, one = serve, socket.socketpair()[0]
sys.argv[1:] = [str(one.detach()), "integrator", ""]
fork_server.main()
"""


@pytest.mark.core
def test_a_collection_in_a_service_copies_nothing_of_what_it_shares() -> None:
    """It copied the objects of all imports."""
    done = subprocess.run([sys.executable, "-c", SHARED], stdout=subprocess.PIPE, text=True, check=True, timeout=60.0)
    assert int(done.stdout) < 5000


@pytest.mark.nightly
def test_services_and_server_end_with_a_launcher_that_is_killed() -> None:
    network = ("--mode", "peer", "--listen", ENDPOINT, "--no-multicast-scouting")
    integrator = ("integrator", str(demo_rig_file("two-view")), "--no-log", "--with-parent", *network)
    program = (
        "import sys, time\nfrom zenocap.tools.record.launcher.fork_server import COMMAND, ForkServer\n"
        "server = ForkServer(['integrator'])\n"
        f"service = server.spawn([sys.executable, *COMMAND, *{integrator!r}])\n"
        "print(service.pid, server._process.pid, flush=True)\ntime.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as launcher:
        pids = [int(word) for word in launcher.stdout.readline().split()]
        time.sleep(1.0)  # it handles signals, and not its end by one before
        assert all(map(is_running, pids))
        launcher.kill()
    until(lambda: not any(map(is_running, pids)), "the end of service and server")
