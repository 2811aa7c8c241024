"""Counts over the messages of a take as they are read, in bounded memory."""

from collections import Counter, deque
from collections.abc import Collection
from dataclasses import dataclass, field
from statistics import median

from zenocap.common import messages as m

MAX_HOLES = 1000  # stored, so that a late frame does not count as missing; chosen by hand
SHOWN_HOLES = 20  # in the text; chosen by hand
MAX_LATENCIES = 10_000  # of the latest commands; chosen by hand


@dataclass(frozen=True)
class ChannelStatistics:
    """One channel.  key: of the messages.  rate: per second between the first and the last; 0 for a single one.

    gap_s: longest time between two messages, which began gap_at_s after the take's start.
    """

    key: str
    schema: str
    encoding: str
    messages: int
    bytes: int
    rate: float
    gap_s: float
    gap_at_s: float


@dataclass
class ChannelTally:
    messages: int = 0
    bytes: int = 0
    first_ns: int = 0
    last_ns: int = 0
    gap_ns: int = 0
    gap_at_ns: int = 0

    def add(self, log_ns: int, size: int) -> None:
        if not self.messages:
            self.first_ns = self.last_ns = self.gap_at_ns = log_ns
        if log_ns - self.last_ns > self.gap_ns:
            self.gap_ns, self.gap_at_ns = log_ns - self.last_ns, self.last_ns
        self.messages += 1
        self.bytes += size
        self.first_ns, self.last_ns = min(self.first_ns, log_ns), max(self.last_ns, log_ns)

    def statistics(self, key: str, schema: str, encoding: str, start_ns: int) -> ChannelStatistics:
        """start_ns: of the take."""
        span_ns, gap_s, gap_at_s = self.last_ns - self.first_ns, self.gap_ns / 1e9, (self.gap_at_ns - start_ns) / 1e9
        rate = (self.messages - 1) * 1e9 / span_ns if span_ns > 0 else 0.0
        return ChannelStatistics(key, schema, encoding, self.messages, self.bytes, rate, gap_s, gap_at_s)


@dataclass(frozen=True)
class Frames:
    """One viewer's frames on one topic, by their numbers.

    missing: numbers between first and last without message.  holes: the first 20 runs of them, (first, last).
    restarts: how often the numbers restarted.
    """

    viewer: str
    topic: str
    first: int
    last: int
    seen: int
    missing: int
    restarts: int
    holes: tuple[tuple[int, int], ...]


@dataclass
class FrameTally:
    first: int = -1
    last: int = -1
    seen: int = 0
    missing: int = 0
    restarts: int = 0
    holes: list[list[int]] = field(default_factory=list)

    def add(self, frame: int) -> None:
        self.seen += 1
        if self.first < 0:
            self.first = self.last = frame
        elif frame > self.last:
            if frame > self.last + 1:
                self.missing += frame - self.last - 1
                if len(self.holes) < MAX_HOLES:
                    self.holes.append([self.last + 1, frame - 1])
            self.last = frame
        elif not self._fill(frame) and frame != self.last:
            self.restarts += 1
            self.last = frame

    def _fill(self, frame: int) -> bool:
        """Remove a late `frame` from the missing ones; returns whether it was one of them."""
        for k, (first, last) in enumerate(self.holes):
            if first <= frame <= last:
                rest = [part for part in ([first, frame - 1], [frame + 1, last]) if part[0] <= part[1]]
                self.holes[k : k + 1] = rest
                self.missing -= 1
                return True
        return False

    def frames(self, viewer: str, topic: str) -> Frames:
        holes = tuple((first, last) for first, last in self.holes[:SHOWN_HOLES])
        return Frames(viewer, topic, self.first, self.last, self.seen, self.missing, self.restarts, holes)


@dataclass
class Pairs:
    """Frame sets with an assignment by the integrator.

    complete: with a sighting of every viewer, of two or more.  one_viewer: with one or none.  stale: with an old part of
    some viewer.
    """

    instants: int = 0
    complete: int = 0
    one_viewer: int = 0
    stale: int = 0

    def add(self, assignment: m.Assignment) -> None:
        fresh = sum(not view.stale for view in assignment.views.values())
        self.instants += 1
        if fresh == len(assignment.views) and fresh > 1:
            self.complete += 1
        elif fresh <= 1:
            self.one_viewer += 1
        if fresh < len(assignment.views):
            self.stale += 1


@dataclass
class PoseStatistics:
    """Poses of the tracker.  lost: poses without a person.  views: number of poses by number of views.

    both_ways, both_ways_lost: number of poses of both passes, and those without a person.
    measured: False when the last body has average proportions.
    """

    poses: int = 0
    lost: int = 0
    views: dict[int, int] = field(default_factory=dict)
    both_ways: int = 0
    both_ways_lost: int = 0
    measured: bool = True

    def add(self, pose: m.TrackerPose) -> None:
        if isinstance(pose, m.BothWaysPose):
            self.both_ways += 1
            self.both_ways_lost += pose.lost
            return
        self.poses += 1
        self.lost += pose.lost
        self.views[len(pose.views)] = self.views.get(len(pose.views), 0) + 1


@dataclass
class Recognized:
    """Results of the recognizer.  labels: count by posture.  unknown: movements without a known posture."""

    answers: int = 0
    unknown: int = 0
    labels: dict[str, int] = field(default_factory=dict)

    def add(self, posture: m.Posture) -> None:
        self.answers += 1
        if posture.label is None:
            self.unknown += 1
        else:
            self.labels[posture.label] = self.labels.get(posture.label, 0) + 1


@dataclass(frozen=True)
class Commands:
    """Commands that postures triggered.  targets: count by action and target, done ones.

    Medians and largest values of the done ones: latency_ms from the pose by which the posture was recognized to the
    action, since_end_ms from the posture's last frame.
    """

    done: int
    failed: int
    dropped: int
    targets: dict[str, int]
    latency_ms: tuple[float, float]
    since_end_ms: tuple[float, float]


@dataclass
class CommandTally:
    outcomes: Counter[str] = field(default_factory=Counter)
    targets: Counter[str] = field(default_factory=Counter)
    latencies_ns: deque[int] = field(default_factory=lambda: deque(maxlen=MAX_LATENCIES))
    since_end_ns: deque[int] = field(default_factory=lambda: deque(maxlen=MAX_LATENCIES))

    def add(self, result: m.CommandResult) -> None:
        self.outcomes[result.outcome] += 1
        if result.outcome == "done":
            self.targets[f"{result.action} {result.target}"] += 1
            self.latencies_ns.append(result.latency_ns)
            self.since_end_ns.append(result.since_end_ns)

    def commands(self) -> Commands | None:
        """The commands; None without any."""
        if not self.outcomes:
            return None
        return Commands(
            done=self.outcomes["done"], failed=self.outcomes["failed"], dropped=self.outcomes["dropped"],
            targets=dict(sorted(self.targets.items())), latency_ms=_median_and_largest_ms(self.latencies_ns),
            since_end_ms=_median_and_largest_ms(self.since_end_ns),
        )  # fmt: skip


def _median_and_largest_ms(values_ns: Collection[int]) -> tuple[float, float]:
    return (median(values_ns) / 1e6, max(values_ns) / 1e6) if values_ns else (0.0, 0.0)
