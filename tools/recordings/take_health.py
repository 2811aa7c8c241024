"""Health of the services over a take."""

from collections import Counter
from dataclasses import dataclass, field

from zenocap.common import messages as m


@dataclass(frozen=True)
class ServiceHealth:
    """Health of one service over a take.

    reports: of health.  state: the last.  clock_offset_ms: the largest.  counts: summed over restarts, without zeros.
    """

    service: str
    id: str
    reports: int
    state: str
    clock_offset_ms: float
    clock_error_ms: float
    memory_mb: float
    counts: dict[str, int]


@dataclass
class HealthTally:
    reports: int = 0
    state: str = ""
    offset_ns: int = 0
    error_ns: int = 0
    memory_bytes: int = 0
    last: dict[str, int] = field(default_factory=dict)
    before: Counter[str] = field(default_factory=Counter)  # of processes before restarts

    def add(self, health: m.Health) -> None:
        self.reports += 1
        self.state = health.state
        self.memory_bytes = max(self.memory_bytes, health.memory_bytes)
        if abs(health.clock_offset_ns) >= abs(self.offset_ns):
            self.offset_ns, self.error_ns = health.clock_offset_ns, health.clock_error_ns
        for name, count in health.counts.items():
            if count < self.last.get(name, 0):
                self.before[name] += self.last[name]
            self.last[name] = count

    def health(self, service: str, id: str) -> ServiceHealth:
        counts = {name: self.before[name] + count for name, count in sorted(self.last.items())}
        return ServiceHealth(
            service=service,
            id=id,
            reports=self.reports,
            state=self.state,
            clock_offset_ms=self.offset_ns / 1e6,
            clock_error_ms=self.error_ns / 1e6,
            memory_mb=self.memory_bytes / 1e6,
            counts={name: count for name, count in counts.items() if count},
        )
