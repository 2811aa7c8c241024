"""The log: everything on the rig, written in its own thread, so that a slow disk never delays the integrator."""

import logging
import threading
from time import monotonic

from common.bus.protocol import Bus, Envelope
from common.take.recording import Recording, Statistics
from common.topics import TOPICS

logger = logging.getLogger(__name__)

FLUSH_S = 1.0
DRAIN_S = 5.0  # longest wait at the end for what is still queued


class Log:
    """Records from `start` to `close`.  bus: a reader of its own (`bus.reader()`), whose queue is the log's buffer."""

    def __init__(self, bus: Bus, recording: Recording) -> None:
        self._bus = bus
        self._recording = recording
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="log", daemon=True)

    def start(self) -> None:
        for topic in TOPICS:
            self._bus.subscribe(topic, every=True)
        self._thread.start()

    @property
    def statistics(self) -> Statistics:
        """lost: by the disk and by the queue before it."""
        written = self._recording.statistics
        dropped = sum(self._bus.counters.dropped.values())
        return Statistics(written.messages, written.bytes, written.lost + dropped, written.failure, written.unshown)

    def counts(self) -> dict[str, int]:
        """For the health of the service that keeps this log."""
        now = self.statistics
        return {
            "log_messages": now.messages,
            "log_lost": now.lost,
            "log_stopped": int(now.failure is not None),
            "log_unshown": now.unshown,
        }

    def close(self) -> Statistics:
        """Write what is queued, finish the file, say what was written and lost."""
        self._bus.close()
        self._closing.set()
        self._bus.wake()
        if self._thread.ident is not None:
            self._thread.join(2 * DRAIN_S)
        if self._thread.is_alive():
            logger.error("%s: the disk does not answer; the file is left unfinished", self._recording.path)
        else:
            self._recording.close()
        end = self.statistics
        logger.log(
            logging.WARNING if end.lost else logging.INFO,
            "%s: %d messages, %d bytes, %d lost",
            self._recording.path,
            end.messages,
            end.bytes,
            end.lost,
        )
        return end

    def _write(self) -> None:
        flush_s = monotonic() + FLUSH_S
        end_s: float | None = None
        while self._recording.failure is None:
            closing = self._closing.is_set()
            event = self._bus.receive(0.0 if closing else FLUSH_S / 2)
            if isinstance(event, Envelope):
                self._recording.record(event)
            now_s = monotonic()
            if now_s >= flush_s:
                self._recording.flush()
                flush_s = now_s + FLUSH_S
            if closing:
                end_s = end_s or now_s + DRAIN_S
                if event is None or now_s > end_s:
                    return
        self._bus.close()
