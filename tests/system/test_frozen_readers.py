"""Frozen programs around a router, such as those of suspended computers, stop none of the others."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
import zenoh

from tests.support.networks import client, free_endpoint
from tests.support.places import ROOT
from tests.support.processes import PATIENCE_S
from zenocap.common.bus.zenoh_session import open_session

pytestmark = pytest.mark.nightly

KEY = "zenocap/frozen/viewer/1/silhouette"
FROZEN = 6
WATCHED_S = 6.0  # three times the lease
RATE = 200.0
READER = (
    "import sys, time; from zenocap.common.bus.zenoh_session import ZenohOptions, open_session\n"
    "session = open_session(ZenohOptions('client', (sys.argv[1],), multicast_scouting=False))\n"
    f"subscriber = session.declare_subscriber({KEY!r}, lambda sample: None)\n"
    "print('ready', flush=True)\n"
    "time.sleep(600)\n"
)


@pytest.fixture
def processes() -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that are killed at the end."""
    started: list[subprocess.Popen[str]] = []
    yield started
    for process in started:
        process.kill()
        process.communicate()


def test_readers_that_are_frozen_stop_no_other_reader(processes: list[subprocess.Popen[str]]) -> None:
    endpoint = free_endpoint()
    router = [sys.executable, "-P", "-m", "zenocap", "router", "--listen", endpoint, "--no-multicast-scouting"]
    processes.append(subprocess.Popen(router, cwd=ROOT, text=True, stderr=subprocess.DEVNULL))
    received: list[float] = []
    with open_session(client(endpoint)) as publisher, open_session(client(endpoint)) as reader:
        reader.declare_subscriber(KEY, zenoh.handlers.Callback(lambda _: received.append(time.monotonic()), indirect=False))
        for _ in range(FROZEN):
            one = [sys.executable, "-P", "-c", READER, endpoint]
            processes.append(subprocess.Popen(one, cwd=ROOT, text=True, stdout=subprocess.PIPE))
        for process in processes[1:]:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
        for process in processes[1:]:
            process.send_signal(signal.SIGSTOP)
        started_s = time.monotonic()
        while not any(at_s > started_s + WATCHED_S for at_s in received[-1:]):
            assert time.monotonic() < started_s + PATIENCE_S, "nothing came after the lease of the frozen readers"
            publisher.put(KEY, bytes(400), congestion_control=zenoh.CongestionControl.DROP, express=True)
            time.sleep(1 / RATE)
