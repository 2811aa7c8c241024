"""Grouping of messages into frame sets by capture time.  Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

T = TypeVar("T")

GONE_AFTER = 5  # frame sets without a viewer after which it is not waited for
LONG_NS, OUTDATED = 2_000_000_000, 30  # so many items in a row that are so late mean that the newest time was wrong
FARTHEST = 1.5  # half frame periods between items of a frame set, where no other item of these viewers is nearer
KEPT_WAITING = 8  # items of one viewer that may wait


@dataclass(frozen=True)
class Item(Generic[T]):
    """A value with its capture time on the integrator's clock, captured_ns."""

    captured_ns: int
    value: T


@dataclass(frozen=True)
class Synchronizer(Generic[T]):
    """waiting: items by viewer, oldest first.  missed: consecutive frame sets without a viewer.  counts: dropped items.

    tolerance_ns: half a frame period.  spacing: fewest frame periods between processed frames at times from spaced_ns,
    and spacing_before: at times before, see `common.runtime.frame_rate`.
    complete, incomplete: frame sets with and without all viewers that are waited for.
    hold: number of further items of the others that end the wait for a viewer.  Items of one whose delay is corrected
    arrive so many frame periods later than others of the same capture time.
    last_ns: time of the newest frame set returned.  given: each viewer's newest item in one.  outdated: consecutive items
    LONG_NS or more behind last_ns.  behind: by viewer, consecutive items that are so late relative to the waiting items of
    the same viewer.
    """

    viewers: tuple[str, ...]
    tolerance_ns: int
    waiting: Mapping[str, tuple[Item[T], ...]] = field(default_factory=dict)
    missed: Mapping[str, int] = field(default_factory=dict)
    last_ns: int = -1
    given: Mapping[str, int] = field(default_factory=dict)
    outdated: int = 0
    behind: Mapping[str, int] = field(default_factory=dict)
    counts: Mapping[str, int] = field(default_factory=dict)
    spacing: int = 1
    spaced_ns: int = 0
    spacing_before: int = 1
    complete: int = 0
    incomplete: int = 0
    hold: int = 0

    def paired_within_ns(self, captured_ns: int) -> int:
        """Half of the shortest period of the processed frames at a capture time."""
        return self.tolerance_ns * (self.spacing if captured_ns >= self.spaced_ns else self.spacing_before)

    def is_gone(self, viewer: str) -> bool:
        """Whether a viewer is not waited for."""
        return self.missed.get(viewer, 0) >= GONE_AFTER


@dataclass(frozen=True)
class FrameSet(Generic[T]):
    """The items of one frame set by viewer; a viewer without an item is absent."""

    captured_ns: int
    items: Mapping[str, T]


