"""Latency and loss of frame sets, from their arrival times at the measuring subscriber.  Pure.

The load follows a fixed schedule: frame k of every viewer is due at `epoch_ns` + k / rate.  The latency of a frame set
counts from the due time, independent of the actual capture time; a frame set that never arrives is lost, not omitted.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil

import numpy as np

PERCENTILES = (50.0, 95.0, 99.0, 99.9)
EDGES_MS = tuple(float(edge) for edge in np.round(np.geomspace(0.5, 8192.0, 57), 3))  # four bins for each doubling


@dataclass
class Arrivals:
    """Arrival times by rig: of poses of all views (whole) and of some (partial), and of each view's own message.

    Times are nanoseconds of this machine's clock; frame sets are identified by frame number.
    """

    whole: dict[str, dict[int, int]] = field(default_factory=dict)
    partial: dict[str, dict[int, int]] = field(default_factory=dict)
    views: dict[str, dict[int, dict[str, int]]] = field(default_factory=dict)

    def pose(self, rig: str, frame: int, received_ns: int, *, whole: bool) -> None:
        """Add the arrival of a pose; only the first of a frame set counts."""
        (self.whole if whole else self.partial).setdefault(rig, {}).setdefault(frame, received_ns)

    def view(self, rig: str, viewer: str, frame: int, received_ns: int, count: int = 0) -> None:
        """Add the arrival of a view.  count: number of views that complete a frame set; 0 where a pose does."""
        views = self.views.setdefault(rig, {}).setdefault(frame, {})
        views.setdefault(viewer, received_ns)
        if count and len(views) == count:
            self.pose(rig, frame, max(views.values()), whole=True)


@dataclass(frozen=True)
class DueWindow:
    """The frame sets due from start_ns to before end_ns.  rate: frames per second."""

    epoch_ns: int
    rate: float
    start_ns: int
    end_ns: int

    @property
    def frames(self) -> range:
        first, end = ((ns - self.epoch_ns) * self.rate / 1e9 for ns in (self.start_ns, self.end_ns))
        return range(max(0, ceil(first - 1e-6)), max(0, ceil(end - 1e-6)))

    @property
    def seconds(self) -> float:
        return (self.end_ns - self.start_ns) / 1e9

    def due_ns(self, frame: int) -> int:
        return self.epoch_ns + round(frame * 1e9 / self.rate)


@dataclass(frozen=True)
class Figures:
    """offered, completed, partial, lost: frame sets.  Offered and completed frames per second are of all viewers together.

    latency_ms, view_ms, skew_ms: percentiles by name, of the pose (or the last silhouette), of each view's own message,
    and of the time between a frame set's first and last view at this subscriber; empty without any.
    growth_ms: median latency of the last fifth of the frame sets minus that of the first fifth.  histogram: of
    latencies, by EDGES_MS: below the first edge, between two, above the last.
    """

    offered: int
    completed: int
    partial: int
    lost: int
    offered_fps: float
    completed_fps: float
    latency_ms: Mapping[str, float]
    view_ms: Mapping[str, float]
    skew_ms: Mapping[str, float]
    growth_ms: float
    histogram: tuple[int, ...]

    @property
    def loss(self) -> float:
        """Share of the offered frame sets that did not arrive complete."""
        return 1.0 - self.completed / self.offered if self.offered else 0.0

    def held(self, period_s: float) -> bool:
        """Whether nothing is lost, 99 % arrive within a frame period, and no backlog grows."""
        p99_ms = self.latency_ms.get("p99", float("inf"))
        return self.offered == self.completed > 0 and p99_ms <= 1e3 * period_s and self.growth_ms <= 1e3 * period_s


def figures(arrivals: Arrivals, window: DueWindow, rigs: Sequence[str], viewers: int) -> Figures:
    """Figures of the frame sets of `rigs` in a window.  viewers: number per rig."""
    due = window.frames
    latencies = np.array(list(_latencies(arrivals.whole, window, rigs)))
    partial = sum(k in arrivals.partial.get(rig, {}) and k not in arrivals.whole.get(rig, {}) for rig in rigs for k in due)
    offered, completed = len(due) * len(rigs), len(latencies)
    each = [arrivals.views[rig][k] for rig in rigs for k in due if k in arrivals.views.get(rig, {})]
    whole = [list(views.values()) for views in each if len(views) == viewers]
    view_ms = [
        (ns - window.due_ns(k)) / 1e6 for rig in rigs for k in due for ns in arrivals.views.get(rig, {}).get(k, {}).values()
    ]
    per_second = viewers / window.seconds if window.seconds > 0 else 0.0
    bins = np.bincount(np.searchsorted(EDGES_MS, latencies, side="right"), minlength=len(EDGES_MS) + 1)
    return Figures(
        offered=offered, completed=completed, partial=partial, lost=offered - completed - partial,
        offered_fps=offered * per_second, completed_fps=completed * per_second, latency_ms=percentiles(latencies),
        view_ms=percentiles(view_ms), skew_ms=percentiles([(max(times) - min(times)) / 1e6 for times in whole]),
        growth_ms=_growth(arrivals.whole, window, rigs), histogram=tuple(int(count) for count in bins),
    )  # fmt: skip


def percentiles(values: Sequence[float] | np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> dict[str, float]:
    """p50, p95, p99, p99.9 and the largest, by name; empty without values."""
    if not len(values):
        return {}
    named = {
        f"p{percent:g}": float(value)
        for percent, value in zip(PERCENTILES, np.percentile(values, PERCENTILES), strict=True)
    }
    return {**named, "max": float(np.max(values))}


def _latencies(whole: Mapping[str, Mapping[int, int]], window: DueWindow, rigs: Sequence[str]) -> Iterator[float]:
    """Latencies in milliseconds, in the order of frame sets."""
    for frame in window.frames:
        for rig in rigs:
            if frame in whole.get(rig, {}):
                yield (whole[rig][frame] - window.due_ns(frame)) / 1e6


def _growth(whole: Mapping[str, Mapping[int, int]], window: DueWindow, rigs: Sequence[str]) -> float:
    in_order = list(_latencies(whole, window, rigs))
    fifth = len(in_order) // 5
    return float(np.median(in_order[-fifth:]) - np.median(in_order[:fifth])) if fifth else 0.0
