"""The log that people end and begin on request, while the service in whose process it is goes on."""

import logging
import threading
from collections.abc import Callable, Mapping

from common.bus.protocol import Bus, Envelope
from common.messages import Request
from common.take.log import Log
from common.take.recording import RecordingError, Statistics
from common.topics import REQUEST

logger = logging.getLogger(__name__)

LOOK_S = 0.5


class Switch:
    """Heeds requests from `start` to `close`, in a thread of its own: opening and closing a file may take a while.

    bus: a reader of its own.  begin: a new log that is not started yet.  log: the first one; None to begin without.
    """

    def __init__(self, bus: Bus, begin: Callable[[], Log], log: Log | None) -> None:
        self._bus, self._begin, self._log = bus, begin, log
        self._ended: list[Statistics] = []
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._heed, name="log switch", daemon=True)

    def start(self) -> None:
        if self._log is not None:
            self._log.start()
        self._bus.subscribe(REQUEST)
        self._thread.start()

    def counts(self) -> Mapping[str, int]:
        """For the health: `log_on`, and what the log counts."""
        with self._lock:
            log = self._log
        return {"log_on": int(log is not None)} | (log.counts() if log is not None else {})

    def close(self) -> list[Statistics]:
        """End the log.  Returns how every one of them ended."""
        self._closing.set()
        self._bus.wake()
        self._thread.join()
        self._bus.close()
        self._end()
        return self._ended

    def _heed(self) -> None:
        while not self._closing.is_set():
            match self._bus.receive(LOOK_S):
                case Envelope(message=Request(what="record")) if self._log is None:
                    self._start_another()
                case Envelope(message=Request(what="stop_recording")):
                    self._end()
                case _:
                    pass

    def _start_another(self) -> None:
        try:
            log = self._begin()
        except (RecordingError, OSError) as error:
            logger.error("recording was asked for: %s", error)
            return
        log.start()
        with self._lock:
            self._log = log

    def _end(self) -> None:
        with self._lock:
            log, self._log = self._log, None
        if log is not None:
            self._ended.append(log.close())
