"""Health of the services over a take, and how long its rig was overloaded."""

from dataclasses import dataclass, field

from zenocap.common import messages as m
from zenocap.common.messages import PROCESS
from zenocap.common.observe.losses import MEASURED
from zenocap.common.observe.view import ServiceView, with_health
from zenocap.common.runtime.frame_rate import describe, share_of


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
    offset_ns: int = 0
    error_ns: int = 0
    memory_bytes: int = 0
    view: ServiceView = field(default_factory=lambda: ServiceView(False, 0))

    def add(self, health: m.Health) -> None:
        self.reports += 1
        self.memory_bytes = max(self.memory_bytes, health.memory_bytes)
        if abs(health.clock_offset_ns) >= abs(self.offset_ns):
            self.offset_ns, self.error_ns = health.clock_offset_ns, health.clock_error_ns
        self.view = with_health(self.view, health, health.captured_ns)

    def health(self, service: str, id: str) -> ServiceHealth:
        last = self.view.health
        assert last is not None, "one is made for the first health"
        summed = {name: self.view.total(name) for name in self.view.past.keys() - MEASURED}
        counts = sorted((last.counts | summed).items())
        return ServiceHealth(
            service=service, id=id, reports=self.reports, state=last.state, clock_offset_ms=self.offset_ns / 1e6,
            clock_error_ms=self.error_ns / 1e6, memory_mb=self.memory_bytes / 1e6,
            counts={name: count for name, count in counts if count > 0 and name != PROCESS},
        )  # fmt: skip


@dataclass(frozen=True)
class ReducedRate:
    """Frame rate of an overloaded rig.  seconds: below the rate of the rig, fps; lowest_fps: the lowest; reason: its text.

    thinned_s: seconds with fewer points and particles of the tracker.
    """

    seconds: float
    fps: float
    lowest_fps: float
    reason: str
    thinned_s: float


@dataclass
class RateTally:
    """Decisions on the frame rate.  since_ns, thin_ns: time since which rate and detail are reduced; None for full."""

    fps: float = 0.0
    lowest: m.FrameRate | None = None
    since_ns: int | None = None
    reduced_ns: int = 0
    thin_ns: int | None = None
    thinned_ns: int = 0

    def add(self, message: m.FrameRate | m.TrackerDetail) -> None:
        now_ns = message.captured_ns
        if isinstance(message, m.TrackerDetail):
            self.thinned_ns += 0 if self.thin_ns is None else max(0, now_ns - self.thin_ns)
            self.thin_ns = now_ns if message.share < 1 else None
            return
        self.fps = message.fps
        self.reduced_ns += 0 if self.since_ns is None else max(0, now_ns - self.since_ns)
        share = share_of(message).value
        self.since_ns = now_ns if share < 1 else None
        if share < 1 and (self.lowest is None or share < share_of(self.lowest).value):
            self.lowest = message

    def reduced(self, end_ns: int) -> ReducedRate | None:
        """The reduction up to the end of the take; None when every frame was processed in full detail."""
        reduced_ns = self.reduced_ns + (0 if self.since_ns is None else max(0, end_ns - self.since_ns))
        thinned_ns = self.thinned_ns + (0 if self.thin_ns is None else max(0, end_ns - self.thin_ns))
        if not reduced_ns and not thinned_ns:
            return None
        lowest = self.fps if self.lowest is None else self.fps * share_of(self.lowest).value
        return ReducedRate(reduced_ns / 1e9, self.fps, lowest, describe(self.lowest), thinned_ns / 1e9)
