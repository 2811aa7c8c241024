"""A `zenocap replay` process on a private network, controlled by standard input and output."""

import logging
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import IO

import msgspec

from zenocap.services.animator.parameters import REPLAY_DELAY_S, REPLAY_TIMEOUT_S

logger = logging.getLogger(__name__)

REPLAYED_RIG = "take"  # rig name under which a take is replayed
ERROR_PREFIX = "error: "  # of the line that a failing command prints


class ReplayStatus(msgspec.Struct, frozen=True):
    """Status line of `zenocap replay --remote`.  shift_ns: delay of published capture times against the recorded ones.

    shift_frames: the same of frame numbers.
    """

    place_s: float
    duration_s: float
    rate: float
    paused: bool
    bad: int = 0
    shift_ns: int = 0
    shift_frames: int = 0

    def problem(self) -> str:
        return f"{self.bad} messages cannot be read by this version" if self.bad else ""


class ReplayProcess:
    """A `zenocap replay` process that is controlled through its standard input."""

    def __init__(self, path: Path, port: int) -> None:
        arguments = [
            sys.executable, "-P", "-m", "zenocap", "replay", str(path), "--rig", REPLAYED_RIG, "--remote", "--loop",
            "--delay", str(REPLAY_DELAY_S), "--mode", "peer", "--connect", f"tcp/127.0.0.1:{port}",
            "--no-multicast-scouting",
        ]  # fmt: skip
        self.status: ReplayStatus | None = None
        self._error = ""
        self._process = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
            start_new_session=True,
        )  # fmt: skip
        self._readers = [
            self._read(self._process.stdout, self._on_status),
            self._read(self._process.stderr, self._on_error),
        ]

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def control(self, paused: bool | None = None, position_s: float | None = None, rate: float | None = None) -> None:
        """Send a command; None leaves a value unchanged."""
        line = {"paused": paused, "place_s": position_s, "rate": rate}
        assert self._process.stdin is not None  # it is a pipe
        try:
            self._process.stdin.write(msgspec.json.encode(line).decode() + "\n")
            self._process.stdin.flush()
        except OSError:
            logger.debug("the replay has ended")

    def problem(self) -> str:
        """Return the error of a process that has ended, "" for a normal end."""
        if self._process.returncode in (0, -signal.SIGTERM):
            return ""
        unreadable = self.status.problem() if self.status else ""
        return self._error or unreadable or f"the replay ended with status {self._process.returncode}"

    def __enter__(self) -> "ReplayProcess":
        return self

    def __exit__(self, *_: object) -> None:
        if self.running:
            self._process.terminate()
            try:
                self._process.wait(REPLAY_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        for reader in self._readers:
            reader.join(1.0)
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()

    def _read(self, stream: IO[str] | None, on_line: Callable[[str], None]) -> threading.Thread:
        assert stream is not None  # it is a pipe

        def read() -> None:
            for line in stream:
                on_line(line)

        thread = threading.Thread(target=read, name="replay", daemon=True)
        thread.start()
        return thread

    def _on_status(self, line: str) -> None:
        try:
            self.status = msgspec.json.decode(line, type=ReplayStatus)
        except msgspec.MsgspecError:
            logger.debug("replay: %s", line.rstrip())

    def _on_error(self, line: str) -> None:
        if line.startswith(ERROR_PREFIX):
            self._error = line.strip().removeprefix(ERROR_PREFIX)
        else:
            logger.debug("replay: %s", line.rstrip())
