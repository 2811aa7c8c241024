"""A router, players and what they say: processes of one trial."""

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import msgspec

from services.launcher.mesh import free_ports
from tests.evaluation.load.player import Play

PATIENCE_S = 40.0
Answer = dict[str, float]


@contextmanager
def router(endpoint: str) -> Iterator[subprocess.Popen[bytes]]:
    """A router that can be called: it has just begun to listen."""
    command = [sys.executable, "-m", "services.cli", "router", "-l", endpoint, "--no-multicast-scouting"]
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
    """A process that is ready to hear, or begins to speak."""
    command = [sys.executable, "-m", "tests.evaluation.load.player", role, msgspec.json.encode(play).decode()]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        process.stdout.readline()
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def answered(process: subprocess.Popen[str], stop: bool = True) -> Answer:
    """What a player says in the end."""
    if stop:
        process.send_signal(signal.SIGTERM)
    said, _ = process.communicate(timeout=PATIENCE_S)
    return msgspec.json.decode(said.strip().splitlines()[-1], type=Answer)


def trial(play: Play, reading: Play | None = None) -> tuple[Answer, Answer]:
    """What the publisher and the subscriber say of one run."""
    with router(play.endpoint), player("sub", reading or play) as hearing, player("pub", play) as saying:
        sent = answered(saying, stop=False)
        time.sleep(0.5)
        return sent, answered(hearing)


def endpoint() -> str:
    return f"tcp/127.0.0.1:{free_ports(1)[0]}"
