"""What a live take of a rig with the tracker lost, from its messages, input traces and health counts.  Pure."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import Handled, Health, Silhouette, TrackerPose
from zenocap.common.runtime.input_trace import FRAME, TICK
from zenocap.common.topics import SILHOUETTE

# Counts of healths that must be 0: messages dropped or rejected by a queue, failed steps, log entries not written.
FORBIDDEN = ("dropped_queue_full", "dropped_too_many_keys", "rejected_invalid", "step_errors", "unsendable", "failed",
             "damaged", "log_lost", "log_stopped")  # fmt: skip
WAITING = 8  # instants that may wait in the tracker when it is stopped, see `synchronizer.KEPT_WAITING`

ServiceName = tuple[str, str]  # service and id


@dataclass
class LiveTake:
    """Content of a take.  rig: its name.  traces: by service, in order.  silhouettes: frame by viewer and capture time.

    poses: by frame, (log time, capture time).  healths: the last of each service.
    """

    rig: str
    traces: dict[ServiceName, list[Handled]] = field(default_factory=dict)
    silhouettes: dict[tuple[str, int], int] = field(default_factory=dict)
    poses: dict[int, tuple[int, int]] = field(default_factory=dict)
    healths: dict[ServiceName, Health] = field(default_factory=dict)

    def inputs(self, until_ns: int | None = None) -> Sequence[tuple[str, int]]:
        """Inputs of the tracker: key and time.  until_ns: up to its first report at that time or later; default: all."""
        found = []
        for trace in (trace for name, some in self.traces.items() if name[0] == "tracker" for trace in some):
            found += [(trace.keys[index], time_ns) for index, time_ns in trace.events]
            if until_ns is not None and trace.captured_ns >= until_ns:
                break
        return found


@dataclass(frozen=True)
class Account:
    """Loss of a take.  Only `dropped` and `alone` are allowed to be more than 0.

    restarts: of services.  trace_gaps: input traces missing in the log.  unlogged: frames of viewers whose silhouette is
    not in the log.  undelivered: logged silhouettes that the tracker did not receive.  instants: received by the tracker,
    of which tracked: processed, dropped: counted at its queue, alone: counted because of too few views, and waiting: the
    others, in its queue at the end.  forbidden: counts of FORBIDDEN above 0, by service.
    """

    restarts: int
    trace_gaps: int
    unlogged: int
    undelivered: int
    instants: int
    tracked: int
    dropped: int
    alone: int
    forbidden: Mapping[str, int]

    @property
    def waiting(self) -> int:
        return self.instants - self.tracked - self.dropped - self.alone

    @property
    def problems(self) -> list[str]:
        """What was lost besides whole instants, in words."""
        found = [f"{count} {name}" for name, count in self.forbidden.items()]
        for name in ("restarts", "trace_gaps", "unlogged", "undelivered"):
            if getattr(self, name):
                found.append(f"{getattr(self, name)} {name.replace('_', ' ')}")
        if not 0 <= self.waiting <= WAITING:
            found.append(f"{self.waiting} instants neither tracked nor counted")
        return found


@dataclass(frozen=True)
class Window:
    """Figures of a part of a take.  due: instants by the frame rate.  seen: by all viewers.  latency: p50, p99 and largest,
    milliseconds from capture to the log of the pose."""

    due: int
    seen: int
    poses: int
    latency_ms: tuple[float, float, float]


def content(messages: Iterable[Envelope], rig: str) -> LiveTake:
    """Content of the messages of a rig."""
    take = LiveTake(rig)
    for received in messages:
        match received.message:
            case Handled() as trace:
                take.traces.setdefault((trace.service, trace.id), []).append(trace)
            case Silhouette(viewer=viewer, captured_ns=captured_ns, frame=frame):
                take.silhouettes[viewer, captured_ns] = frame
            case TrackerPose(frame=frame, captured_ns=captured_ns):
                take.poses[frame] = received.received_ns, captured_ns
            case Health(service=service, id=id) as health:
                take.healths[service, id] = health
    return take


def account(take: LiveTake) -> Account:
    """Loss of a take.  Instants are those up to the tracker's last health, after which it reports its inputs at once."""
    restarts = gaps = 0
    for traces in take.traces.values():
        restarts += sum(trace.first == 0 for trace in traces) - 1
        due = 0
        for trace in traces:
            gaps += trace.first not in (due, 0)
            due = trace.first + len(trace.events)
    viewers = {viewer for viewer, _ in take.silhouettes}
    keys = {SILHOUETTE.at(take.rig, viewer=viewer): viewer for viewer in viewers}
    received = {(keys[key], time_ns) for key, time_ns in take.inputs() if key in keys}
    unlogged = undelivered = 0
    for viewer in viewers:
        logged = {time_ns for one, time_ns in take.silhouettes if one == viewer}
        frames = {
            time_ns
            for trace in take.traces.get(("viewer", viewer), [])
            for index, time_ns in trace.events
            if trace.keys[index] == FRAME
        }
        unlogged += len({time_ns for time_ns in frames - logged if time_ns > min(logged)})  # before: without a background
        arrived = {time_ns for one, time_ns in received if one == viewer}
        if arrived:  # the tracker starts after the viewers, and may stop before them
            undelivered += sum(min(arrived) <= time_ns <= max(arrived) for time_ns in logged - arrived)
    counts: Counter[str] = Counter()
    for (service, _), health in take.healths.items():
        counts.update({f"{service}: {name}": health.counts.get(name, 0) for name in FORBIDDEN})
    tracker = next(health for (service, _), health in take.healths.items() if service == "tracker")
    inputs = take.inputs(tracker.captured_ns)
    instants = {take.silhouettes.get((keys[key], time_ns), time_ns) for key, time_ns in inputs if key in keys}
    return Account(
        restarts, gaps, unlogged, undelivered,
        instants=len(instants),
        tracked=sum(key == TICK for key, _ in inputs),
        dropped=tracker.counts.get("dropped_instants", 0),
        alone=tracker.counts.get("alone", 0),
        forbidden={name: count for name, count in counts.items() if count},
    )  # fmt: skip


def window(take: LiveTake, start_ns: int, end_ns: int, fps: float) -> Window:
    """Figures of what was captured from start_ns to before end_ns."""
    views: Counter[int] = Counter()
    for (_, captured_ns), frame in take.silhouettes.items():
        views[frame] += start_ns <= captured_ns < end_ns
    count = len({viewer for viewer, _ in take.silhouettes})
    ages = [(log_ns - taken_ns) / 1e6 for log_ns, taken_ns in take.poses.values() if start_ns <= taken_ns < end_ns]
    nan = float("nan")
    p50, p99, worst = np.percentile(ages, (50, 99, 100)).tolist() if ages else (nan,) * 3
    seen = sum(number == count for number in views.values())
    return Window(round((end_ns - start_ns) * fps / 1e9), seen, len(ages), (p50, p99, worst))
