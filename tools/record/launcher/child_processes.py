"""Child processes: start, supervision, restart with increasing pauses, and stop.

A child's standard input is a pipe from this process, so that it ends with this process even when that is killed.
"""

import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import IO, Protocol

from zenocap.common.errors import UserError
from zenocap.common.runtime.signals import HANGS_S, STACKS

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0  # after the second short run, and at most
SHORT_PAUSE_S = 0.1  # after a run of SETTLED_S, and after the first short one; chosen by hand
SETTLED_S = 10.0  # run time after which a start counts as successful
# `tests.measures.stops` allows a stop 2 s, under load 5 s.  Services that hung at a stop had lost its signal: it came right
# after their fork, while it was ignored.  The kill is later: it cuts the take where a disk is slow.
HANGING_S = 8.0  # for a process to end, after which the stacks of its threads are logged; chosen by hand
STOPPED_S = 20.0  # for a process to end by itself, as of systemd and compose in `deploy`; chosen by hand
QUICK_FAILURES = 5  # in a row, before giving up a process that has never run for SETTLED_S
READ_AT_STOP_S = 1.0  # for the last lines of an ended process; at another time SHORT_PAUSE_S; chosen by hand
WITHOUT_FAILURE = (0, 3)  # exit statuses of a service that was stopped, without and with loss
SILENT_S = 3.0  # after a health, which is sent every second; chosen by hand
FAILED = 1  # status of a process that ended without a failure of its own, although it was to run on
WANTED_FILES = 4096  # open ones of each process; more than any rig has needed; chosen by hand
NEEDED_FILES = 256  # of the animator: 64 pages, 128 connections without a handshake, and its own; chosen by hand


class Process(Protocol):
    """The part of subprocess.Popen that is used."""

    @property
    def pid(self) -> int: ...

    @property
    def stderr(self) -> IO[str] | None: ...

    def poll(self) -> int | None: ...

    def wait(self, timeout: float | None = None) -> int: ...

    def send_signal(self, sig: int) -> None: ...

    def kill(self) -> None: ...


Spawn = Callable[[Sequence[str]], Process]  # raises InterruptedError when it is to start no more


def allow_files() -> None:
    """Raise the limit of open files of this process and of its children to WANTED_FILES, or as far as is allowed.

    Raises UserError where that is too low for a rig.
    """
    if sys.platform == "win32":  # which has no such limit
        return
    import resource

    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    soft, hard = (sys.maxsize if limit == resource.RLIM_INFINITY else limit for limit in limits)
    if hard < NEEDED_FILES:
        raise UserError(f"open files = {hard}: allowed: at least {NEEDED_FILES}: the hard limit, see LimitNOFILE")
    if soft < min(WANTED_FILES, hard):
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(WANTED_FILES, hard), limits[1]))


def spawn(arguments: Sequence[str]) -> Process:
    """Start a process in a separate session, so that Ctrl-C reaches only its parent, which stops the children in order."""
    return subprocess.Popen(
        arguments, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace",
        start_new_session=True,
    )  # fmt: skip


@dataclass
class ChildProcess:
    """name: for display.  status: exit status of a process that is not restarted.  due_s: time of the next restart.

    settled: whether it once ran for SETTLED_S.  last_status: of its last end.  silent_s: time without a health.
    """

    name: str
    arguments: tuple[str, ...]
    process: Process | None = None
    started_s: float = 0.0
    due_s: float | None = None
    starts: int = 0
    quick_failures: int = 0
    settled: bool = False
    last_status: int = 0
    silent_s: float = 0.0
    status: int | None = None
    reader: threading.Thread | None = field(default=None, repr=False)


