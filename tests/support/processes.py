"""`zenocap` processes of the system tests, their output and their takes."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

from tests.support.places import ROOT
from zenocap.common import messages as m
from zenocap.common.recording.reader import TakeReader
from zenocap.common.runtime.signals import STACKS
from zenocap.common.topics import UNIVERSAL_BAP
from zenocap.tools.takes.verify.recompute import Verification, verify

PATIENCE_S = 150.0  # time limit for reaching a state, which only a hang exceeds (s)
M = TypeVar("M", bound=m.Message)
ZENOCAP = (sys.executable, "-P", "-m", "zenocap")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}
_open: dict[Path, list[subprocess.Popen[str]]] = {}  # what `started` has begun, by folder


@contextmanager
def started(
    arguments: Sequence[object], folder: Path, environment: Mapping[str, str] = MappingProxyType({}),
    zenocap: Sequence[str] = ZENOCAP,
) -> Iterator[subprocess.Popen[str]]:  # fmt: skip
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
        _open.setdefault(folder, []).append(process)
        try:
            yield process
        finally:
            _open[folder].remove(process)
            if process.poll() is None:
                process.kill()
                process.wait()


def completed(
    arguments: Sequence[object], folder: Path, answers: str = "", environment: Mapping[str, str] = MappingProxyType({})
) -> subprocess.CompletedProcess[str]:
    """A `zenocap` command that ends by itself.  answers: its standard input."""
    return subprocess.run(
        [*ZENOCAP, *map(str, arguments)], cwd=folder, env=ENVIRONMENT | {"COLUMNS": "200"} | environment, input=answers,
        capture_output=True, text=True, timeout=4 * PATIENCE_S, check=False,
    )  # fmt: skip


def run(folder: Path, *arguments: object, answers: str = "") -> tuple[int, str]:
    """Exit status and output of a `zenocap` command that ends by itself, without a traceback."""
    done = completed(arguments, folder, answers)
    text = done.stdout + done.stderr
    assert "Traceback" not in text, text
    return done.returncode, text


def ended(process: subprocess.Popen[str], by: signal.Signals = signal.SIGTERM) -> int:
    """Exit status of a process after a signal, which on Linux another thread than the main one receives.

    That happens by chance, and wakes no main thread that waits without end.
    """
    threads = Path(f"/proc/{process.pid}/task")
    os.kill(max(int(path.name) for path in threads.iterdir()) if threads.is_dir() else process.pid, by)
    return process.wait(PATIENCE_S)


def output_of(folder: Path) -> str:
    """Output of all processes started in a folder."""
    return "\n".join(path.read_text() for path in sorted(folder.glob("*.out")) + sorted(folder.glob("*.err")))


def wait_until(
    reached: Callable[[], bool], folder: Path, patience_s: float = PATIENCE_S,
    running: Sequence[subprocess.Popen[str]] = (),
) -> None:  # fmt: skip
    """Wait until `reached`; fails with the output and the stacks of the processes in `folder` after `patience_s` seconds.

    running: processes whose end fails at once.
    """
    end_s = time.monotonic() + patience_s
    while not reached():
        assert time.monotonic() < end_s, _stacks_of(folder)
        assert all(process.poll() is None for process in running), output_of(folder)
        time.sleep(0.05)


def _stacks_of(folder: Path) -> str:
    """Output of all processes of a folder, after those that run were asked for their stacks."""
    if STACKS is not None:
        for process in _open.get(folder, []):
            process.send_signal(STACKS)
        time.sleep(1.0)
    return output_of(folder)


def last_line(folder: Path) -> str:
    """The last complete line of the display of `demo` or `up`."""
    (path,) = [*folder.glob("demo*.out"), *folder.glob("up*.out")]
    lines = [line for line in path.read_text().splitlines(keepends=True) if line.endswith("\n") and " s | " in line]
    return lines[-1] if lines else ""


def shows(folder: Path, pattern: str) -> bool:
    return re.search(pattern, last_line(folder)) is not None


def all_run(folder: Path) -> bool:
    """Whether the display shows a pose and every service running: one that is interrupted while it starts has failed."""
    return "°" in last_line(folder) and "not running" not in last_line(folder)


def wait_for_frames(folder: Path, count: int) -> None:
    """Wait until the display has gone on by some frames with a pose."""

    def frame() -> int:
        found = re.search(r"frame (\d+)", last_line(folder))
        return int(found[1]) if found else 0

    first = frame()
    wait_until(lambda: frame() > first + count, folder)


def both_contribute(line: str) -> bool:
    """Whether a line of the display shows both viewers contributing to the pose."""
    return line.count("tracking") == 3 and "frame" in line and "without" not in line


def poses_in(take: Path) -> list[m.UniversalBap]:
    """Universal BAPs of a complete take."""
    return messages_in(take, m.UniversalBap)


def messages_in(take: Path, kind: type[M]) -> list[M]:
    """Messages of one type in a complete take."""
    read = TakeReader(take)
    messages = [received.message for received in read.envelopes(invalid="raise")]
    assert read.cut is None
    return [message for message in messages if isinstance(message, kind)]


@cache
def verified(take: Path) -> Verification:
    """The verification of a live take that has ended; all that is recomputed must equal what was recorded."""
    found = verify([take])
    assert found.first is None, found.first
    return found


def recomputed_poses(take: Path) -> int:
    """Number of poses of a live take that verification recomputes."""
    return verified(take).equal[UNIVERSAL_BAP.at("demo")]


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


def service_pids(pid: int) -> dict[str, int]:
    """Process ids of the services that a process has started, by name, as in "viewer 1" and "tracker"."""
    found = {}
    for child, words in children_of(pid).items():
        if named := re.search(r" zenocap (\w+) (?:.* --id (\S+))?", f"{words} "):
            found[" ".join(filter(None, named.groups()))] = child
    return found
