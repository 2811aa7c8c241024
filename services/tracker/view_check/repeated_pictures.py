"""Views that repeat a picture while the others change: frozen cameras, films that repeat pictures."""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.tracker.hull.views import Silhouettes
from zenocap.services.tracker.parameters import FROZEN_CHANGE, FROZEN_NS, FROZEN_REPEATS, MOVING_CHANGE
from zenocap.services.tracker.view_check.line_support import changed_fraction


class EqualPictures(NamedTuple):
    """Equal pictures of a view in a row.

    first: silhouettes of all views when it began.  moved: whether the other views differ from these; they do not while the
    person stands still.  start_ns: when they last did not.  repeats: pictures since then.
    """

    first: Silhouettes
    start_ns: int
    repeats: int = 0
    moved: bool = False

    def is_frozen(self, captured_ns: int) -> bool:
        return self.repeats >= FROZEN_REPEATS and captured_ns - self.start_ns >= FROZEN_NS


def continued(runs: tuple[EqualPictures, ...], captured_ns: int, silhouettes: Silhouettes) -> tuple[EqualPictures, ...]:
    """Runs of all views after one more frame set.  runs: those before; none before the first."""
    changes: dict[int, Floats] = {}  # by the first silhouettes: views of a person who stands still share them
    found = []
    for j in range(len(silhouettes.box)):
        if not runs or not _is_repeated(runs[j].first, silhouettes, j):
            found.append(EqualPictures(silhouettes, captured_ns))
            continue
        first, start_ns, repeats, moved = runs[j]
        if not moved:
            if id(first) not in changes:
                changes[id(first)] = changed_fraction(first, silhouettes)
            others = np.delete(changes[id(first)], j)
            moved = bool(np.isfinite(others).any()) and float(np.nanmedian(others)) >= MOVING_CHANGE
        found.append(EqualPictures(first, start_ns, repeats + 1, moved) if moved else EqualPictures(first, captured_ns))
    return tuple(found)


def _is_repeated(before: Silhouettes, after: Silhouettes, j: int) -> bool:
    """Whether view j shows the same silhouette twice."""
    count = int(after.box[j, 2] * after.box[j, 3])
    if not count or not np.array_equal(before.box[j], after.box[j]):
        return False
    was, now = before.pixels[before.at[j] :][:count], after.pixels[after.at[j] :][:count]
    return int(np.count_nonzero(was != now)) <= FROZEN_CHANGE * count
