"""Result of a run: every round with its recovery, and all that is checked at the end."""

from dataclasses import dataclass, field

from benchmarks.chaos.observer import SeenPose
from benchmarks.chaos.running_rig import Seen
from benchmarks.chaos.schedule import Round
from benchmarks.chaos.takes import Content, Span

PATIENCE_S = 40.0  # for the recovery from a fault, before the run goes on
MARGIN_NS = 2_000_000_000  # around a fault in which what it does may be seen


@dataclass(frozen=True)
class Recovery:
    """poses_s, views_s, services_s: after the end of the fault; None: not within PATIENCE_S."""

    round: Round
    at_s: float
    begin_ns: int
    end_ns: int
    poses_s: float | None
    views_s: float | None
    services_s: float | None
    gap_s: float
    load: float


@dataclass
class RunOutcome:
    """Result of a run.  notes: what is worth knowing and no violation.  begin_ns: of the time for faults."""

    seed: int
    seconds: float
    begin_ns: int = 0
    recoveries: list[Recovery] = field(default_factory=list)
    violations: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    processes: list[Seen] = field(default_factory=list)
    takes: list[Content] = field(default_factory=list)
    poses: list[SeenPose] = field(default_factory=list)
    log_bytes: int = 0
    summary: str = ""

    def text(self) -> str:
        """What is worth knowing about the run, a line each."""
        sizes = [(rss, seen.name) for seen in self.processes for _, rss in seen.rss_bytes]
        largest = f"{max(sizes)[1]}, {max(sizes)[0] / 1e6:.0f} MB" if sizes else "none"
        return "\n".join([
            f"poses seen: {len(self.poses)}; takes: {len(self.takes)}, of them finished: "
            f"{sum(take.whole for take in self.takes)}; messages in them: {sum(take.messages for take in self.takes)}",
            f"log: {self.log_bytes / 1000:.0f} kB; largest process: {largest}",
            f"`zenocap up`: {self.summary}",
            *(f"note: {note}" for note in self.notes),
            *(f"violation: {text}" for text in self.violations),
        ])  # fmt: skip

    def run_s(self, time_ns: int) -> float:
        """Time of the run (s)."""
        return (time_ns - self.begin_ns) / 1e9

    def spans(self, name: str) -> list[Span]:
        """Times of the rounds with a kind or a target of faults."""
        return [
            (recovery.begin_ns, recovery.end_ns + MARGIN_NS)
            for recovery in self.recoveries
            if any(name in (fault.kind, fault.target) for fault in recovery.round.faults)
        ]
