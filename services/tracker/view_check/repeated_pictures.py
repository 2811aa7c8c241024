"""Views that repeat a picture while the others change: frozen cameras, films that repeat pictures."""

from typing import Generic, NamedTuple, TypeVar

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.tracker.hull.views import Silhouettes
from zenocap.services.tracker.parameters import FROZEN_CHANGE, FROZEN_NS, FROZEN_REPEATS, MOVING_CHANGE
from zenocap.services.tracker.view_check.line_support import changed_fraction

Pictures = TypeVar("Pictures")


class EqualPictures(NamedTuple, Generic[Pictures]):
    """Equal pictures of a view in a row.

    first: pictures of all views when it began.  moved: whether the other views differ from these; they do not while the
    person stands still.  start_ns: when they last did not.  repeats: pictures since then.
    """

    first: Pictures
    start_ns: int
    repeats: int = 0
    moved: bool = False

    def one_more(self, captured_ns: int, moved: bool) -> "EqualPictures[Pictures]":
        return self._replace(repeats=self.repeats + 1, moved=True) if moved else self._replace(start_ns=captured_ns)

    def is_frozen(self, captured_ns: int) -> bool:
        return self.repeats >= FROZEN_REPEATS and captured_ns - self.start_ns >= FROZEN_NS


ViewRun = EqualPictures[Silhouettes]


def continued(runs: tuple[ViewRun, ...], captured_ns: int, silhouettes: Silhouettes) -> tuple[ViewRun, ...]:
    """Runs of all views after one more frame set.  runs: those before; none before the first."""
    changes: dict[int, Floats] = {}  # by the first silhouettes: views of a person who stands still share them
    found = []
    for j in range(len(silhouettes.box)):
        if not runs or not _is_repeated(runs[j].first, silhouettes, j):
            found.append(ViewRun(silhouettes, captured_ns))
            continue
        first, moved = runs[j].first, runs[j].moved
        if not moved:
            if id(first) not in changes:
                changes[id(first)] = changed_fraction(first, silhouettes)
            others = np.delete(changes[id(first)], j)
            moved = bool(np.isfinite(others).any()) and float(np.nanmedian(others)) >= MOVING_CHANGE
        found.append(runs[j].one_more(captured_ns, moved))
    return tuple(found)


def _is_repeated(before: Silhouettes, after: Silhouettes, j: int) -> bool:
    """Whether view j shows the same silhouette twice."""
    count = int(after.box[j, 2] * after.box[j, 3])
    if not count or not np.array_equal(before.box[j], after.box[j]):
        return False
    was, now = before.pixels[before.at[j] :][:count], after.pixels[after.at[j] :][:count]
    return int(np.count_nonzero(was != now)) <= FROZEN_CHANGE * count
