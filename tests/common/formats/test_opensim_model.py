"""Models of OpenSim: joint centres and bodies; every wrong file is refused in one line."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.opensim_models import write_model
from zenocap.common.errors import UserError
from zenocap.common.formats.opensim_model import read_model
from zenocap.common.formats.opensim_setup import REQUIRED, markers_of, measurements


def test_markers_are_the_joints_of_both_sides(tmp_path: Path) -> None:
    path = write_model(tmp_path / "a.osim")
    found = markers_of(read_model(path), path)
    assert len(found) == 19
    assert found["RKJC"][0] == "tibia_r"
    np.testing.assert_allclose(found["PelvisTop"][1], [-0.056, -0.078 + 0.154, 0.0])
    np.testing.assert_allclose(found["LHeel"][1], found["RHeel"][1] * [1, 1, -1])


def test_a_child_frame_beside_the_bodys_origin_moves_its_marker(tmp_path: Path) -> None:
    path = write_model(tmp_path / "a.osim")
    text = path.read_text()
    at = text.index("/bodyset/tibia_r</socket_parent><translation>0 0 0")
    path.write_text(text[:at] + text[at:].replace("<translation>0 0 0", "<translation>0.01 0.02 0.03", 1))
    np.testing.assert_allclose(markers_of(read_model(path), path)["RKJC"][1], [0.01, 0.02, 0.03])


def test_a_model_without_arms_has_no_measurements_of_them(tmp_path: Path) -> None:
    path = write_model(tmp_path / "a.osim", arms=False)
    model = read_model(path)
    markers = markers_of(model, path)
    assert {name for name in markers if name.endswith(("GH", "EJC", "WJC"))} == set()
    names = [name for name, _, _ in measurements(model, markers)]
    assert names == ["pelvis", "thigh_r", "thigh_l", "shank_r", "shank_l", "foot_r", "foot_l"]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("not xml", "not an .osim file"),
        ("<a/>", "no Model in an OpenSimDocument"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><a/>', "has a document type"),
        ('<OpenSimDocument Version="30000"><Model name="a"/></OpenSimDocument>',
         "Version = '30000': allowed: 40000 or more"),
        ('<OpenSimDocument Version="40000"><Model name="a"/></OpenSimDocument>', f"no body {REQUIRED[0]}, femur_r"),
    ],
)  # fmt: skip
def test_a_wrong_model_is_one_line_with_its_name(text: str, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "a.osim"
    path.write_text(text)
    with pytest.raises(UserError, match=r"a\.osim: ") as error:
        markers_of(read_model(path), path)
    assert problem in str(error.value)
    assert "\n" not in str(error.value)


def test_an_offset_that_is_no_number_names_its_joint(tmp_path: Path) -> None:
    path = write_model(tmp_path / "a.osim")
    path.write_text(path.read_text().replace("0 -0.41 0", "0 nan 0"))
    with pytest.raises(UserError, match=r"joint knee_r, frame parent_offset: translation = '0 nan 0': allowed: three"):
        read_model(path)
