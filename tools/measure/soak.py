"""Soak test: viewers are killed for hours; memory, handles, disk and latency stay flat."""

import os
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from zenocap.tools.measure.latency import DueWindow, Figures, figures
from zenocap.tools.measure.load_plan import LoadError, Plan
from zenocap.tools.measure.load_processes import Deployment, LoadProcesses
from zenocap.tools.measure.measurement import ReportProgress, receive, running
from zenocap.tools.measure.resources import ITSELF, SHARED_MEMORY, ProcessKey, ProcessSample, sample, stored, title
from zenocap.tools.measure.subscriber import LoadSubscriber

BUCKET_S = 10.0
ARRIVAL_S = 0.5  # seconds for frames that were due in the bucket and have not arrived
HISTORY_S = 60.0  # seconds of arrivals in memory
SETTLED_SHARE = 0.2  # share of the time after which the reference level is taken
FLAT_SHARE, FLAT_BYTES, FLAT_MS = 0.05, 4 << 20, 2.0  # increase that is flat: share, bytes, ms; by hand


@dataclass(frozen=True)
class Bucket:
    """Seconds of a soak up to `at_s`.  shared: bytes and files in shared memory.  disk: bytes of takes, and of others."""

    at_s: float
    figures: Figures
    samples: Mapping[ProcessKey, ProcessSample]
    shared: tuple[int, int]
    disk: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class Restart:
    """at_s: time of the kill.  back_s: time from then to the first complete frame set; None without one."""

    at_s: float
    title: str
    back_s: float | None


@dataclass(frozen=True)
class Trend:
    """One quantity: its level after settling and at the end, and whether that is flat."""

    what: str
    unit: str
    first: float
    last: float
    flat: bool


@dataclass(frozen=True)
class Soak:
    """failure: why it ended early, None if it did not.  dropped: messages that the subscriber dropped."""

    plan: Plan
    buckets: tuple[Bucket, ...] = ()
    restarts: tuple[Restart, ...] = ()
    dropped: int = 0
    failure: str | None = None

    @property
    def trends(self) -> tuple[Trend, ...]:
        return trends(self.buckets, {restart.title for restart in self.restarts})

    @property
    def flat(self) -> bool:
        return bool(self.buckets) and self.failure is None and all(trend.flat for trend in self.trends)


@dataclass
class _SoakState:
    takes: Path
    buckets: list[Bucket] = field(default_factory=list)
    restarts: list[Restart] = field(default_factory=list)
    killed_ns: int | None = None


def soak(
    plan: Plan, deployment: Deployment, minutes: float, restart_s: float, stopped: Callable[[], bool],
    report: ReportProgress,
) -> Soak:  # fmt: skip
    """Run for `minutes`; kill the last viewer of the first rig every `restart_s` seconds, 0 for never.

    Returns the measurements up to an interruption or failure.  Raises LoadError and BusError when it cannot start.
    """
    state, failure, dropped = _SoakState(deployment.takes), None, 0
    with running(plan, deployment, stopped, report) as (processes, subscriber, epoch_ns):
        subscriber.receive_for(plan.settle_s)
        started_ns, started_s = subscriber.now_ns, time.monotonic()
        restart_due_s, length_s = restart_s, 60.0 * minutes
        window = DueWindow(epoch_ns, plan.rate, started_ns, started_ns)
        while not stopped() and (elapsed_s := time.monotonic() - started_s) < length_s:
            report(f"{elapsed_s / 60:.1f} of {minutes:g} minutes, {len(state.restarts)} restarts", elapsed_s / length_s)
            if restart_s and elapsed_s >= restart_due_s:
                restart_due_s += restart_s
                _kill(plan, processes, subscriber, state, elapsed_s)
            try:
                window = DueWindow(epoch_ns, plan.rate, window.end_ns, window.end_ns)
                window = _bucket(plan, processes, subscriber, state, window, started_ns, stopped)
            except LoadError as error:
                failure = str(error)
                break
        dropped = subscriber.dropped
    return Soak(plan, tuple(state.buckets), tuple(state.restarts), dropped, failure)


