"""Silhouettes that repeat while those of the other cameras change, as of a frozen camera."""

from bisect import bisect_left
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from zenocap.common import messages as m
from zenocap.common.conversion import silhouette_mask
from zenocap.services.tracker.parameters import FROZEN_NS, FROZEN_REPEATS, MOVING_CHANGE
from zenocap.tools.judge.parameters import GOOD_LOST


@dataclass(slots=True, eq=False)
class EqualSilhouettes:
    """Equal silhouettes of a viewer in a row.  others: those of the other viewers with its first repeat.

    moved: whether these differ now; they do not while the person stands still.  start_ns: when they last did not.
    repeats: silhouettes since then, to last_ns.
    """

    first: m.Silhouette
    start_ns: int
    last_ns: int
    others: Mapping[str, m.Silhouette] | None = None
    repeats: int = 0
    moved: bool = False


@dataclass
class Repeated:
    """Runs of equal silhouettes of a take.  frozen: by viewer, those of a frozen view, in their order."""

    frozen: dict[str, list[EqualSilhouettes]] = field(default_factory=dict)
    _runs: dict[str, EqualSilhouettes] = field(default_factory=dict)
    _last: dict[str, m.Silhouette] = field(default_factory=dict)

    def add(self, one: m.Silhouette) -> None:
        """Add the next silhouette of a take."""
        run, self._last[one.viewer] = self._runs.get(one.viewer), one
        if run is None or not one.data or (run.first.region, run.first.data) != (one.region, one.data):
            self._runs[one.viewer] = EqualSilhouettes(one, one.captured_ns, one.captured_ns)
            return
        if run.others is None:
            run.others = {viewer: other for viewer, other in self._last.items() if viewer != one.viewer and other.data}
        if not run.moved:
            changes = [_change(other, self._last[viewer]) for viewer, other in run.others.items()]
            run.moved = bool(changes) and float(np.median(changes)) >= MOVING_CHANGE
            run.start_ns = run.start_ns if run.moved else one.captured_ns
        run.last_ns, run.repeats = one.captured_ns, run.repeats + run.moved
        if run.repeats >= FROZEN_REPEATS and run.last_ns - run.start_ns >= FROZEN_NS:
            known = self.frozen.setdefault(one.viewer, [])
            if run not in known[-1:]:
                known.append(run)

    def includes(self, one: m.Silhouette) -> bool:
        """Whether a silhouette repeats an earlier one of a frozen view."""
        runs = self.frozen.get(one.viewer, [])
        k = bisect_left(runs, one.captured_ns, key=lambda run: run.start_ns)
        return k > 0 and one.captured_ns <= runs[k - 1].last_ns

    def reasons(self, start_ns: int, end_ns: int) -> Iterator[tuple[bool, m.VerdictReason]]:
        """A reason for each frozen camera, and whether it was for much of a take.  start_ns, end_ns: of that."""
        for viewer, runs in sorted(self.frozen.items()):
            lasts_ns = [run.last_ns - run.start_ns for run in runs]
            longest = runs[int(np.argmax(lasts_ns))]
            begin_s, end_s = (longest.start_ns - start_ns) / 1e9, (longest.last_ns - start_ns) / 1e9
            more = f", and {len(runs) - 1} times more, in all {sum(lasts_ns) / 1e9:.1f} s" if len(runs) > 1 else ""
            text = (
                f"camera {viewer} shows the same picture from {begin_s:.1f} to {end_s:.1f} s{more}: cable, camera, or a "
                "film that repeats pictures; its view is left out there"
            )
            much = sum(lasts_ns) > GOOD_LOST * (end_ns - start_ns)
            yield much, m.VerdictReason(kind="frozen", viewers=[viewer], text=text)


def _change(before: m.Silhouette, after: m.Silhouette) -> float:
    """Share of a silhouette that differs: pixels in one of both only, over those in `after`; 0 where one is damaged."""
    if (before.region, before.data) != (after.region, after.data):
        with suppress(ValueError):
            was, now = silhouette_mask(before, after.size) != 0, silhouette_mask(after) != 0
            return int(np.count_nonzero(was != now)) / max(1, int(np.count_nonzero(now)))
    return 0.0
