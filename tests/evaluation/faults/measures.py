"""From what was heard around a fault to its figures.  Times of receipt are all by the observer's clock."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import msgspec

POSES = ("universal_bap", "tracker_pose")
SETTLED = 5  # whole poses in a row: recovered
GAP_NS = 500_000_000  # between two of them, at most
BEFORE_NS = 1_000_000_000


class Heard(msgspec.Struct, frozen=True, array_like=True):
    """without: viewers whose part of a pose is an old one, or "lost".  words: a health's state."""

    received_ns: int
    topic: str
    who: str
    frame: int
    captured_ns: int
    without: tuple[str, ...] = ()
    words: str = ""

    @property
    def whole(self) -> bool:
        return self.topic in POSES and not self.without


@dataclass(frozen=True)
class Window:
    """A fault lasts from begin to end; what follows until `until` is looked at, too.  Nanoseconds."""

    begin_ns: int
    end_ns: int
    until_ns: int


@dataclass(frozen=True)
class Figures:
    """poses, whole: of those due during the fault, the share that came, and that came from all viewers.

    others: of the frames due from viewers not concerned, the share that came during the fault.
    gap_s: the longest time without a pose.  recovered_s: from the end of the fault to poses of all viewers that go on; None
    when they did not.  lost: frames by viewer that never came, during the fault and until `until`.
    after_lost: those of them captured later than a second after the recovery.
    """

    poses: float
    whole: float
    others: float
    gap_s: float
    recovered_s: float | None
    lost: dict[str, int]
    after_lost: int


def figures(events: Sequence[Heard], window: Window, fps: float, concerned: Sequence[str]) -> Figures:
    """concerned: ids of the viewers that the fault hits."""
    poses = [event for event in events if event.topic in POSES]
    during = [pose for pose in poses if window.begin_ns <= pose.received_ns < window.end_ns]
    due = max(1.0, (window.end_ns - window.begin_ns) / 1e9 * fps)
    recovered_ns = recovery_ns(poses, window)
    viewers = sorted({event.who.removeprefix("viewer ") for event in events if event.topic in ("sighting", "silhouette")})
    missing = {viewer: missing_frames(events, viewer, window) for viewer in viewers}
    others = [viewer for viewer in viewers if viewer not in concerned]
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


def recovery_ns(events: Sequence[Heard], window: Window) -> int | None:
    """When the first of SETTLED whole poses in a row came, after the fault; None when they did not."""
    after = [e for e in events if e.topic in POSES and window.end_ns <= e.received_ns <= window.until_ns]
    row: list[Heard] = []
    for pose in after:
        if not pose.whole or (row and pose.received_ns - row[-1].received_ns > GAP_NS):
            row = []
        if pose.whole:
            row.append(pose)
        if len(row) >= SETTLED:
            return row[0].received_ns
    return None


def longest_gap_s(poses: Sequence[Heard], window: Window) -> float:
    """Seconds between two poses, from a second before the fault on; the fault's own time when none came."""
    times = [pose.received_ns for pose in poses if window.begin_ns - BEFORE_NS <= pose.received_ns <= window.until_ns]
    times = [window.begin_ns, window.until_ns] if not times else [*times, window.until_ns]
    return max((later - earlier for earlier, later in pairwise(times)), default=0) / 1e9


def missing_frames(events: Sequence[Heard], viewer: str, window: Window) -> list[int]:
    """About when frames were captured of which no sighting or silhouette came: gaps in their numbers, in nanoseconds.

    A viewer that was started again counts from where the performance is, so that its pause is such a gap, too.
    """
    said = {
        event.frame: event.captured_ns
        for event in events
        if event.who == f"viewer {viewer}" and event.topic in ("sighting", "silhouette")
    }
    frames = sorted(said)
    found = []
    for earlier, later in pairwise(frames):
        step_ns = (said[later] - said[earlier]) / (later - earlier)
        found += [int(said[earlier] + k * step_ns) for k in range(1, later - earlier)]
    return [time_ns for time_ns in found if window.begin_ns - BEFORE_NS <= time_ns <= window.until_ns]


def _share(events: Sequence[Heard], viewers: Sequence[str], window: Window, due: float) -> float:
    """Of the frames due from `viewers` while the fault lasted, the share that came; 1 without viewers."""
    if not viewers:
        return 1.0
    names = {f"viewer {viewer}" for viewer in viewers}
    frames = {
        (event.who, event.frame)
        for event in events
        if event.who in names
        and event.topic in ("sighting", "silhouette")
        and window.begin_ns <= event.received_ns < window.end_ns
    }
    return min(1.0, len(frames) / (due * len(viewers)))