def _kill(plan: Plan, processes: LoadProcesses, subscriber: LoadSubscriber, state: _SoakState, at_s: float) -> None:
    title = f"{plan.rig_names[0]} viewer {plan.views[-1]}"
    processes.kill(title)
    state.killed_ns = subscriber.now_ns
    state.restarts.append(Restart(at_s, title, None))


def _bucket(
    plan: Plan, processes: LoadProcesses, subscriber: LoadSubscriber, state: _SoakState, window: DueWindow, started_ns: int,
    stopped: Callable[[], bool],
) -> DueWindow:  # fmt: skip
    """Measure for BUCKET_S from the beginning of `window`; return the window with its end."""
    receive(processes, subscriber, BUCKET_S, stopped)
    window = replace(window, end_ns=subscriber.now_ns)
    subscriber.receive_for(ARRIVAL_S)
    samples = sample({**processes.pids(), ITSELF: os.getpid()})
    found = figures(subscriber.arrivals, window, plan.rig_names, plan.viewers)
    takes, everything = (stored(state.takes, pattern)[0] for pattern in ("**/*.mcap", "**/*"))
    disk, shared = (takes, everything - takes), stored(SHARED_MEMORY, "*")
    state.buckets.append(Bucket((window.end_ns - started_ns) / 1e9, found, samples, shared, disk))
    _note_recovery(plan, subscriber, state)
    subscriber.discard(window.end_ns - int(HISTORY_S * 1e9))
    return window


def _note_recovery(plan: Plan, subscriber: LoadSubscriber, state: _SoakState) -> None:
    """Store the time of the first complete frame set after the gap that a kill caused."""
    if state.killed_ns is None:
        return
    whole = sorted(ns for ns in subscriber.arrivals.whole.get(plan.rig_names[0], {}).values() if ns >= state.killed_ns)
    gaps = np.diff([state.killed_ns, *whole])
    if len(gaps) and (longest := int(np.argmax(gaps))) >= 0 and gaps[longest] > 3e9 * plan.period_s:
        last = state.restarts[-1]
        state.restarts[-1] = Restart(last.at_s, last.title, (whole[longest] - state.killed_ns) / 1e9)
        state.killed_ns = None


def trends(buckets: Sequence[Bucket], restarted: set[str]) -> tuple[Trend, ...]:
    """Trends of memory, handles and threads of processes that ran all the time, shared memory, disk and latency.

    The medians of the fifth after settling and of the last fifth are compared.  restarted: titles to leave out.
    """
    if len(buckets) < 5:
        return ()
    found = []
    series: defaultdict[tuple[ProcessKey, str], list[float]] = defaultdict(list)
    for bucket in buckets:
        for key, one in bucket.samples.items():
            for what, value in (("memory", one.memory_bytes), ("handles", one.handles), ("threads", one.threads)):
                series[key, what].append(value)
    for (key, what), values in sorted(series.items()):
        if title(key) not in restarted:
            slack = FLAT_BYTES if what == "memory" else 1.0
            found.append(_trend(f"{title(key)}: {what}", "bytes" if what == "memory" else "", values, slack))
    found.append(_trend("shared memory", "bytes", [bucket.shared[0] for bucket in buckets], FLAT_BYTES))
    takes, others = np.transpose([bucket.disk for bucket in buckets])
    fifth = len(buckets) // 5
    found.append(_trend("disk without takes: growth", "bytes", (others - others[0]).tolist(), FLAT_BYTES))
    found.append(_trend("takes of a fifth of the time", "bytes", (takes[fifth:] - takes[:-fifth]).tolist(), FLAT_BYTES))
    for name in ("p50", "p99"):
        latencies = [bucket.figures.latency_ms[name] for bucket in buckets if name in bucket.figures.latency_ms]
        if len(latencies) >= 5:
            found.append(_trend(f"latency {name}", "ms", latencies, FLAT_MS))
    return tuple(found)


def _trend(what: str, unit: str, values: Sequence[float], slack: float) -> Trend:
    fifth, settled = max(1, len(values) // 5), int(SETTLED_SHARE * len(values))
    first = float(np.median(values[settled : settled + fifth]))
    last = float(np.median(values[-fifth:]))
    return Trend(what, unit, first, last, last - first <= max(slack, FLAT_SHARE * first))
