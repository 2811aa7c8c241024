"""Tree of a BVH file's joints: bone lengths, longest ways down, directions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.formats.bvh_reader import Bvh

MOST_FRAMES = 200  # that lengths and directions are the medians of; chosen by hand


@dataclass(frozen=True)
class Tree:
    """points: (n, joints, 3) of some frames.  lengths: (joints,) of the bone to a joint.

    onward: the child on the longest way down, -1 at its end.  reach, steps: length and number of bones of that way.
    """

    names: tuple[str, ...]
    children: tuple[tuple[int, ...], ...]
    points: Floats
    lengths: Floats
    onward: tuple[int, ...]
    reach: Floats
    steps: tuple[int, ...]

    def way_down(self, joint: int) -> list[int]:
        """The joint and those on the longest way down from it."""
        way = [joint]
        while self.onward[way[-1]] >= 0:
            way.append(self.onward[way[-1]])
        return way

    def below(self, joint: int) -> list[int]:
        """The joint and all below it."""
        found = [joint]
        for one in found:
            found += self.children[one]
        return found

    def direction(self, start: int, end: int) -> Floats:
        """(n, 3) unit vectors; 0 between joints at the same place."""
        line = self.points[:, end] - self.points[:, start]
        return np.asarray(line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-9))

    def apart(self, one: int, other: int) -> float:
        """Median distance of two joints."""
        return float(np.median(np.linalg.norm(self.points[:, one] - self.points[:, other], axis=1)))

    def along(self, start: int, end: int, way: Sequence[int]) -> float:
        """Length of the bones between two joints of a way."""
        return float(self.lengths[list(way[way.index(start) + 1 : way.index(end) + 1])].sum())

    def turn_deg(self, one: int, two: int, three: int) -> float:
        """Median angle in degrees between two bones that follow each other; 0 where the second one has no length."""
        if self.apart(two, three) <= 0.0:
            return 0.0
        cosines = np.sum(self.direction(one, two) * self.direction(two, three), axis=1)
        return float(np.degrees(np.arccos(np.clip(np.median(cosines), -1.0, 1.0))))


def tree_of(file: Bvh) -> Tree:
    """The tree of a file; its cost is linear in the number of joints."""
    count = len(file.names)
    children: list[list[int]] = [[] for _ in range(count)]
    points = file.points[:: max(1, len(file.points) // MOST_FRAMES)]
    lengths, reach = np.zeros(count), np.zeros(count)
    onward, steps = [-1] * count, [0] * count
    for k, parent in enumerate(file.parents):
        if parent >= 0:
            children[parent].append(k)
            lengths[k] = float(np.median(np.linalg.norm(points[:, k] - points[:, parent], axis=1)))
    for k in reversed(range(count)):  # children come after their parents
        parent = file.parents[k]
        if parent >= 0 and lengths[k] + reach[k] >= reach[parent]:
            reach[parent], onward[parent], steps[parent] = lengths[k] + reach[k], k, steps[k] + 1
    return Tree(file.names, tuple(map(tuple, children)), points, lengths, tuple(onward), reach, tuple(steps))
