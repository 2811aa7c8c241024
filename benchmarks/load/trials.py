"""Processes of one trial: a router and players, and their results."""

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import msgspec

from benchmarks.load.player import Play
from zenocap.tools.launcher.peer_mesh import free_ports

PATIENCE_S = 40.0
PlayerResult = dict[str, float]


@contextmanager
def router(endpoint: str) -> Iterator[subprocess.Popen[bytes]]:
    """Start a router; return once it accepts connections."""
    command = [sys.executable, "-m", "zenocap", "router", "-l", endpoint, "--no-multicast-scouting"]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    host, _, port = endpoint.removeprefix("tcp/").partition(":")
    try:
        end_s = time.monotonic() + PATIENCE_S
        while not _listens(host, int(port)):
            if time.monotonic() > end_s or process.poll() is not None:
                raise RuntimeError(f"no router at {endpoint}")
            time.sleep(0.002)
        yield process
    finally:
        process.terminate()
        process.wait()


def _listens(host: str, port: int) -> bool:
    try:
        socket.create_connection((host, port), 1.0).close()
        return True
    except OSError:
        return False


@contextmanager
def player(role: str, play: Play) -> Iterator[subprocess.Popen[str]]:
    """Start a player; return once it has subscribed, or publishes."""
    command = [sys.executable, "-m", "benchmarks.load.player", role, msgspec.json.encode(play).decode()]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        process.stdout.readline()
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def result_of(process: subprocess.Popen[str], stop: bool = True) -> PlayerResult:
    """Result of a player."""
    if stop:
        process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=PATIENCE_S)
    return msgspec.json.decode(output.strip().splitlines()[-1], type=PlayerResult)


def trial(play: Play, reading: Play | None = None) -> tuple[PlayerResult, PlayerResult]:
    """Results of publisher and subscriber of one run."""
    with router(play.endpoint), player("sub", reading or play) as subscriber, player("pub", play) as publisher:
        sent = result_of(publisher, stop=False)
        time.sleep(0.5)
        return sent, result_of(subscriber)


def endpoint() -> str:
    return f"tcp/127.0.0.1:{free_ports(1)[0]}"
