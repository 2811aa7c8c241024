"""Log control: logs are started and stopped on request while the service runs.

Any member of an open network may publish a request, so at most one in LOG_REQUEST_PERIOD_S is obeyed: each start writes a
file with rig, calibration and models.
"""

import logging
import threading
from collections.abc import Callable, Mapping
from time import monotonic

from zenocap.common.bus.protocol import Bus, Envelope
from zenocap.common.messages import Request
from zenocap.common.recording.log import Log
from zenocap.common.recording.writer import RecordingError, Statistics
from zenocap.common.runtime.logs import OncePerInterval
from zenocap.common.topics import REQUEST
from zenocap.services.integrator.parameters import LOG_REQUEST_PERIOD_S, LOG_REQUEST_WAIT_S

logger = logging.getLogger(__name__)

REFUSED_LINE_S = 10.0  # between two log lines on refused requests; chosen by hand


class LogControl:
    """Processes requests from `start` to `close` in its own thread, since opening and closing a file may take a while.

    bus: a reader for this object alone.  begin: creates a log, not started.  log: the first one; None to start without.
    """

    def __init__(self, bus: Bus, begin: Callable[[], Log], log: Log | None, now_s: Callable[[], float] = monotonic) -> None:
        """now_s: monotonic time, seconds."""
        self._bus, self._begin, self._log, self._now_s = bus, begin, log, now_s
        self._obeyed_s = float("-inf")
        self._refusals = OncePerInterval(logger, REFUSED_LINE_S, now_s)
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
        """Counts for the health: `log_on`, those of the log, and `log_refused` requests if there are any."""
        with self._lock:
            log = self._log
        if self._closing.is_set():
            return self._final_counts()
        refused = self._refusals.counts.total()
        counts = {"log_on": int(log is not None)} | ({"log_refused": refused} if refused else {})
        return counts | (log.counts() if log is not None else {})

    def close(self) -> list[Statistics]:
        """Stop the log.  Returns the statistics of all logs.  Repeated calls have no effect."""
        self._closing.set()
        self._bus.wake()
        self._thread.join()
        self._bus.close()
        self._close_log()
        return self._ended

    def _run(self) -> None:
        while not self._closing.is_set():
            match self._bus.receive(LOG_REQUEST_WAIT_S):
                case Envelope(message=Request(what="record")) if self._log is None and self._may_obey("record"):
                    self._start_log()
                case Envelope(message=Request(what="stop_recording")) if self._log and self._may_obey("stop_recording"):
                    self._close_log()
                case _:
                    pass

    def _may_obey(self, what: str) -> bool:
        """Whether the last obeyed request is long enough ago; a refusal is counted and logged."""
        now_s = self._now_s()
        if now_s - self._obeyed_s >= LOG_REQUEST_PERIOD_S:
            self._obeyed_s = now_s
            return True
        text = f"request {what!r} refused: at most one start or stop of the log in {LOG_REQUEST_PERIOD_S:g} s is obeyed"
        self._refusals.handle(logging.LogRecord(logger.name, logging.WARNING, "", 0, text, (), None))
        return False

    def _final_counts(self) -> Mapping[str, int]:
        """Sums over all logs, after the end of the last."""
        ends = list(self._ended)
        counts = {"log_closed": 1, "log_on": 0, "log_messages": sum(end.messages for end in ends)}
        counts |= {"log_lost": sum(end.lost for end in ends), "log_removed": sum(end.removed for end in ends)}
        missing = sum(end.missing for end in ends)
        counts |= {"log_missing": missing} if missing else {}
        return counts | {"log_stopped": int(any(end.failure is not None for end in ends))}

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
