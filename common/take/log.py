"""The log: everything on the rig, written in its own thread, so that a slow disk never delays the integrator."""

import logging
import threading
from collections.abc import Sequence
from time import monotonic, thread_time_ns

from common.bus.protocol import Bus, Envelope
from common.take.parts import Parts
from common.take.recording import Recording, Statistics
from common.take.space import Space
from common.topics import TOPICS, Topic

logger = logging.getLogger(__name__)

FLUSH_S = 1.0
DRAIN_S = 5.0  # longest wait at the end for what is still queued


class Log:
    """Records from `start` to `close`.  bus: a reader of its own (`bus.reader()`), whose queue is the log's buffer."""

    def __init__(self, bus: Bus, recording: Recording | Parts, topics: Sequence[Topic] = TOPICS) -> None:
        self._bus = bus
        self._recording = recording
        self._topics = topics
        self._space = Space(recording.path.parent)
        self._cpu_ns = 0
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="log", daemon=True)

    def start(self) -> None:
        if self._recording.failure is None:
            for topic in self._topics:
                self._bus.subscribe(topic, every=True)
        self._thread.start()

    @property
    def statistics(self) -> Statistics:
        """lost: by the disk and by the queue before it."""
        written = self._recording.statistics
        dropped = sum(self._bus.counters.dropped.values())
        return Statistics(written.messages, written.bytes, written.lost + dropped, written.failure, written.unshown)

    @property
    def cpu_ns(self) -> int:
        """Time of a processor that the log's thread has taken, up to the last second."""
        return self._cpu_ns

    @property
    def free_bytes(self) -> int | None:
        """Of the disk, at the last second; None where it is not known."""
        return self._space.free_bytes

    def counts(self) -> dict[str, int]:
        """For the health of the service that keeps this log."""
        now, free = self.statistics, self._space.free_bytes
        counts = {"log_messages": now.messages, "log_lost": now.lost, "log_stopped": int(now.failure is not None)}
        counts["log_unshown"] = now.unshown
        counts["log_rejected"] = sum(self._bus.counters.rejected.values())
        return counts if free is None else counts | {"log_free_mb": free // 1_000_000}

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
            logging.WARNING if end.lost or end.failure else logging.INFO,
            "%s: %d messages, %d bytes, %d lost%s",
            self._recording.path,
            end.messages,
            end.bytes,
            end.lost,
            ", stopped early" if end.failure else "",
        )
        return end

    def _write(self) -> None:
        flush_s = monotonic() + FLUSH_S
        end_s: float | None = None
        before = 0
        while self._recording.failure is None:
            closing = self._closing.is_set()
            event = self._bus.receive(0.0 if closing else FLUSH_S / 2)
            if isinstance(event, Envelope):
                self._recording.record(event)
            now_s = monotonic()
            if now_s >= flush_s:
                self._recording.flush()
                written = self._recording.statistics.bytes
                self._space.look((written - before) / (now_s - flush_s + FLUSH_S))
                flush_s, before = now_s + FLUSH_S, written
                self._cpu_ns = thread_time_ns()
            if closing:
                end_s = end_s or now_s + DRAIN_S
                if event is None or now_s > end_s:
                    break
        self._cpu_ns = thread_time_ns()
        self._bus.close()
