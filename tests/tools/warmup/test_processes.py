"""Parts are distributed to processes by duration."""

from zenocap.tools.warmup.parts import PARTS
from zenocap.tools.warmup.processes import WEIGHTS, shared_out


def test_every_part_is_in_one_group() -> None:
    groups = shared_out(tuple(PARTS), 2)
    assert sorted(part for group in groups for part in group) == sorted(PARTS)
    assert WEIGHTS.keys() <= PARTS.keys()


def test_longest_part_gets_its_own_process() -> None:
    assert shared_out(("silhouettes", "actor", "tracking"), 2) == [["tracking"], ["silhouettes", "actor"]]
    assert shared_out(("tracker",), 2) == [["tracker"]]
