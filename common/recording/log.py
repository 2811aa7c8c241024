"""Recording of all topics of a rig in a separate thread, and a warning before the disk is full."""

import logging
import shutil
import threading
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import monotonic, thread_time_ns

from zenocap.common.bus.protocol import Alive, Bus, Envelope, Received
from zenocap.common.observe.account import METADATA, Account
from zenocap.common.observe.several_logs import ended, joined
from zenocap.common.recording.parts import Parts
from zenocap.common.recording.writer import Recording, Statistics
from zenocap.common.rig.services import ServiceKey
from zenocap.common.topics import HEALTH, TOPICS, Topic

logger = logging.getLogger(__name__)

FLUSH_S = 1.0  # period of writes to disk without messages; chosen by hand
FEW_BYTES = 1_000_000_000  # free space below which the disk is nearly full; chosen by hand
FEW_S = 600.0  # remaining recording time below which the disk is nearly full; chosen by hand
DRAIN_S = 5.0  # longest time to write queued messages at the end; chosen by hand


class Log:
    """Records topics between `start` and `close`.  bus: a separate reader (`bus.reader()`); its queue is the buffer.

    whole_rig: the bus receives every key of one rig, and all topics are recorded: messages that never arrive are counted,
    and each file ends with its `Account`.  own: see there.
    """

    def __init__(
        self, bus: Bus, recording: Recording | Parts, topics: Sequence[Topic] = TOPICS, *, whole_rig: bool = False,
        own: Collection[ServiceKey] = (),
    ) -> None:  # fmt: skip
        self._bus = bus
        self._recording = recording
        self._topics = topics
        self._whole_rig = whole_rig
        self._missing = 0, Account(own=own)  # in the files before, and in this one: one value, as other threads read it
        self._last = Account()  # at the end of the file before
        self._dropped = 0  # by the queue, during the files before
        self._left = 0  # messages that were in the queue at the end
        self._hang: str | None = None  # why the file is left unfinished
        if whole_rig:
            recording.closing = self._account
        self._space = DiskSpace(recording.path.parent)
        self.cpu_ns = 0  # processor time of the thread, updated once a second
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="log", daemon=True)

    def start(self) -> None:
        """Subscribe and start the thread."""
        self.subscribe()
        self._thread.start()

    def subscribe(self) -> None:
        if self._recording.failure is None:
            # The health last: when it arrives, all that was sent after it does.
            for topic in sorted(self._topics, key=lambda topic: topic is HEALTH):
                self._bus.subscribe(topic, every=True)
            if self._whole_rig:
                self._bus.watch_alive()

    @property
    def statistics(self) -> Statistics:
        """Statistics of the recording; `lost` includes messages that the queue or the network dropped, or left at the end.

        Those dropped by the queue have not arrived either: neither is counted twice.
        """
        written = self._recording.statistics
        dropped = sum(self._bus.counters.dropped.values())
        before, account = self._missing
        missing = before + account.missing
        return replace(
            written, lost=written.lost + max(dropped, missing) + self._left, failure=written.failure or self._hang,
            missing=max(0, missing - dropped),
        )  # fmt: skip

    @property
    def free_bytes(self) -> int | None:
        """Free space of the disk, updated once a second; None if unknown."""
        return self._space.free_bytes

    def counts(self) -> dict[str, int]:
        """Counts for the health of the service that owns the log."""
        now, free = self.statistics, self._space.free_bytes
        counts = {"log_messages": now.messages, "log_lost": now.lost, "log_stopped": int(now.failure is not None)}
        counts |= {"log_unshown": now.unconverted, "log_removed": now.removed}
        counts |= {"log_missing": now.missing} if now.missing else {}
        counts["log_rejected"] = sum(self._bus.counters.rejected.values())
        return counts if free is None else counts | {"log_free_mb": free // 1_000_000}

    def close(self) -> Statistics:
        """Write queued messages, finish the file, and log the statistics."""
        self._bus.close()
        self._closing.set()
        self._bus.wake()
        if self._thread.ident is not None:
            self._thread.join(2 * DRAIN_S)
        if self._thread.is_alive():
            self._hang = f"{self._recording.path}: the disk does not respond; the file is left unfinished"
            self._left = self._bus.counters.queued
            logger.error(self._hang)
        else:
            self._leave_rest()
            self._recording.close()
        end = self.statistics
        logger.log(
            logging.WARNING if end.incomplete else logging.INFO, "%s: %d messages, %d bytes, %d lost%s%s%s%s",
            self._recording.path, end.messages, end.bytes, end.lost,
            f" ({end.missing} of them never arrived: dropped by the network)" if end.missing else "",
            f", {self._left} of them still in the queue at the end" if self._left else "",
            ", stopped early" if end.failure else "",
            f"; files deleted or moved while they were written: {end.removed}" if end.removed else "",
        )  # fmt: skip
        return end

    def _write(self) -> None:
        flush_s = monotonic() + FLUSH_S
        end_s: float | None = None
        before = 0
        while self._recording.failure is None:
            closing = self._closing.is_set()
            event = self._bus.receive(0.0 if closing else FLUSH_S / 2)
            self.handle(event)
            now_s = monotonic()
            if now_s >= flush_s:
                self._recording.flush()
                written = self._recording.statistics.bytes
                self._space.check((written - before) / (now_s - flush_s + FLUSH_S))
                flush_s, before = now_s + FLUSH_S, written
                self.cpu_ns = thread_time_ns()
            if closing:
                end_s = end_s or now_s + DRAIN_S
                if now_s > end_s or (event is None and not self._bus.counters.queued):  # None also amid invalid ones
                    break
        self.cpu_ns = thread_time_ns()
        self._bus.close()

    def handle(self, event: Received | None) -> None:
        """Write an event; called by the thread."""
        if isinstance(event, Envelope):
            self._recording.record(event)  # in a new file, if the one before is full: then its account is another one
        self._count(event)

    def _leave_rest(self) -> None:
        """Count what is still in the queue as received and not written."""
        while self._bus.counters.queued:
            event = self._bus.receive(0.0)
            self._left += isinstance(event, Envelope)
            self._count(event)

    def _count(self, event: Received | None) -> None:
        if self._whole_rig and isinstance(event, Envelope | Alive):
            self._missing[1].add(event)

    def _account(self) -> Mapping[str, Mapping[str, str]]:
        """The account of a file, at its end; that of the next begins."""
        before, account = self._missing
        dropped = sum(self._bus.counters.dropped.values())
        account.dropped, self._dropped = dropped - self._dropped, dropped
        both = joined(self._last, account, continued=self._last.end_ns > 0)  # with what is missing between both
        self._missing, self._last = (before + both.missing, Account(own=account.own)), ended(both)
        return {METADATA: account.metadata()}


class DiskSpace:
    """Free space of the disk of `folder`; warns each time it becomes nearly full."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._warned = False
        self.free_bytes: int | None = None  # at the last check; None if unknown

    def check(self, bytes_per_s: float) -> None:
        """Check the free space.  bytes_per_s: current rate of writing."""
        try:
            self.free_bytes = shutil.disk_usage(self._folder).free
        except OSError:
            self.free_bytes = None
            return
        warning = shortage(self.free_bytes, bytes_per_s)
        if warning and not self._warned:
            logger.warning("%s: %s", self._folder, warning)
        self._warned = warning is not None


def shortage(free_bytes: int, bytes_per_s: float) -> str | None:
    """Warning when less than FEW_BYTES or FEW_S are left, else None."""
    left_s = free_bytes / bytes_per_s if bytes_per_s > 0 else float("inf")
    if free_bytes >= FEW_BYTES and left_s >= FEW_S:
        return None
    lasts = f", {left_s / 60:.0f} minutes at the current rate" if left_s < 100 * FEW_S else ""
    return f"the disk is nearly full: {free_bytes / 1e6:.0f} MB free{lasts}"
