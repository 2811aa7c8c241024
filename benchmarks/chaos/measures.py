"""Figures of one fault from what an observer received around it, by the observer's clock."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from benchmarks.chaos.observer import SeenFrame, SeenPose, longest_gap_s, settled_ns

BEFORE_NS = 1_000_000_000


@dataclass(frozen=True)
class FaultWindow:
    """Begin and end of a fault, and `until`, the end of the observation (ns)."""

    begin_ns: int
    end_ns: int
    until_ns: int


def figures(
    poses: Sequence[SeenPose], frames: Mapping[str, Sequence[SeenFrame]], window: FaultWindow, fps: float,
    affected: Collection[str] = (),
) -> dict[str, float]:  # fmt: skip
    """Figures of a fault.  frames: by viewer, with their silhouettes.  affected: viewers that the fault affects.

    poses, whole: % of the poses due during the fault that arrived, and that arrived with all viewers.  others: % of the
    frames due from other viewers that arrived.  gap: the longest time without a pose (s).  recovered: from the end of the
    fault to continuous poses of all viewers (s); left out without them.  lost: missing frames of the affected viewers, and
    other lost: of the others, during the fault and until `until`.
    """
    during = [pose for pose in poses if window.begin_ns <= pose.received_ns < window.end_ns and not pose.lost]
    due = max(1.0, (window.end_ns - window.begin_ns) / 1e9 * fps)
    missing = {viewer: len(missing_frames(seen, window)) for viewer, seen in frames.items()}
    found = {
        "poses": 100.0 * min(1.0, len(during) / due),
        "whole": 100.0 * min(1.0, sum(pose.views == len(frames) for pose in during) / due),
        "others": 100.0 * _share([seen for viewer, seen in frames.items() if viewer not in affected], window, due),
        "gap": longest_gap_s(poses, window.begin_ns - BEFORE_NS, window.until_ns),
        "lost": sum(missing[viewer] for viewer in missing if viewer in affected),
        "other lost": sum(missing[viewer] for viewer in missing if viewer not in affected),
    }
    recovered_ns = recovery_ns(poses, window, len(frames))
    return found if recovered_ns is None else found | {"recovered": max(0.0, (recovered_ns - window.end_ns) / 1e9)}


def recovery_ns(poses: Sequence[SeenPose], window: FaultWindow, viewers: int) -> int | None:
    """Time of the first of some consecutive poses from all viewers after the fault (ns); None without any."""
    within = [pose for pose in poses if pose.received_ns <= window.until_ns]
    return settled_ns(within, window.end_ns, viewers)


def missing_frames(seen: Sequence[SeenFrame], window: FaultWindow) -> list[int]:
    """Approximate capture times (ns) of frames that were not received, from gaps in the frame numbers.

    A restarted viewer continues with the current frame number, so that its pause is such a gap, too.
    """
    captured_ns = {one.frame: one.captured_ns for one in seen}
    found = []
    for earlier, later in pairwise(sorted(captured_ns)):
        step_ns = (captured_ns[later] - captured_ns[earlier]) / (later - earlier)
        found += [int(captured_ns[earlier] + k * step_ns) for k in range(1, later - earlier)]
    return [time_ns for time_ns in found if window.begin_ns - BEFORE_NS <= time_ns <= window.until_ns]


def _share(viewers: Sequence[Sequence[SeenFrame]], window: FaultWindow, due: float) -> float:
    """Share of the frames expected from viewers during the fault that arrived; 1 without viewers."""
    if not viewers:
        return 1.0
    counts = [len({one.frame for one in seen if window.begin_ns <= one.received_ns < window.end_ns}) for seen in viewers]
    return min(1.0, sum(counts) / (due * len(viewers)))