def push(pairs: Synchronizer[T], viewer: str, captured_ns: int, value: T) -> tuple[Synchronizer[T], list[FrameSet[T]]]:
    """Add one item; return the new synchronizer and every frame set that the item completes, oldest first.

    A frame set is complete when each viewer, except absent ones (GONE_AFTER), has an item within half a frame period, or
    somewhat more where no other item is nearer.  The period of a camera may vary.  A viewer's next item, or the one
    `hold` items later, ends the wait for the others at its last one.  Duplicate, late and unknown items are counted and
    dropped.  Frame sets are strictly in the order of time.  OUTDATED items in a row that are LONG_NS behind mean that an
    earlier time was wrong (a clock, or an invalid message): the time is reset.  The waiting items of one viewer are
    dropped by the same rule.
    """
    if viewer not in pairs.viewers:
        return _count(pairs, "unknown"), []
    outdated = pairs.outdated + 1 if captured_ns < pairs.last_ns - LONG_NS else 0
    pairs = replace(pairs, outdated=outdated)
    if outdated >= OUTDATED:
        pairs = _count(replace(pairs, waiting={}, last_ns=-1, given={}, outdated=0, behind={}), "began_anew")
    queue = pairs.waiting.get(viewer, ())
    behind = pairs.behind.get(viewer, 0) + 1 if queue and captured_ns < queue[-1].captured_ns - LONG_NS else 0
    if behind >= OUTDATED:
        queue, behind = (), 0
        pairs = _count(pairs, "began_anew")
    pairs = replace(pairs, behind={**pairs.behind, viewer: behind})
    known = [item.captured_ns for item in queue] + ([pairs.given[viewer]] if viewer in pairs.given else [])
    if any(abs(known_ns - captured_ns) <= pairs.tolerance_ns // 2 for known_ns in known):
        return _count(pairs, "doubled"), []
    if captured_ns <= pairs.last_ns:
        if captured_ns > pairs.last_ns - pairs.tolerance_ns * (1 + 2 * pairs.hold):  # it is back: the next set waits for it
            pairs = replace(pairs, missed={**pairs.missed, viewer: 0})
        return _count(pairs, "late"), []
    if queue and captured_ns < queue[-1].captured_ns:
        pairs = _count(pairs, "out_of_order")
    queue = tuple(sorted((*queue, Item(captured_ns, value)), key=lambda item: item.captured_ns))
    queue = queue[-(KEPT_WAITING + pairs.hold) :]
    waiting = {**pairs.waiting, viewer: queue}
    missed = {**pairs.missed, viewer: 0}
    pairs = replace(pairs, waiting=waiting, missed=missed)
    frame_sets: list[FrameSet[T]] = []
    while (found := _next(pairs)) is not None:
        pairs, frame_set = found
        frame_sets.append(frame_set)
    return pairs, frame_sets


def with_spacing(pairs: Synchronizer[T], spacing: int, from_ns: int) -> Synchronizer[T]:
    """The synchronizer for frames that are at least `spacing` frame periods apart at capture times from `from_ns`."""
    return replace(pairs, spacing=spacing, spaced_ns=from_ns, spacing_before=pairs.spacing)


def _next(pairs: Synchronizer[T]) -> tuple[Synchronizer[T], FrameSet[T]] | None:
    heads = {viewer: queue[0] for viewer, queue in pairs.waiting.items() if queue}
    if not heads:
        return None
    first = min(heads, key=lambda viewer: heads[viewer].captured_ns)
    start_ns, later = heads[first].captured_ns, pairs.waiting[first][1:2]
    within_ns = pairs.paired_within_ns(start_ns)
    chosen = {}
    for viewer, item in heads.items():
        after_ns = item.captured_ns - start_ns
        if after_ns > FARTHEST * within_ns:
            continue
        if after_ns > within_ns and not follows(pairs.given, first, viewer):
            if not later and len(pairs.waiting[viewer]) < 2:  # the first viewer's next item may be nearer
                return None
            if later and abs(later[0].captured_ns - item.captured_ns) < after_ns:
                continue
        chosen[viewer] = item
    absent = [viewer for viewer in pairs.viewers if viewer not in chosen]
    # A missing viewer is waited for, unless it is absent, has passed this time, or a present one has its next items.
    overtaken = any(len(pairs.waiting[viewer]) > 1 + pairs.hold for viewer in chosen)
    if any(v not in heads and not pairs.is_gone(v) for v in absent) and not overtaken:
        return None
    waiting = {viewer: queue[1:] if viewer in chosen else queue for viewer, queue in pairs.waiting.items()}
    missed = {viewer: 0 if viewer in chosen else pairs.missed.get(viewer, 0) + 1 for viewer in pairs.viewers}
    if absent:
        pairs = _count(pairs, "unpaired")
    if all(pairs.is_gone(viewer) for viewer in absent):
        pairs = replace(pairs, complete=pairs.complete + 1)
    else:
        pairs = replace(pairs, incomplete=pairs.incomplete + 1)
    given = {**pairs.given, **{viewer: item.captured_ns for viewer, item in chosen.items()}}
    pairs = replace(pairs, waiting=waiting, missed=missed, last_ns=max(pairs.last_ns, start_ns), given=given)
    return pairs, FrameSet(start_ns, {viewer: item.value for viewer, item in chosen.items()})


def follows(given: Mapping[str, int], first: str, second: str) -> bool:
    """True when the last items of these viewers came in this order: pairs at half a period do not change it."""
    return first in given and given[first] < given.get(second, -1)


def _count(pairs: Synchronizer[T], name: str) -> Synchronizer[T]:
    return replace(pairs, counts={**pairs.counts, name: pairs.counts.get(name, 0) + 1})
