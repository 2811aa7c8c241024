"""Axes of others: each is ours turned or mirrored, with up where its table says."""

import re
from pathlib import Path

import numpy as np
import pytest

from common.formats.axes import MATRICES, Axes, directions, turned

TAKES = (Path(__file__).resolve().parents[1] / "docs" / "takes.md").read_text(encoding="utf-8")
OUR = {"left": (1, 0, 0), "right": (-1, 0, 0), "up": (0, 1, 0), "front": (0, 0, 1), "back": (0, 0, -1)}


@pytest.mark.parametrize("axes", list(MATRICES))
def test_the_directions_are_where_the_points_go(axes: Axes) -> None:
    for k, name in enumerate(directions(axes)):
        assert turned(np.array(OUR[name], dtype=float), axes)[k] == 1.0
    np.testing.assert_array_equal(MATRICES[axes] @ MATRICES[axes].T, np.eye(3))


@pytest.mark.parametrize("axes", list(MATRICES))
def test_the_readme_says_so(axes: Axes) -> None:
    row = re.search(rf"^\| `{axes}`[^|]*\| (\w+) \| (\w) \| (-?\w) \|", TAKES, re.MULTILINE)
    assert row, f"{axes} is not in the table"
    hand, up, front = row.groups()
    assert np.linalg.det(MATRICES[axes]) == pytest.approx(1 if hand == "right" else -1)
    assert directions(axes)["XYZ".index(up)] == "up"
    assert directions(axes)["XYZ".index(front[-1])] == ("back" if front.startswith("-") else "front")


def test_units() -> None:
    np.testing.assert_allclose(turned(np.array([1.0, 2.0, 3.0]), "y-up", "mm"), [1000, 2000, 3000])
