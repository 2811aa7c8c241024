"""`zenocap` processes of the system tests, their output and their takes."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType

from tests.support.places import ROOT
from zenocap.common import messages as m
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.topics import UNIVERSAL_BAP
from zenocap.tools.verify.recompute import verify

PATIENCE_S = 150.0  # time limit for reaching a state, which only a hang exceeds (s)
TRACKED_S = 8.0  # of a recorded demo, from the first pose of both viewers
ZENOCAP = (sys.executable, "-P", "-m", "zenocap")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}


@contextmanager
def started(
    arguments: Sequence[object],
    folder: Path,
    environment: Mapping[str, str] = MappingProxyType({}),
    zenocap: Sequence[str] = ZENOCAP,
) -> Iterator[subprocess.Popen[str]]:
    """A `zenocap` process with its output in *.out and *.err; killed at the end if it still runs.

    environment: variables besides those of this process.  zenocap: the program.
    """
    name = "-".join(str(argument) for argument in arguments[:1]) + str(time.monotonic_ns())
    with (folder / f"{name}.out").open("w") as out, (folder / f"{name}.err").open("w") as err:
        # A shell starts what runs in its background with SIGINT ignored, and a process inherits that, but no handler.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        process = subprocess.Popen(
            [*zenocap, *map(str, arguments)], cwd=folder, env=ENVIRONMENT | environment, stdout=out, stderr=err, text=True
        )
        signal.signal(signal.SIGINT, before)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()


def ended(process: subprocess.Popen[str], by: signal.Signals = signal.SIGTERM) -> int:
    """Exit status of a process after a signal."""
    process.send_signal(by)
    return process.wait(PATIENCE_S)


def output_of(folder: Path) -> str:
    """Output of all processes started in a folder."""
    return "\n".join(path.read_text() for path in sorted(folder.glob("*.out")) + sorted(folder.glob("*.err")))


def wait_until(reached: Callable[[], bool], folder: Path, patience_s: float = PATIENCE_S) -> None:
    """Wait until `reached`; fails with the output of the processes in `folder` after `patience_s` seconds."""
    end_s = time.monotonic() + patience_s
    while not reached():
        assert time.monotonic() < end_s, output_of(folder)
        time.sleep(0.05)


def last_line(folder: Path) -> str:
    """The last complete line that the demo has printed."""
    (path,) = folder.glob("demo*.out")
    lines = [line for line in path.read_text().splitlines(keepends=True) if line.endswith("\n")]
    return lines[-1] if lines else ""


def both_contribute(line: str) -> bool:
    """Whether a line of the display shows both viewers contributing to the pose."""
    return line.count("tracking") == 3 and "frame" in line and "without" not in line


def recorded_demo(folder: Path) -> Path:
    """The take of a demo that ran in `folder` until both viewers had contributed to its poses for some seconds."""
    with started(["demo", "--method", "two-view"], folder) as demo:
        wait_until(lambda: both_contribute(last_line(folder)), folder)
        time.sleep(TRACKED_S)
        demo.send_signal(signal.SIGINT)
        assert demo.wait(PATIENCE_S) == 0, output_of(folder)
    (take,) = (folder / "recordings").glob("demo-*.mcap")
    return take


def poses_in(take: Path) -> list[m.UniversalBap]:
    """Universal BAPs of a complete take."""
    read = Take(take)
    found = [
        received.message
        for recorded in read.messages()
        if (received := envelope(recorded)) is not None and isinstance(received.message, m.UniversalBap)
    ]
    assert read.cut is None
    return found


def recomputed_poses(take: Path) -> int:
    """Number of poses of a live take that verification recomputes; all must equal the recorded ones."""
    found = verify([take])
    assert found.first is None, found.first
    return found.equal[UNIVERSAL_BAP.at("demo")]


def children_of(pid: int) -> dict[int, str]:
    """Command lines of the running processes that a process has started, and of those that these have, by process id."""
    found: dict[int, str] = {}
    waiting = [pid]
    while waiting:
        parent = waiting.pop()
        try:
            children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
        except OSError:
            continue  # ended in the meantime
        for child in children:
            try:
                found[int(child)] = Path(f"/proc/{child}/cmdline").read_text().replace("\0", " ")
            except OSError:
                continue
            waiting.append(int(child))
    return found
