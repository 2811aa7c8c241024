"""Measurements of a service on itself, and its Health message."""

import os
import resource
import secrets
import sys
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from statistics import median

from zenocap.common.bus.certificate import WARNED_DAYS, expiry_text
from zenocap.common.bus.protocol import Counters
from zenocap.common.messages import PROCESS, SENT, Health, Phase
from zenocap.common.runtime.clock_offset import Offset

RING = 256  # durations kept per stage
WORK = ("step_", "publish")  # stages that occupy the loop; the others are ages
MOST_COUNTS = 64  # of a health message
FIRST = (SENT, PROCESS, "step_errors", "unsendable")  # beginnings of the counts that are never left out


class Meter:
    """Durations by stage, counts, and rates since the last report.

    processor_ns: processor time used by this process so far.  busy_ns: time of all steps and of publishing so far.
    process: number that another process of this name does not have; default: random.
    """

    def __init__(
        self, service: str, id: str, processor_ns: Callable[[], int] = time.process_time_ns, process: int | None = None
    ) -> None:
        self._service = service
        self._id = id
        self._processor_ns = processor_ns
        self._used_ns = processor_ns()
        self._reported_busy_ns = 0
        self._durations_ns: defaultdict[str, deque[int]] = defaultdict(lambda: deque(maxlen=RING))
        self._published: Counter[str] = Counter()
        self._frames = 0
        self._reports = 0
        self._since_ns: int | None = None
        self._process = secrets.randbits(48) if process is None else process
        self.counts: Counter[str] = Counter()
        self.busy_ns = 0

    def time(self, stage: str, duration_ns: int) -> None:
        self._durations_ns[stage].append(max(0, duration_ns))
        if stage.startswith(WORK):
            self.busy_ns += max(0, duration_ns)

    def frame(self) -> None:
        self._frames += 1
        self.counts["frames"] += 1

    def publish(self, topic: str) -> None:
        self._published[topic] += 1
        self.counts["published"] += 1

    def report(
        self, now_ns: int, elapsed_ns: int, phase: Phase, state: str, bus: Counters, offset: Offset | None
    ) -> Health:
        """Health since the last report.  state: text for display.

        Its rate is that of frames, or of the busiest topic when there are none.
        """
        seconds = (elapsed_ns - self._since_ns) / 1e9 if self._since_ns is not None else 0.0
        most = self._frames or max(self._published.values(), default=0)
        used_ns = self._processor_ns()
        counts = dict(self.counts) | {"received": bus.received, "queued": bus.queued}
        counts |= {f"rejected_{reason}": count for reason, count in bus.rejected.items()}
        counts |= {f"dropped_{reason}": count for reason, count in bus.dropped.items()}
        counts |= {f"{SENT}{topic}": count for topic, count in bus.sent.items()}  # before this health
        counts[PROCESS] = self._process
        if bus.certificate_days is not None:
            counts["certificate_days"] = max(0, bus.certificate_days)
            if bus.certificate_days <= WARNED_DAYS:
                state = f"{state[:900]}; {expiry_text(bus.certificate_days)}"
        health = Health(
            frame=self._reports, captured_ns=now_ns, service=self._service, id=self._id, state=state[:1000], phase=phase,
            rate=min(most / seconds, 1e6) if seconds > 0 else 0.0,
            stages_ms={stage: min(median(ring) / 1e6, 1e6) for stage, ring in sorted(self._durations_ns.items())[:32]},
            counts=dict(sorted(sorted(counts.items(), key=_less_needed)[:MOST_COUNTS])),
            clock_offset_ns=offset.offset_ns if offset else 0, clock_error_ns=offset.error_ns if offset else 0,
            memory_bytes=memory_bytes(), cores=min((used_ns - self._used_ns) / 1e9 / seconds, 1e4) if seconds > 0 else 0.0,
            busy=min((self.busy_ns - self._reported_busy_ns) / 1e9 / seconds, 1.0) if seconds > 0 else 0.0,
        )  # fmt: skip
        self._reports += 1
        self._since_ns = elapsed_ns
        self._used_ns = used_ns
        self._reported_busy_ns, self._frames = self.busy_ns, 0
        self._published.clear()
        return health


def _less_needed(count: tuple[str, int]) -> tuple[bool, str]:
    """Sort key of a count: where there are too many, the last ones are left out."""
    return not count[0].startswith(FIRST), count[0]


def memory_bytes() -> int:
    """Resident memory of this process; the peak on systems that provide only that."""
    with suppress(OSError):  # missing, or not to be opened because the table of open files is full
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
