"""Silhouette: the cleaned binary mask of one person; its extents, and the options of its extraction."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from zenocap.common.arrays import Mask
from zenocap.common.vision.foreground import ForegroundOptions


class Extents(NamedTuple):
    """Outermost pixels of a mask, all inclusive; `highest` is the smallest row.  [Two-view 2.4, Fig. 4]"""

    leftmost: int
    rightmost: int
    highest: int
    lowest: int

    def centre(self) -> tuple[float, float]:
        """(x, y) px of the centre of the box."""
        return (self.leftmost + self.rightmost) / 2, (self.highest + self.lowest) / 2


@dataclass(frozen=True)
class PersonSilhouette:
    """Silhouette of one person.

    mask: (height, width) uint8 of 0 and 1, not empty.  area: pixels.
    """

    mask: Mask
    extents: Extents
    area: int


@dataclass(frozen=True)
class SilhouetteOptions:
    """Options of the extraction; shares are chosen by hand.

    foreground: thresholds.  choice: region of the person, the largest or the nearest to the previous extents.
    smallest: smallest area of a person, share of the image.
    crack: size of the closing kernel, share of the image height; rounded to an odd number of pixels.
    hole: largest area of a hole that is filled, share of the person's area.
    join: largest gap to a fragment that is joined, share of the person's height.
    fragment: smallest area of a fragment that is joined, share of the person's area.
    coverage: smallest coverage of an edge pixel by the person.
    """

    foreground: ForegroundOptions = field(default_factory=ForegroundOptions)
    choice: Literal["largest", "nearest"] = "largest"
    smallest: float = 0.002
    crack: float = 0.006
    hole: float = 0.004
    join: float = 0.06
    fragment: float = 0.01
    coverage: float = 0.4

    def __post_init__(self) -> None:
        for name in ("smallest", "crack", "hole", "join", "fragment", "coverage"):
            value: float = getattr(self, name)
            if not 0 <= value < 1:
                raise ValueError(f"{name}: {value}; allowed 0 <= {name} < 1")


def describe(mask: Mask, smallest: float = 0.0, box: tuple[int, int, int, int] | None = None) -> PersonSilhouette | None:
    """Extents and area of a mask (height, width) of 0 and 1; None below the area `smallest`, a share of the image.

    box: left, top, right, bottom (exclusive) px; the mask is known to be 0 outside of it.
    """
    left, top, right, bottom = box or (0, 0, mask.shape[1], mask.shape[0])
    inside = mask[top:bottom, left:right]
    columns, rows = np.flatnonzero(inside.any(axis=0)), np.flatnonzero(inside.any(axis=1))
    area = int(np.count_nonzero(inside))
    if area == 0 or area < smallest * mask.size:
        return None
    extents = Extents(left + int(columns[0]), left + int(columns[-1]), top + int(rows[0]), top + int(rows[-1]))
    return PersonSilhouette(mask, extents, area)
