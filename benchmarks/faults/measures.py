"""Figures of a fault from the messages received around it.  All times of receipt are by the observer's clock."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import msgspec

POSES = ("universal_bap", "tracker_pose")
SETTLED = 5  # consecutive poses from all viewers that count as recovered
GAP_NS = 500_000_000  # maximum interval between two of them (ns)
BEFORE_NS = 1_000_000_000


class ReceivedMessage(msgspec.Struct, frozen=True, array_like=True):
    """A received message.  missing_viewers: viewers with a stale part of a pose, or "lost".  state: of a health message."""

    received_ns: int
    topic: str
    sender: str
    frame: int
    captured_ns: int
    missing_viewers: tuple[str, ...] = ()
    state: str = ""

    @property
    def whole(self) -> bool:
        return self.topic in POSES and not self.missing_viewers


@dataclass(frozen=True)
class Window:
    """Begin and end of a fault, and `until`, the end of the observation (ns)."""

    begin_ns: int
    end_ns: int
    until_ns: int


@dataclass(frozen=True)
class Figures:
    """poses, whole: fraction of the poses due during the fault that arrived, and that arrived with all viewers.

    others: fraction of the frames due from unaffected viewers that arrived during the fault.
    gap_s: the longest time without a pose.  recovered_s: from the end of the fault to continuous poses of all viewers; None
    without them.  lost: missing frames by viewer, during the fault and until `until`.
    after_lost: those of them captured later than a second after the recovery.
    """

    poses: float
    whole: float
    others: float
    gap_s: float
    recovered_s: float | None
    lost: dict[str, int]
    after_lost: int


def figures(events: Sequence[ReceivedMessage], window: Window, fps: float, affected: Sequence[str]) -> Figures:
    """Figures of a fault.  affected: ids of the viewers that the fault affects."""
    poses = [event for event in events if event.topic in POSES]
    during = [pose for pose in poses if window.begin_ns <= pose.received_ns < window.end_ns]
    due = max(1.0, (window.end_ns - window.begin_ns) / 1e9 * fps)
    recovered_ns = recovery_ns(poses, window)
    viewers = sorted(
        {event.sender.removeprefix("viewer ") for event in events if event.topic in ("sighting", "silhouette")}
    )
    missing = {viewer: missing_frames(events, viewer, window) for viewer in viewers}
    others = [viewer for viewer in viewers if viewer not in affected]
    late_ns = window.until_ns if recovered_ns is None else recovered_ns + 1_000_000_000
    return Figures(
        poses=min(1.0, len(during) / due),
        whole=min(1.0, sum(pose.whole for pose in during) / due),
        others=_share(events, others, window, due),
        gap_s=longest_gap_s(poses, window),
        recovered_s=None if recovered_ns is None else max(0.0, (recovered_ns - window.end_ns) / 1e9),
        lost={viewer: len(times) for viewer, times in missing.items() if times},
        after_lost=sum(time_ns > late_ns for times in missing.values() for time_ns in times),
    )


def recovery_ns(events: Sequence[ReceivedMessage], window: Window) -> int | None:
    """Time of the first of SETTLED consecutive poses from all viewers after the fault (ns); None without any."""
    after = [e for e in events if e.topic in POSES and window.end_ns <= e.received_ns <= window.until_ns]
    consecutive: list[ReceivedMessage] = []
    for pose in after:
        if not pose.whole or (consecutive and pose.received_ns - consecutive[-1].received_ns > GAP_NS):
            consecutive = []
        if pose.whole:
            consecutive.append(pose)
        if len(consecutive) >= SETTLED:
            return consecutive[0].received_ns
    return None


def longest_gap_s(poses: Sequence[ReceivedMessage], window: Window) -> float:
    """Longest interval between poses (s), from a second before the fault on; the fault's duration without poses."""
    times = [pose.received_ns for pose in poses if window.begin_ns - BEFORE_NS <= pose.received_ns <= window.until_ns]
    times = [window.begin_ns, window.until_ns] if not times else [*times, window.until_ns]
    return max((later - earlier for earlier, later in pairwise(times)), default=0) / 1e9


def missing_frames(events: Sequence[ReceivedMessage], viewer: str, window: Window) -> list[int]:
    """Approximate capture times (ns) of frames without sighting or silhouette, from gaps in the frame numbers.

    A restarted viewer continues with the current frame number, so that its pause is such a gap, too.
    """
    capture_times = {
        event.frame: event.captured_ns
        for event in events
        if event.sender == f"viewer {viewer}" and event.topic in ("sighting", "silhouette")
    }
    frames = sorted(capture_times)
    found = []
    for earlier, later in pairwise(frames):
        step_ns = (capture_times[later] - capture_times[earlier]) / (later - earlier)
        found += [int(capture_times[earlier] + k * step_ns) for k in range(1, later - earlier)]
    return [time_ns for time_ns in found if window.begin_ns - BEFORE_NS <= time_ns <= window.until_ns]


def _share(events: Sequence[ReceivedMessage], viewers: Sequence[str], window: Window, due: float) -> float:
    """Share of the frames expected from `viewers` during the fault that arrived; 1 without viewers."""
    if not viewers:
        return 1.0
    names = {f"viewer {viewer}" for viewer in viewers}
    frames = {
        (event.sender, event.frame)
        for event in events
        if event.sender in names
        and event.topic in ("sighting", "silhouette")
        and window.begin_ns <= event.received_ns < window.end_ns
    }
    return min(1.0, len(frames) / (due * len(viewers)))
