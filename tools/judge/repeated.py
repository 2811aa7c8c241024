"""Silhouettes that repeat while those of the other cameras change, as of a frozen camera."""

from bisect import bisect_left
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from zenocap.common import messages as m
from zenocap.common.conversion import silhouette_mask
from zenocap.services.tracker.parameters import MOVING_CHANGE
from zenocap.services.tracker.view_check.repeated_pictures import EqualPictures
from zenocap.tools.judge.parameters import GOOD_LOST


@dataclass
class Repeated:
    """Runs of equal silhouettes of a take.  frozen: by viewer, of a frozen view the end of each run by its begin, ns."""

    frozen: dict[str, dict[int, int]] = field(default_factory=dict)
    _runs: dict[str, EqualPictures[Mapping[str, m.Silhouette]]] = field(default_factory=dict)
    _last: dict[str, m.Silhouette] = field(default_factory=dict)

    def add(self, one: m.Silhouette) -> None:
        """Add the next silhouette of a take."""
        run, self._last[one.viewer] = self._runs.get(one.viewer), one
        if run is None or not one.data or not _equal(run.first[one.viewer], one):
            self._runs[one.viewer] = EqualPictures({one.viewer: one}, one.captured_ns)
            return
        if len(run.first) == 1:  # those of the others of the same moment have come by now
            run = run._replace(first={**self._last, **run.first})
        run = run.one_more(one.captured_ns, run.moved or self._moved(run.first, one.viewer))
        self._runs[one.viewer] = run
        if run.is_frozen(one.captured_ns):
            self.frozen.setdefault(one.viewer, {})[run.start_ns] = one.captured_ns

    def _moved(self, first: Mapping[str, m.Silhouette], viewer: str) -> bool:
        """Whether the other views differ from their first silhouettes."""
        changes = [_change(one, self._last[other]) for other, one in first.items() if other != viewer and one.data]
        return bool(changes) and float(np.median(changes)) >= MOVING_CHANGE

    def includes(self, one: m.Silhouette) -> bool:
        """Whether a silhouette repeats an earlier one of a frozen view."""
        runs = self.frozen.get(one.viewer, {})
        k = bisect_left(list(runs), one.captured_ns)
        return k > 0 and one.captured_ns <= list(runs.values())[k - 1]

    def reasons(self, start_ns: int, end_ns: int) -> Iterator[tuple[bool, m.VerdictReason]]:
        """A reason for each frozen camera, and whether it was for much of a take.  start_ns, end_ns: of that."""
        for viewer, runs in sorted(self.frozen.items()):
            lasts_ns = sum(end - begin for begin, end in runs.items())
            longest = max(runs.items(), key=lambda run: run[1] - run[0])
            begin_s, end_s = [(at_ns - start_ns) / 1e9 for at_ns in longest]
            more = f", and {len(runs) - 1} times more, in all {lasts_ns / 1e9:.1f} s" if len(runs) > 1 else ""
            text = (
                f"camera {viewer} shows the same picture from {begin_s:.1f} to {end_s:.1f} s{more}: cable, camera, or a "
                "film that repeats pictures; its view is left out there"
            )
            much = lasts_ns > GOOD_LOST * (end_ns - start_ns)
            yield much, m.VerdictReason(kind="frozen", viewers=[viewer], text=text)


def _equal(one: m.Silhouette, other: m.Silhouette) -> bool:
    return (one.region, one.data) == (other.region, other.data)


def _change(before: m.Silhouette, after: m.Silhouette) -> float:
    """Share of a silhouette that differs: pixels in one of both only, over those in `after`; 0 where one is damaged."""
    if not _equal(before, after):
        with suppress(ValueError):
            was, now = silhouette_mask(before, after.size) != 0, silhouette_mask(after) != 0
            return int(np.count_nonzero(was != now)) / max(1, int(np.count_nonzero(now)))
    return 0.0
