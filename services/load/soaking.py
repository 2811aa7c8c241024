"""Running for hours while a viewer is killed and started again: is everything flat?"""

import os
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from services.load.crew import Crew
from services.load.heard import Figures, Window, figures
from services.load.listening import Listening
from services.load.plan import LoadError, Plan
from services.load.point import LOOK_S, Setting, Tell, running
from services.load.processes import ITSELF, Sample, Who, sample, shared_memory

BUCKET_S = 10.0
ON_THE_WAY_S = 0.5  # for what was due in the bucket and is still to come
KEPT_S = 60.0  # of what was heard
SETTLED = 0.2  # of the time: what is used then is compared with what is used in the end
GREW, GREW_BYTES, GREW_MS = 0.05, 4 << 20, 2.0  # that much more is still flat: a share, bytes, milliseconds


@dataclass(frozen=True)
class Bucket:
    """Some seconds of a soak.  at_s: their end, since the start.  shared: bytes and files in shared memory."""

    at_s: float
    figures: Figures
    samples: Mapping[Who, Sample]
    shared: tuple[int, int]


@dataclass(frozen=True)
class Restart:
    """at_s: of the kill.  back_s: from then to the first instant that was whole again; None if none came."""

    at_s: float
    title: str
    back_s: float | None


@dataclass(frozen=True)
class Trend:
    """One quantity: its level when settled and in the end, and whether that is flat."""

    what: str
    unit: str
    first: float
    last: float
    flat: bool


@dataclass(frozen=True)
class Soak:
    """failure: why it ended early, None if it did not.  unheard: messages that the measuring missed."""

    plan: Plan
    buckets: tuple[Bucket, ...] = ()
    restarts: tuple[Restart, ...] = ()
    unheard: int = 0
    failure: str | None = None

    @property
    def trends(self) -> tuple[Trend, ...]:
        return trends(self.buckets, {restart.title for restart in self.restarts})

    @property
    def flat(self) -> bool:
        return bool(self.buckets) and self.failure is None and all(trend.flat for trend in self.trends)


@dataclass
class _Running:
    buckets: list[Bucket] = field(default_factory=list)
    restarts: list[Restart] = field(default_factory=list)
    killed_ns: int | None = None


def soak(plan: Plan, setting: Setting, minutes: float, restart_s: float, stopped: Callable[[], bool], tell: Tell) -> Soak:
    """Run for so long; kill the last viewer of the first rig every `restart_s` seconds, 0 for never.

    What was measured until it was stopped, or failed, is returned.  Raises LoadError and BusError when it cannot start.
    """
    so_far, failure, unheard = _Running(), None, 0
    with running(plan, setting, stopped, tell) as (crew, listening, epoch_ns):
        listening.listen(plan.settle_s)
        started_ns, started_s = listening.now_ns, time.monotonic()
        restart_due_s, length_s = restart_s, 60.0 * minutes
        window = Window(epoch_ns, plan.rate, started_ns, started_ns)
        while not stopped() and (passed_s := time.monotonic() - started_s) < length_s:
            tell(f"{passed_s / 60:.1f} of {minutes:g} minutes, {len(so_far.restarts)} restarts", passed_s / length_s)
            if restart_s and passed_s >= restart_due_s:
                restart_due_s += restart_s
                _kill(plan, crew, listening, so_far, passed_s)
            try:
                window = Window(epoch_ns, plan.rate, window.end_ns, window.end_ns)
                window = _bucket(plan, crew, listening, so_far, window, started_ns, stopped)
            except LoadError as error:
                failure = str(error)
                break
        unheard = listening.dropped
    return Soak(plan, tuple(so_far.buckets), tuple(so_far.restarts), unheard, failure)


def _kill(plan: Plan, crew: Crew, listening: Listening, so_far: _Running, at_s: float) -> None:
    title = f"{plan.rig_names[0]} viewer {plan.views[-1]}"
    crew.kill(title)
    so_far.killed_ns = listening.now_ns
    so_far.restarts.append(Restart(at_s, title, None))


def _bucket(
    plan: Plan, crew: Crew, listening: Listening, so_far: _Running, window: Window, started_ns: int,
    stopped: Callable[[], bool],
) -> Window:  # fmt: skip
    """Measure for a while from the beginning of `window` on; the window with its end."""
    end_s = time.monotonic() + BUCKET_S
    while not stopped() and time.monotonic() < end_s:
        listening.listen(LOOK_S)
        crew.poll()
        if crew.failed:
            raise LoadError(f"{', '.join(crew.failed)} failed")
    window = replace(window, end_ns=listening.now_ns)
    listening.listen(ON_THE_WAY_S)
    samples = sample({**crew.pids(), ITSELF: os.getpid()})
    found = figures(listening.heard, window, plan.rig_names, plan.viewers)
    so_far.buckets.append(Bucket((window.end_ns - started_ns) / 1e9, found, samples, shared_memory()))
    _came_back(plan, listening, so_far)
    listening.forget(window.end_ns - int(KEPT_S * 1e9))
    return window


def _came_back(plan: Plan, listening: Listening, so_far: _Running) -> None:
    """Note when the first whole instant after a kill came: the first one after the gap that the kill made."""
    if so_far.killed_ns is None:
        return
    whole = sorted(ns for ns in listening.heard.whole.get(plan.rig_names[0], {}).values() if ns >= so_far.killed_ns)
    gaps = np.diff([so_far.killed_ns, *whole])
    if len(gaps) and (longest := int(np.argmax(gaps))) >= 0 and gaps[longest] > 3e9 * plan.period_s:
        last = so_far.restarts[-1]
        so_far.restarts[-1] = Restart(last.at_s, last.title, (whole[longest] - so_far.killed_ns) / 1e9)
        so_far.killed_ns = None


def trends(buckets: Sequence[Bucket], restarted: set[str]) -> tuple[Trend, ...]:
    """Memory, handles and threads of every process that lived all the time, shared memory, and latency.

    The medians of the fifth after settling and of the last fifth are compared.  restarted: titles to leave out.
    """
    if len(buckets) < 5:
        return ()
    found = []
    series: defaultdict[tuple[Who, str], list[float]] = defaultdict(list)
    for bucket in buckets:
        for who, one in bucket.samples.items():
            series[who, "memory"].append(one.memory_bytes)
            series[who, "handles"].append(one.handles)
            series[who, "threads"].append(one.threads)
    for (who, what), values in sorted(series.items()):
        title = " ".join(word for word in who if word and word != "main")
        if title not in restarted:
            slack = GREW_BYTES if what == "memory" else 1.0
            found.append(_trend(f"{title}: {what}", "bytes" if what == "memory" else "", values, slack))
    found.append(_trend("shared memory", "bytes", [bucket.shared[0] for bucket in buckets], GREW_BYTES))
    for name in ("p50", "p99"):
        latencies = [bucket.figures.latency_ms[name] for bucket in buckets if name in bucket.figures.latency_ms]
        if len(latencies) >= 5:
            found.append(_trend(f"latency {name}", "ms", latencies, GREW_MS))
    return tuple(found)


def _trend(what: str, unit: str, values: Sequence[float], slack: float) -> Trend:
    fifth, settled = max(1, len(values) // 5), int(SETTLED * len(values))
    first = float(np.median(values[settled : settled + fifth]))
    last = float(np.median(values[-fifth:]))
    return Trend(what, unit, first, last, last - first <= max(slack, GREW * first))
