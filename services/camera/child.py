"""A process that is started again whenever it ends, with increasing pauses."""

import logging
import signal
import subprocess
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import IO

from zenocap.common.runtime.foreign_text import MAX_LINE, printable
from zenocap.services.camera.parameters import FIRST_PAUSE_S, LAST_LINES, LONGEST_PAUSE_S, SETTLED_S, VIEWER_STOP_S

logger = logging.getLogger(__name__)


class Child:
    """Runs a command until `stop`.  clock: monotonic, seconds.

    failure: last line of output of a process that ended; empty while it runs well.  restarts: number of starts after the
    first.
    """

    def __init__(self, name: str, command: Sequence[str], clock: Callable[[], float]) -> None:
        self._name, self._command, self._clock = name, tuple(command), clock
        self._process: subprocess.Popen[str] | None = None
        self._lines: deque[str] = deque(maxlen=LAST_LINES)
        self._reader: threading.Thread | None = None
        self._started_s = self._due_s = 0.0
        self._pause_s = FIRST_PAUSE_S
        self.restarts, self.failure = -1, ""
        self._start()

    @property
    def is_running(self) -> bool:
        return self._process is not None

    def check(self) -> None:
        """Notice its end, and start it again when the pause is over."""
        if self._process is None:
            if self._clock() >= self._due_s:
                self._start()
            return
        status = self._process.poll()
        if status is None:
            if self._clock() - self._started_s > SETTLED_S:
                self.failure, self._pause_s = "", FIRST_PAUSE_S
            return
        self._ended()
        self.failure = self._lines[-1] if self._lines else f"exit status {status}"
        self._due_s = self._clock() + self._pause_s
        logger.warning("%s: ended, exit status %d; starting it again in %g s", self._name, status, self._pause_s)
        self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)

    def stop(self) -> None:
        """End it; killed where it does not end in time."""
        if self._process is None:
            return
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(VIEWER_STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._ended()

    def _start(self) -> None:
        self._lines.clear()
        # Its standard input is a pipe from this process: the child ends when it closes, also when this process is killed.
        self._process = subprocess.Popen(
            self._command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            errors="replace", start_new_session=True,
        )  # fmt: skip
        self._started_s = self._clock()
        self.restarts += 1
        assert self._process.stderr is not None
        self._reader = threading.Thread(target=self._read, args=(self._process.stderr,), name=self._name, daemon=True)
        self._reader.start()

    def _read(self, stream: IO[str]) -> None:
        for line in stream:
            text = printable(line.rstrip(), MAX_LINE)
            self._lines.append(text)
            logger.warning("%s: %s", self._name, text)

    def _ended(self) -> None:
        assert self._process is not None
        assert self._reader is not None
        self._reader.join(1.0)
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process = None
