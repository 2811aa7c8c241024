"""Log control: logs are started and stopped on request while the service runs."""

import logging
import threading
from collections.abc import Callable, Mapping

from zenocap.common.bus.protocol import Bus, Envelope
from zenocap.common.messages import Request
from zenocap.common.recording.log import Log
from zenocap.common.recording.writer import RecordingError, Statistics
from zenocap.common.topics import REQUEST
from zenocap.services.integrator.parameters import LOG_REQUEST_WAIT_S

logger = logging.getLogger(__name__)


class LogControl:
    """Processes requests from `start` to `close` in its own thread, since opening and closing a file may take a while.

    bus: a reader for this object alone.  begin: creates a log, not started.  log: the first one; None to start without.
    """

    def __init__(self, bus: Bus, begin: Callable[[], Log], log: Log | None) -> None:
        self._bus, self._begin, self._log = bus, begin, log
        self._ended: list[Statistics] = []
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="log control", daemon=True)

    def start(self) -> None:
        if self._log is not None:
            self._log.start()
        self._bus.subscribe(REQUEST)
        self._thread.start()

    def counts(self) -> Mapping[str, int]:
        """Counts for the health: `log_on`, and those of the log."""
        with self._lock:
            log = self._log
        return {"log_on": int(log is not None)} | (log.counts() if log is not None else {})

    def close(self) -> list[Statistics]:
        """Stop the log.  Returns the statistics of all logs."""
        self._closing.set()
        self._bus.wake()
        self._thread.join()
        self._bus.close()
        self._close_log()
        return self._ended

    def _run(self) -> None:
        while not self._closing.is_set():
            match self._bus.receive(LOG_REQUEST_WAIT_S):
                case Envelope(message=Request(what="record")) if self._log is None:
                    self._start_log()
                case Envelope(message=Request(what="stop_recording")):
                    self._close_log()
                case _:
                    pass

    def _start_log(self) -> None:
        try:
            log = self._begin()
        except (RecordingError, OSError) as error:
            logger.error("a requested log was not started: %s", error)
            return
        log.start()
        with self._lock:
            self._log = log

    def _close_log(self) -> None:
        with self._lock:
            log, self._log = self._log, None
        if log is not None:
            self._ended.append(log.close())