class ChildProcesses:
    """The children of this process.  clock: monotonic, seconds.  `lines` returns their output and status changes."""

    def __init__(
        self, commands: Sequence[tuple[str, Sequence[str]]], clock: Callable[[], float], start: Spawn = spawn,
        finishing: Collection[str] = (),
    ) -> None:  # fmt: skip
        """finishing: names of those that end by themselves; others are started again when something else stops them."""
        self._clock, self._spawn, self._finishing = clock, start, finishing
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.all = [ChildProcess(name, tuple(arguments)) for name, arguments in commands]

    def start(self) -> None:
        for child in self.all:
            self._start(child)

    def poll(self) -> None:
        """Detect ended processes; restart those whose pause is over."""
        for child in self.all:
            if child.process is not None and child.process.poll() is not None:
                self._ended(child, int(child.process.poll() or 0))
            elif child.due_s is not None and self._clock() >= child.due_s:
                self._start(child)

    def end_silent(self, health_s: Mapping[str, float], period_s: float) -> None:
        """End those that run on without a health for HANGS_S in which others send theirs.  Called every `period_s`.

        Zenoh's threads end where there is no memory, and the loop of a service goes on without a network.
        health_s: time of the last health, by name; without one of its process, as while it loads, a child is left alone.
        """
        reporting = {name for name, at_s in health_s.items() if self._clock() - at_s < SILENT_S}
        for child in self.all if reporting else ():
            runs = child.process is not None and health_s.get(child.name, 0.0) > child.started_s
            child.silent_s = child.silent_s + period_s if runs and child.name not in reporting else 0.0
            if child.process is not None and child.silent_s > HANGS_S:
                child.silent_s = 0.0
                self._lines.put(f"{child.name}: no health for {HANGS_S:g} s, while others send theirs: ended")
                child.process.send_signal(getattr(signal, "SIGALRM", signal.SIGTERM))

    def lines(self) -> list[str]:
        """Lines written since the last call."""
        return [self._lines.get() for _ in range(self._lines.qsize())]

    @property
    def given_up(self) -> list[ChildProcess]:
        """Processes that failed and are not restarted."""
        return [child for child in self.all if child.status not in (None, 0)]

    def stop(self, names: Callable[[str], bool] = lambda _: True) -> None:
        """End processes by name: SIGTERM, then SIGKILL after STOPPED_S.  One that hangs logs its stacks after HANGING_S."""
        running = []
        for child in self.all:
            if names(child.name):
                if child.due_s is not None and child.quick_failures >= QUICK_FAILURES:
                    child.status = child.last_status or FAILED
                child.due_s = None
                if child.process is not None and child.process.poll() is None:
                    child.process.send_signal(signal.SIGTERM)
                    running.append(child)
        begin_s = self._clock()
        for child in self._left(running, begin_s + HANGING_S):
            if child.process is not None and STACKS is not None:
                self._lines.put(f"{child.name}: has not stopped in {HANGING_S:g} s; the stacks of its threads:")
                child.process.send_signal(STACKS)
        for child in self._left(running, begin_s + STOPPED_S):
            if child.process is not None:
                child.process.kill()
                self._lines.put(f"{child.name}: did not stop in {STOPPED_S:g} s and was killed")
        self._left(running, None)

    def _left(self, stopping: Collection[ChildProcess], end_s: float | None) -> list[ChildProcess]:
        """Processes that still run at a time; None: wait for all.  Those that have ended get their status."""
        left = []
        for child in stopping:
            if child.process is None:
                continue
            try:
                status = child.process.wait(None if end_s is None else max(0.05, end_s - self._clock()))
            except subprocess.TimeoutExpired:
                left.append(child)
                continue
            # One that had just been started has no handler of the signal yet.
            child.status = 0 if status == -signal.SIGTERM else status
            child.process = None
            if child.reader is not None:
                child.reader.join(READ_AT_STOP_S)
        return left

    def _start(self, child: ChildProcess) -> None:
        child.starts += 1
        try:
            child.process = self._spawn(child.arguments)
        except InterruptedError:  # the launcher is to stop
            return
        except OSError as error:  # such as a full table of files or processes, which may pass
            self._again(child, f"cannot be started: {error.strerror or error}", FAILED, 0.0)
            return
        child.started_s, child.due_s = self._clock(), None
        if child.starts > 1:
            self._lines.put(f"{child.name}: started again (pid {child.process.pid})")
        if (stream := child.process.stderr) is not None:
            child.reader = threading.Thread(target=self._read, args=(stream,), name=child.name, daemon=True)
            child.reader.start()

    def _read(self, stream: IO[str]) -> None:
        for line in stream:
            self._lines.put(line.rstrip())

    def _ended(self, child: ChildProcess, status: int) -> None:
        child.process = None
        if child.reader is not None:
            child.reader.join(SHORT_PAUSE_S)
        if status == 0 and child.name in self._finishing:
            child.status = 0
            self._lines.put(f"{child.name}: finished")
            return
        self._again(child, _exit_text(status), status, self._clock() - child.started_s)

    def _again(self, child: ChildProcess, what: str, status: int, runtime_s: float) -> None:
        """Start a process again after a pause, or give it up.  what: became of it."""
        child.last_status = status
        child.settled |= runtime_s >= SETTLED_S
        child.quick_failures = child.quick_failures + 1 if runtime_s < SETTLED_S else 0
        # A process that fails right after its first start would fail again.  One that was killed or stopped may not, and of
        # one that ran longer the cause may pass: a camera that is plugged in again, another process of its name that ends.
        first_failed = status > 0 and status not in WITHOUT_FAILURE and child.starts == 1 and child.quick_failures
        if first_failed or (child.quick_failures >= QUICK_FAILURES and not child.settled):
            child.status = status or FAILED
            child.due_s = None
            self._lines.put(f"{child.name}: {what}{f' after {runtime_s:.1f} s' if runtime_s else ''}; not started again")
            return
        pause_s = SHORT_PAUSE_S
        if child.quick_failures > 1:
            pause_s = min(FIRST_PAUSE_S * 2 ** (child.quick_failures - 2), LONGEST_PAUSE_S)
        child.due_s = self._clock() + pause_s
        self._lines.put(f"{child.name}: {what}; starting it again in {pause_s:g} s")


def _exit_text(status: int) -> str:
    if status < 0:
        if status == -getattr(signal, "SIGALRM", 0):
            return f"did nothing, or sent no health, for {HANGS_S:g} s and was ended (SIGALRM)"
        try:
            return f"died ({signal.Signals(-status).name})"
        except ValueError:
            return f"died (signal {-status})"
    if status in WITHOUT_FAILURE:
        return f"ended, although it was to run on (exit status {status})"
    return f"failed (exit status {status})"
