"""What a live take of a rig with the tracker lost, from its messages, input traces and health counts.  Pure."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import Handled, Health, Silhouette, TrackerPose
from zenocap.common.runtime.input_trace import FRAME, TICK
from zenocap.common.synchronizer import FrameSet
from zenocap.common.topics import SILHOUETTE
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.tracking import Setup

# Counts of healths that must be 0: messages dropped or rejected by a queue, failed steps, log entries not written.
FORBIDDEN = ("dropped_queue_full", "dropped_too_many_keys", "rejected_invalid", "step_errors", "unsendable", "failed",
             "damaged", "log_lost", "log_stopped")  # fmt: skip

ServiceName = tuple[str, str]  # service and id


@dataclass
class LiveTake:
    """Content of a take.  rig: its name.  traces: by service, in order.  silhouettes: frame by viewer and capture time.

    poses: by frame, (log time, capture time).  healths: the last of each service.  inputs: silhouettes and healths of the
    viewers, by key and capture time.
    """

    rig: str
    traces: dict[ServiceName, list[Handled]] = field(default_factory=dict)
    silhouettes: dict[tuple[str, int], int] = field(default_factory=dict)
    poses: dict[int, tuple[int, int]] = field(default_factory=dict)
    healths: dict[ServiceName, Health] = field(default_factory=dict)
    inputs: dict[tuple[str, int], Envelope] = field(default_factory=dict)

    def handled(self, until_ns: int | None = None) -> Sequence[tuple[str, int]]:
        """Inputs of the tracker: key and time.  until_ns: up to its first report at that time or later; default: all."""
        found = []
        for trace in (trace for name, some in self.traces.items() if name[0] == "tracker" for trace in some):
            found += [(trace.keys[index], time_ns) for index, time_ns in trace.events]
            if until_ns is not None and trace.captured_ns >= until_ns:
                break
        return found


@dataclass(frozen=True)
class Fates:
    """Frame numbers of the instants whose silhouettes reached the tracker, up to its last health.

    tracked: processed.  dropped: at its queue.  waiting: in the queue at the end.  single: of one view only.  unpaired:
    the others, whose views came too far apart.  counts: of the tracker's losses, as it must have counted them.
    """

    tracked: frozenset[int]
    dropped: frozenset[int]
    waiting: frozenset[int]
    single: frozenset[int]
    unpaired: frozenset[int]
    counts: Mapping[str, int]


@dataclass(frozen=True)
class Account:
    """Loss of a take.  fates: of the instants; what was dropped, single or unpaired is allowed if it was counted.

    restarts: of services.  trace_gaps: input traces missing in the log.  unlogged: frames of viewers whose silhouette is
    not in the log.  undelivered: logged silhouettes that the tracker did not receive.  without_pose: processed instants
    after the first pose.  counts: of FORBIDDEN above 0 by service, and those of the tracker that differ from its inputs.
    """

    fates: Fates
    restarts: int
    trace_gaps: int
    unlogged: int
    undelivered: int
    without_pose: int
    counts: Mapping[str, str]

    @property
    def problems(self) -> list[str]:
        """What was lost besides whole instants, in words."""
        found = [f"{name} {text}" for name, text in self.counts.items()]
        for name in ("restarts", "trace_gaps", "unlogged", "undelivered", "without_pose"):
            if getattr(self, name):
                found.append(f"{getattr(self, name)} {name.replace('_', ' ')}")
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
                take.inputs[received.key, captured_ns] = received
            case TrackerPose(frame=frame, captured_ns=captured_ns):
                take.poses[frame] = received.received_ns, captured_ns
            case Health(service=service, id=id) as health:
                take.healths[service, id] = health
                if service == "viewer":
                    take.inputs[received.key, health.captured_ns] = received
    return take


def fates(take: LiveTake, setup: Setup) -> Fates:
    """Fates of the instants: the tracker's own steps on its recorded inputs, without the tracking.

    setup: of the tracker.
    """
    health = next(health for (service, _), health in take.healths.items() if service == "tracker")
    state = tracker.initial_state(setup)
    tracked: set[int] = set()
    dropped: set[int] = set()
    views: dict[int, set[str]] = {}
    for key, time_ns in take.handled(health.captured_ns):
        if key == TICK:
            tracked |= {_frame(one) for one in state.ready[:1]}
            state = replace(state, ready=state.ready[1:])
        elif (received := take.inputs.get((key, time_ns))) is not None:
            before = state.ready
            state, _ = tracker.step(setup, state, received)
            dropped |= {_frame(one) for one in before if not any(one is other for other in state.ready)}
            if isinstance(received.message, Silhouette):
                views.setdefault(received.message.frame, set()).add(received.message.viewer)
    waiting = {_frame(one) for one in state.ready}
    waiting |= {item.value.frame for items in state.pairs.waiting.values() for item in items}
    rest = set(views) - tracked - dropped - waiting
    single = {frame for frame in rest if len(views[frame]) == 1}
    return Fates(
        frozenset(tracked), frozenset(dropped), frozenset(waiting), frozenset(single), frozenset(rest - single),
        tracker.counts(state),
    )  # fmt: skip


def _frame(frame_set: FrameSet[Silhouette]) -> int:
    return max(silhouette.frame for silhouette in frame_set.items.values())


def account(take: LiveTake, setup: Setup) -> Account:
    """Loss of a take.  setup: of the tracker."""
    restarts = gaps = 0
    for traces in take.traces.values():
        restarts += sum(trace.first == 0 for trace in traces) - 1
        due = 0
        for trace in traces:
            gaps += trace.first not in (due, 0)
            due = trace.first + len(trace.events)
    viewers = {viewer for viewer, _ in take.silhouettes}
    keys = {SILHOUETTE.at(take.rig, viewer=viewer): viewer for viewer in viewers}
    received = {(keys[key], time_ns) for key, time_ns in take.handled() if key in keys}
    unlogged = undelivered = 0
    for viewer in viewers:
        logged = {time_ns for one, time_ns in take.silhouettes if one == viewer}
        frames = {
            time_ns
            for trace in take.traces.get(("viewer", viewer), [])
            for index, time_ns in trace.events
            if trace.keys[index] == FRAME
        }
        unlogged += sum(time_ns > min(logged) for time_ns in frames - logged)  # before: without a background
        arrived = {time_ns for one, time_ns in received if one == viewer}
        if arrived:  # the tracker starts after the viewers, and may stop before them
            undelivered += sum(min(arrived) <= time_ns <= max(arrived) for time_ns in logged - arrived)
    counts: dict[str, str] = {}
    for (service, id), health in take.healths.items():
        found = {name: health.counts.get(name, 0) for name in FORBIDDEN}
        counts |= {f"{service} {id}: {name}": str(count) for name, count in found.items() if count}
    every = fates(take, setup)
    ((name, counted),) = ((name, one.counts) for name, one in take.healths.items() if name[0] == "tracker")
    counts |= {
        f"{name[0]} {name[1]}: {reason}": f"{counted.get(reason, 0)} instead of {count}"
        for reason, count in every.counts.items()
        if counted.get(reason, 0) != count
    }
    first = min(take.poses, default=0)
    without_pose = sum(frame > first and frame not in take.poses for frame in every.tracked)
    return Account(every, restarts, gaps, unlogged, undelivered, without_pose, counts)


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
