"""Levels of frame rate and tracker detail: down under overload, up after it.  Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from zenocap.services.integrator.parameters import CALM_NS, FIRST_WAIT_NS, GREATEST_CUT, LONGEST_WAIT_NS, SPARE


@dataclass(frozen=True)
class Ladder:
    """A level that is lowered under overload and raised after it; level 0 is the highest.

    failed: level that lost frame sets last, None for none.  calm_ns: since when none are lost.  wait_ns: time without
    losses before the failed level is tried again.  raised_ns: time of the last raise, None after a lowering.
    """

    level: int = 0
    failed: int | None = None
    calm_ns: int = 0
    wait_ns: int = FIRST_WAIT_NS
    raised_ns: int | None = None


def lowered(ladder: Ladder, level: int, now_ns: int) -> Ladder:
    """The ladder at a lower level, whose present level has failed."""
    again = ladder.raised_ns is not None and now_ns - ladder.raised_ns < max(ladder.wait_ns, 2 * CALM_NS)
    if again:
        wait_ns = min(2 * ladder.wait_ns, LONGEST_WAIT_NS)
    else:
        wait_ns = FIRST_WAIT_NS if ladder.raised_ns is not None else ladder.wait_ns
    return Ladder(level, ladder.level, now_ns, wait_ns)


def raised(ladder: Ladder, values: Sequence[float], busy: float, now_ns: int) -> Ladder:
    """The ladder at a higher level, or the same one while it is too early.

    values: of the levels, decreasing.  busy: share of its time that the busiest loop works; a level at which it would
    work more than SPARE is not tried.
    """
    calm_ns, failed = now_ns - ladder.calm_ns, ladder.failed
    if calm_ns < CALM_NS:
        return ladder
    if failed is not None and ladder.level <= failed:
        if calm_ns < 2 * CALM_NS:
            return ladder
        failed = None  # it holds now
    highest = 0 if failed is None else failed + 1
    if failed is not None and ladder.level == highest:
        if calm_ns < ladder.wait_ns:
            return ladder
        target = failed
    else:
        target = ladder.level - max(1, (ladder.level - highest + 1) // 2)
    for level in range(target, ladder.level):
        ratio = values[level] / values[ladder.level]
        if ratio <= 1.0 / GREATEST_CUT + 1e-9 and ratio * busy <= SPARE:
            return Ladder(level, failed, now_ns, ladder.wait_ns, now_ns)
    return replace(ladder, failed=failed)
