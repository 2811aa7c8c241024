"""Confidence of limbs in exports and in Python: columns and blanks."""

import csv
from pathlib import Path

import ezc3d
import numpy as np
import pytest

import zenocap
from tests.support.export_takes import LIMBS, LOST, UNSURE
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.joint_conventions import CONVENTIONS, Convention, limb_of, points_of
from zenocap.common.formats.trc import read_trc
from zenocap.tools.takes.export import ExportOptions, export


def test_csv_has_a_column_for_each_limb_and_names_the_lost_ones(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "take.csv", ExportOptions("csv"))
    with (tmp_path / "take.csv").open() as file:
        rows = list(csv.DictReader(file))
    for number, row in enumerate(rows):
        assert float(row["confidence.left_arm"]) == (0.2 if number == UNSURE else 0.9)
        assert row["lost"] == {UNSURE: "left_arm", LOST: "person"}.get(number, "")
    assert rows[UNSURE]["LWrist.x_m"] != ""


@pytest.mark.parametrize("joints", CONVENTIONS)
def test_points_of_an_uncertain_limb_are_blank_where_asked_for(tracked: Path, tmp_path: Path, joints: Convention) -> None:
    output = tmp_path / "take.trc"
    export(tracked, output, ExportOptions("trc", joints=joints, min_confidence=0.5))
    found = read_trc(output)
    arm = [k for k, name in enumerate(found.names) if limb_of(name) == "left_arm"]
    assert len(arm) == 2
    missing = np.isnan(found.points).any(axis=2)
    expected = np.zeros_like(missing)
    expected[UNSURE, arm] = expected[LOST] = True
    np.testing.assert_array_equal(missing, expected)


def test_c3d_marks_points_of_an_uncertain_limb_as_missing(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "take.c3d", ExportOptions("c3d", min_confidence=0.5))
    residuals = ezc3d.c3d(str(tmp_path / "take.c3d"))["data"]["meta_points"]["residuals"][0]
    assert np.count_nonzero(residuals[:, UNSURE] < 0) == 2


def test_every_limb_has_points_in_every_convention() -> None:
    for joints in CONVENTIONS:
        limbs = [limb_of(point.name) for point in points_of(joints, FOURTEEN_PARTS)]
        assert set(limbs) - {None} == set(LIMBS)
        assert limbs.count("right_arm") == limbs.count("left_arm") == 2
        assert limbs.count("right_leg") == limbs.count("left_leg")


def test_python_gives_the_confidence_of_takes_that_state_it(tracked: Path, two_view: Path) -> None:
    poses = zenocap.open_take(tracked).poses()
    assert set(poses.limbs) == set(LIMBS)
    assert poses.limbs["left_arm"][UNSURE] == 0.2
    assert zenocap.open_take(two_view).poses().limbs == {}
