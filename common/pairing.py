"""Pairing what the viewers say about one instant, by capture time.  Pure: time is only what the items carry."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

T = TypeVar("T")

GONE_AFTER = 5  # instants without a viewer before nobody waits for it
LONG_NS, OUTDATED = 2_000_000_000, 30  # so far behind, so often in a row: it is the newest time that was wrong
KEPT_WAITING = 8  # items of one viewer that may wait


@dataclass(frozen=True)
class Item(Generic[T]):
    """captured_ns: on the integrator's clock."""

    captured_ns: int
    value: T


@dataclass(frozen=True)
class Pairs(Generic[T]):
    """waiting: by viewer, oldest first.  missed: instants in a row that went on without a viewer.  counts: what came wrong.

    tolerance_ns: half a frame period.  last_ns: the newest instant given out.  given: each viewer's newest item in one.
    outdated: items in a row that were LONG_NS and more too late.  behind: by viewer, those in a row that were so late
    against what waits of that viewer itself.
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


@dataclass(frozen=True)
class Instant(Generic[T]):
    """What the viewers said about one instant; a viewer that said nothing is absent."""

    captured_ns: int
    items: Mapping[str, T]


def offer(pairs: Pairs[T], viewer: str, captured_ns: int, value: T) -> tuple[Pairs[T], list[Instant[T]]]:
    """Take one item in; give out every instant that it completes, oldest first.

    An instant is complete when each viewer that is not gone has an item within half a frame period.  A viewer's next item
    ends the wait for the others at its last one.  Doubled, late and unknown items are counted and dropped; instants are
    strictly in the order of time, until OUTDATED items in a row are LONG_NS behind it: then a clock was wrong, or
    somebody lied, and time begins anew.  Likewise what waits of one viewer is dropped when that was wrong.
    """
    if viewer not in pairs.viewers:
        return _count(pairs, "unknown"), []
    outdated = pairs.outdated + 1 if captured_ns < pairs.last_ns - LONG_NS else 0
    pairs = replace(pairs, outdated=outdated)
    if outdated >= OUTDATED:
        pairs = _count(Pairs(pairs.viewers, pairs.tolerance_ns, missed=pairs.missed, counts=pairs.counts), "began_anew")
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
        if captured_ns > pairs.last_ns - pairs.tolerance_ns:  # it is back: the next instant waits for it
            pairs = replace(pairs, missed={**pairs.missed, viewer: 0})
        return _count(pairs, "late"), []
    if queue and captured_ns < queue[-1].captured_ns:
        pairs = _count(pairs, "out_of_order")
    queue = tuple(sorted((*queue, Item(captured_ns, value)), key=lambda item: item.captured_ns))[-KEPT_WAITING:]
    waiting = {**pairs.waiting, viewer: queue}
    missed = {**pairs.missed, viewer: 0}
    pairs = replace(pairs, waiting=waiting, missed=missed)
    instants: list[Instant[T]] = []
    while (found := _next(pairs)) is not None:
        pairs, instant = found
        instants.append(instant)
    return pairs, instants


def _next(pairs: Pairs[T]) -> tuple[Pairs[T], Instant[T]] | None:
    heads = {viewer: queue[0] for viewer, queue in pairs.waiting.items() if queue}
    if not heads:
        return None
    start_ns = min(item.captured_ns for item in heads.values())
    chosen = {viewer: item for viewer, item in heads.items() if item.captured_ns - start_ns <= pairs.tolerance_ns}
    absent = [viewer for viewer in pairs.viewers if viewer not in chosen]
    # An absent viewer is waited for, unless it is gone, has gone past this instant, or a present one has its next item.
    overtaken = any(len(pairs.waiting[viewer]) > 1 for viewer in chosen)
    if any(v not in heads and pairs.missed.get(v, 0) < GONE_AFTER for v in absent) and not overtaken:
        return None
    waiting = {viewer: queue[1:] if viewer in chosen else queue for viewer, queue in pairs.waiting.items()}
    missed = {viewer: 0 if viewer in chosen else pairs.missed.get(viewer, 0) + 1 for viewer in pairs.viewers}
    if absent:
        pairs = _count(pairs, "unpaired")
    given = {**pairs.given, **{viewer: item.captured_ns for viewer, item in chosen.items()}}
    pairs = replace(pairs, waiting=waiting, missed=missed, last_ns=max(pairs.last_ns, start_ns), given=given)
    return pairs, Instant(start_ns, {viewer: item.value for viewer, item in chosen.items()})


def _count(pairs: Pairs[T], what: str) -> Pairs[T]:
    return replace(pairs, counts={**pairs.counts, what: pairs.counts.get(what, 0) + 1})
