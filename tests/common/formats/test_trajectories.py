"""Axis conventions of other programs: rotations or mirrorings of ours, with the up axis of the table."""

import re

import numpy as np
import pytest

from tests.support.places import ROOT
from zenocap.common.formats.trajectories import MATRICES, Axes, Trajectories, axis_directions, convert, with_absent_rows

TAKES = (ROOT / "docs" / "takes.md").read_text(encoding="utf-8")
OUR = {"left": (1, 0, 0), "right": (-1, 0, 0), "up": (0, 1, 0), "front": (0, 0, 1), "back": (0, 0, -1)}


@pytest.mark.parametrize("axes", list(MATRICES))
def test_directions_agree_with_converted_points(axes: Axes) -> None:
    for k, name in enumerate(axis_directions(axes)):
        assert convert(np.array(OUR[name], dtype=float), axes)[k] == 1.0
    np.testing.assert_array_equal(MATRICES[axes] @ MATRICES[axes].T, np.eye(3))


@pytest.mark.parametrize("axes", list(MATRICES))
def test_the_readme_lists_the_axes(axes: Axes) -> None:
    row = re.search(rf"^\| `{axes}`[^|]*\| (\w+) \| (\w) \| (-?\w) \|", TAKES, re.MULTILINE)
    assert row, f"{axes} is not in the table"
    hand, up, front = row.groups()
    assert np.linalg.det(MATRICES[axes]) == pytest.approx(1 if hand == "right" else -1)
    assert axis_directions(axes)["XYZ".index(up)] == "up"
    assert axis_directions(axes)["XYZ".index(front[-1])] == ("back" if front.startswith("-") else "front")


def test_points_are_converted_to_every_unit() -> None:
    np.testing.assert_allclose(convert(np.array([1.0, 2.0, 3.0]), "y-up", "mm"), [1000, 2000, 3000])


def test_rows_that_a_file_leaves_out_are_rows_without_points() -> None:
    data = Trajectories(("Hip",), np.array([3, 4, 7]), np.array([0.1, 0.2, 0.5]), np.ones((3, 1, 3)), 10.0)
    found = with_absent_rows(data)
    assert list(found.frames) == [3, 4, 5, 6, 7]
    np.testing.assert_allclose(found.times_s, [0.1, 0.2, 0.3, 0.4, 0.5])
    assert list(np.isfinite(found.points[:, 0, 0])) == [True, True, False, False, True]
    assert with_absent_rows(found) is found
