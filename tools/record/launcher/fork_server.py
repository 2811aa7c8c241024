"""Fork server: imports the heavy modules once and forks services.

Imports are most of the processor time of a start: with a rig of its own for each of 16 pairs of viewers, 48 processes would
import the same.  A forked service behaves as one that was executed: own session, standard input and error, default signals,
and its command line in the list of processes.  It is forked before any thread or network session
exists.  Linux only; elsewhere, and when the fork server has ended, processes are executed.
"""

import ctypes
import gc
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import IO, NoReturn, cast

from zenocap.common.rig.methods import METHODS, method_of
from zenocap.common.runtime.compiled import is_compiled
from zenocap.common.table import attribute
from zenocap.tools.record.launcher.child_processes import Process, Spawn, spawn

COMMAND = ("-P", "-m", "zenocap")  # after the interpreter: what can be forked
ROOM = 4096  # bytes of the command line of a forked service
PROGRAM = "zenocap.tools.cli.main"  # by name: it starts this server itself
STARTED_S = 60.0  # longest wait for the answer to a request; importing takes a second
STOPPED_S = 0.1  # between two looks whether to stop
CLOSED_S = 1.0  # for the server to end; chosen by hand
IGNORED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # by the server, which its parent ends by closing the connection
UNKNOWN = 1  # exit status of a service whose fork server ended before


class ForkedProcess:
    """A service that was forked; the part of subprocess.Popen in `Process`.  stdin: pipe that ends it when it is closed."""

    def __init__(self, pid: int, stdin: IO[bytes], stderr: IO[str]) -> None:
        self.pid, self.stderr = pid, stderr
        self._stdin = stdin
        self._pidfd = os.fdopen(os.pidfd_open(pid), "rb", 0)  # a file, so that it is closed with this object
        self._status: int | None = None
        self._known = threading.Event()

    def end(self, status: int) -> None:
        """Set the exit status, as reported by the fork server; the first one counts."""
        if not self._known.is_set():
            self._status = status
            self._known.set()

    def poll(self) -> int | None:
        return self._status if self._known.is_set() else None

    def wait(self, timeout: float | None = None) -> int:
        if not self._known.wait(timeout):
            raise subprocess.TimeoutExpired(f"service {self.pid}", timeout or 0.0)
        assert self._status is not None
        return self._status

    def send_signal(self, sig: int) -> None:
        if self.poll() is None:
            try:
                signal.pidfd_send_signal(self._pidfd.fileno(), sig)
            except ProcessLookupError:  # ended, and not reported yet
                return

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def fileno(self) -> int:
        """Descriptor that is readable when the service has ended."""
        return self._pidfd.fileno()


class ForkServer:
    """Starts services by `spawn`.  The server ends with this process, or with `close`."""

    def __init__(
        self, services: Collection[str], parts: Collection[str] = (), stopped: Callable[[], bool] = lambda: False
    ) -> None:
        """services: names of those whose modules are imported at once.  stopped: whether to start no more.

        parts: of `zenocap warmup`, whose compiled functions are loaded at once if they are cached; they start no thread.
        """
        self._stopped = stopped
        self._answers = False  # while the server imports, it does not notice its end either
        self._lock = threading.Lock()
        self._children: dict[int, ForkedProcess] = {}
        self._pids: dict[int, int] = {}  # by request
        self._ends: dict[int, int] = {}  # exit statuses that arrived before the process was known
        self._answered = threading.Condition()
        self._requests = 0
        self._socket, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        command = [sys.executable, "-P", "-m", "zenocap.tools.record.launcher.fork_server", str(there.fileno())]
        command += [" ".join(sorted({*services})), " ".join(sorted({*parts})), " " * ROOM]
        self._process = subprocess.Popen(command, pass_fds=[there.fileno()], start_new_session=True)
        there.close()
        threading.Thread(target=self._listen, name="fork server", daemon=True).start()

    def spawn(self, arguments: Sequence[str]) -> Process:
        """Start a process; one that is no command of zenocap, or cannot be forked, is executed.

        Raises InterruptedError when it is to start no more.
        """
        if tuple(arguments[:4]) != (sys.executable, *COMMAND):
            return spawn(arguments)
        with self._lock:
            forked = self._forked(list(arguments[4:]))
        return spawn(arguments) if forked is None else forked

    def close(self) -> None:
        """End the server; its services are not affected."""
        with suppress(OSError):  # it has ended
            self._socket.shutdown(socket.SHUT_RDWR)  # `close` alone has no effect while `_listen` waits in recv
        try:
            self._process.wait(CLOSED_S if self._answers else 0.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _forked(self, arguments: list[str]) -> ForkedProcess | None:
        self._requests += 1
        request = self._requests
        stdin_there, stdin_here = os.pipe()
        try:
            stderr_here, stderr_there = os.pipe()
        except OSError:
            os.close(stdin_there)
            os.close(stdin_here)
            raise
        stdin, stderr = os.fdopen(stdin_here, "wb", 0), os.fdopen(stderr_here, encoding="utf-8", errors="replace")
        try:
            message = json.dumps([request, arguments]).encode()
            socket.send_fds(self._socket, [message], [stdin_there, stderr_there])
            with self._answered:
                self._wait_for_answer(request)
                pid = self._pids.pop(request, 0)
                if pid:
                    child = self._children[pid] = ForkedProcess(pid, stdin, stderr)
                    if pid in self._ends:
                        child.end(self._ends.pop(pid))
                    return child
        except InterruptedError:
            stdin.close()  # ends it, should it still be forked
            raise
        except OSError:  # the server has ended, or the process already has and is not there for its pidfd
            pass
        finally:
            os.close(stdin_there)
            os.close(stderr_there)
        stdin.close()
        stderr.close()
        return None

    def _wait_for_answer(self, request: int) -> None:
        """Wait until a process is forked or the server has ended.  Raises InterruptedError when it is to stop before."""
        end_s = time.monotonic() + STARTED_S
        while not (request in self._pids or self._process.poll() is not None or time.monotonic() > end_s):
            if self._stopped():
                raise InterruptedError
            self._answered.wait(STOPPED_S)

    def _listen(self) -> None:
        while True:
            try:
                data = self._socket.recv(4096)
            except OSError:
                data = b""
            if not data:
                break
            what, number, value = json.loads(data)
            with self._answered:
                self._answers = True
                if what == "started":
                    self._pids[number] = value
                elif (child := self._children.pop(number, None)) is not None:
                    child.end(value)
                else:
                    self._ends[number] = value
                self._answered.notify_all()
        self._socket.close()
        with self._answered:
            left, self._children = list(self._children.values()), {}
            self._answered.notify_all()
        while left:  # without the server, their exit statuses are lost
            for child in select.select(left, [], [])[0]:
                child.end(UNKNOWN)
                left.remove(child)


def serve(connection: socket.socket) -> list[str] | None:
    """Fork a process for each request until the connection is closed.

    Returns None in the server at its end, in a forked process the arguments of its command: there the signals of IGNORED
    wait until they are unblocked.
    """
    woken, waker = os.pipe()
    os.set_blocking(waker, False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(waker)
    while True:
        readable, _, _ = select.select([connection.fileno(), woken], [], [])
        if woken in readable:
            os.read(woken, 4096)
            _report_ends(connection)
        if connection.fileno() not in readable:
            continue
        data, descriptors, _, _ = socket.recv_fds(connection, 1 << 16, 2)
        if not data:
            return None
        request, arguments = json.loads(data)
        signal.pthread_sigmask(signal.SIG_BLOCK, IGNORED)  # ignored until its own handlers are set, they would be lost
        pid = os.fork()
        if pid == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for descriptor in (woken, waker):
                os.close(descriptor)
            connection.close()
            _become(arguments, *descriptors)
            return [str(argument) for argument in arguments]
        signal.pthread_sigmask(signal.SIG_UNBLOCK, IGNORED)
        for descriptor in descriptors:
            os.close(descriptor)
        connection.send(json.dumps(["started", request, pid]).encode())


def _report_ends(connection: socket.socket) -> None:
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if not pid:
            return
        connection.send(json.dumps(["ended", pid, os.waitstatus_to_exitcode(status)]).encode())


def _become(arguments: Sequence[str], stdin: int, stderr: int) -> None:
    """Take over session, standard streams and the name in the list of processes."""
    os.setsid()
    null = os.open(os.devnull, os.O_WRONLY)
    for descriptor, standard in ((stdin, 0), (null, 1), (stderr, 2)):
        os.dup2(descriptor, standard)
        os.close(descriptor)
    _show_command([sys.executable, *COMMAND, *arguments])


def _show_command(words: Sequence[str]) -> None:
    """Overwrite this process's command line, whose memory the kernel reads for the list of processes."""
    start, end = map(int, Path("/proc/self/stat").read_text().rpartition(")")[2].split()[45:47])
    if start <= 0 or end - start <= ROOM:
        return
    text = "\0".join(words).encode()[: end - start - 1]
    ctypes.memmove(start, text.ljust(end - start, b"\0"), end - start)


@contextmanager
def fork_server(
    services: Collection[str], parts: Collection[str] = (), stopped: Callable[[], bool] = lambda: False
) -> Iterator[Spawn]:
    """Context of a function that starts processes, those of `services` without importing their modules again.

    parts, stopped: see `ForkServer`.
    """
    if sys.platform != "linux":
        yield spawn
        return
    server = ForkServer(services, parts, stopped)
    try:
        yield server.spawn
    finally:
        server.close()


def _load(part: str) -> None:
    from zenocap.common.vision.threads import use_one_thread
    from zenocap.tools.operate.warmup.parts import PARTS

    use_one_thread()  # OpenCV's others would not exist in forked processes
    PARTS[part](lambda _: None)


def main() -> None:
    """Entry point of the server.  Arguments: descriptor of its connection, services, parts, and room for command lines."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in IGNORED}
    connection = socket.socket(fileno=int(sys.argv[1]))
    command_line = cast("Callable[[], None]", attribute(f"{PROGRAM}:main"))  # imported before anything is forked
    command_at = cast("Callable[[str], object]", attribute(f"{PROGRAM}:command_at"))
    leave = cast("Callable[[int], NoReturn]", attribute(f"{PROGRAM}:leave"))
    for name in sys.argv[2].split():
        import_module(f"zenocap.services.{name}.shell")
        command_at(name)
        if name == "viewer":
            for method in METHODS.own:
                attribute(method_of(method).viewer)
    for part in filter(is_compiled, sys.argv[3].split()):
        _load(part)
    gc.freeze()  # the first collection in each service would copy what they share: 37 MB and 0.08 s of processor
    arguments = serve(connection)
    if arguments is None:
        leave(0)
    for number, handler in before.items():
        signal.signal(number, handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, IGNORED)
    sys.argv = ["zenocap", *arguments]
    command_line()


if __name__ == "__main__":
    main()
