"""Commands `calibrate lines` and `calibrate check`: input, options, exit statuses."""

import json
import re
from functools import partial
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from tests.support.command import printed, zenocap
from tests.support.places import ROOT
from zenocap.common.camera import line_calibration
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.tools.cli.calibrate.lines import EXAMPLE
from zenocap.tools.cli.calibrate.lines import lines as LINES
from zenocap.tools.setup.calibration.walk import calibration, films
from zenocap.tools.setup.calibration.walk import report as walk_report
from zenocap.tools.setup.calibration.walk.delays import Delay

DEMO = ROOT / "zenocap" / "data" / "rigs" / "demo-calibration.toml"
MEASURED = (
    "--size 160 120 --d-x 1 --d-z 1 --t 1.7 --a1 79.5 39.3 --b1 79.5 34.5 --c1 108.3 39.3 --a2 79.5 39.3 --b2 108.3 39.3 "
    "--c2 79.5 42.6 --distance1 5.2 --distance2 5.2 --height1 1 --height2 1"
)
OPTIONS = MEASURED.split()
lines, check = partial(printed, "calibrate", "lines"), partial(printed, "calibrate", "check")


@pytest.fixture
def measured(tmp_path):
    (tmp_path / "measured.toml").write_text(lines("--example"))
    return tmp_path / "measured.toml"


def test_the_example_gives_the_calibration_of_its_numbers_as_options(measured, tmp_path):
    output = lines(measured, "-o", tmp_path / "a.toml")
    cameras = read_calibration(tmp_path / "a.toml")
    np.testing.assert_allclose(cameras["cam01"].centre, [0, 1, 5.2], atol=0.02)
    np.testing.assert_allclose(cameras["cam02"].centre, [-5.2, 1, 0], atol=0.02)
    assert cameras["cam01"].matrix[0, 0] == pytest.approx(150, rel=0.01)
    for text in ("cam01: focal length 149.8 px", "distance 5.200 ± 0.010 m", "residuals px: A' (", "verdict: good"):
        assert text in output
    lines(*OPTIONS, "-o", tmp_path / "b.toml")
    assert (tmp_path / "a.toml").read_text() == (tmp_path / "b.toml").read_text()


def test_the_plan_of_the_objects_is_on_the_page_that_the_help_names_and_drawn_as_the_help_places_them():
    (page,) = re.findall(r"A drawing: docs, (\S+)\.", LINES.__doc__)
    (file,) = re.findall(r"\((\S+\.svg)\)", (ROOT / "docs" / f"{page}.md").read_text())
    drawn = ET.parse(ROOT / "docs" / file).getroot()
    a, b, c = ((int(one.get("cx")), int(one.get("cy"))) for one in drawn.iterfind("{*}circle"))
    second, first = (re.match(r"M(\d+) (\d+)", one.get("d")).groups() for one in drawn.iterfind("{*}path"))
    assert a[0] == b[0] < c[0]  # X to the right
    assert a[1] == c[1] < b[1] < int(first[1])  # Z down, with camera 1
    assert int(second[0]) < a[0]  # camera 2 on -X
    words = [one.text for one in drawn.iterfind("{*}text")]
    for name, place in (("A", "(0, 0)"), ("B", "(0, D_Z)"), ("C", "(D_X, 0)")):
        assert f"{name} {place}" in words
        assert f"{name} = {place}" in LINES.__doc__


def test_a_poor_calibration_is_written_with_exit_status_3(tmp_path):
    output = lines(*OPTIONS[:-4], "--height1", "1.5", "-o", tmp_path / "b.toml", status=3)
    assert "verdict: poor" in output
    assert "camera 1: measured height 1.50 m, but the pinnacles give 1.00 m" in output
    assert (tmp_path / "b.toml").exists()


def test_a_wrong_column_is_noticed_with_the_height_and_else_said_to_be_unchecked(tmp_path):
    wrong = [*OPTIONS[:-4]]
    wrong[wrong.index("--c1") + 1] = "113.3"  # 5 px too far to the right: the focal length becomes 17 % too long
    output = lines(*wrong, "-o", tmp_path / "a.toml")
    assert "cam01: focal length 175.8 px" in output
    assert "verdict: unchecked" in output
    assert "camera 1: 8 px in the column of C' would not be noticed and change the focal length by 24%" in output
    assert "the focal lengths differ by 17%: with equal cameras and the same zoom, one is wrong" in output
    written = (tmp_path / "a.toml").read_text()
    output = lines(*OPTIONS, "-o", tmp_path / "a.toml", status=1)
    assert "exists already: allowed: another name, or --force" in output
    assert (tmp_path / "a.toml").read_text() == written
    output = lines(*wrong, *OPTIONS[-4:], "--force", "-o", tmp_path / "a.toml", status=3)
    assert "verdict: poor" in output
    assert "but the pinnacles give 1.10 m" in output


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("d_x = 1.0", "d_x = 0.0", "d_x = 0.0: allowed: 0.05 to 100 m"),
        ("d_x = 1.0", "dx = 1.0", "unknown field `dx`"),
        ("d_x = 1.0 ", "d_x = ", "not TOML"),
        ("t = 1.7", 't = "tall"', "Expected `float`, got `str` - at `$.t`; allowed: size, d_x"),
    ],
)
def test_invalid_measurements_are_rejected(measured, tmp_path, old, new, text):
    measured.write_text(EXAMPLE.replace(old, new))
    assert text in lines(measured, "-o", tmp_path / "out.toml", status=1)
    assert not (tmp_path / "out.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (["none.toml"], 1, "cannot be read: No such file"),
        ([*OPTIONS, "-o", "none/out.toml"], 1, "cannot be written: No such file"),
        ([*OPTIONS, "-o", "out.yml"], 1, "allowed when writing: .toml"),
        (["--t", "1.7"], 2, "--size"),
        (["measured.toml", "--t", "1.7"], 2, "--t"),
        ([*OPTIONS[:1], "160.5", *OPTIONS[2:]], 2, "--size 160.5 120: allowed: whole pixels"),
    ],
)
def test_unusable_files_and_options_are_refused(tmp_path, monkeypatch, arguments, status, text):
    monkeypatch.chdir(tmp_path)
    assert text in " ".join(lines(*arguments, status=status).split())


def test_check_prints_positions_and_attitudes():
    output = check(DEMO)
    for text in (
        "cam01: 640 x 480 px, focal length 600.0 px",
        "at (0.000, 1.000, 5.200) m, Y up",
        "heading 90.0 degrees from -Z towards +X, tilt +0.0, roll ",
        "cam01 and cam02: 90.0 degrees apart",
        "most nearly orthogonal: cam01 (front) and cam02, 90.0 degrees apart",
    ):
        assert text in output


def test_check_prints_json():
    data = json.loads(check(DEMO, "--json"))
    assert data["most_orthogonal"] == ["cam01", "cam02"]
    assert data["angles"][0]["angle_deg"] == pytest.approx(90)
    assert data["cameras"][1]["position_m"] == pytest.approx([-5.2, 1.0, 0.0])


def test_check_suggests_the_other_up_axis_and_reports_errors(tmp_path):
    path = tmp_path / "calibration.toml"
    path.write_text(DEMO.read_text())
    assert "is the up axis right" in check(path, "--up-axis", "z")
    path.write_text(DEMO.read_text().split("[cam_02]")[0])
    assert "cam01" in check(path)
    assert "up_axis = 'x': allowed: 'y' or 'z'" in check(path, "--up-axis", "x", status=1)


def test_a_file_that_was_made_while_it_calibrated_stays_and_the_result_is_beside_it(tmp_path, monkeypatch):
    path, solve = tmp_path / "a.toml", line_calibration.calibrate_lines

    def slow(measured):
        path.write_text("mine")
        return solve(measured)

    monkeypatch.setattr(line_calibration, "calibrate_lines", slow)
    for name in ("a-2.toml", "a-3.toml"):
        path.unlink(missing_ok=True)
        output = lines(*OPTIONS, "-o", path, status=1)
        assert output == f"error: {path}: exists since a moment ago, and stays: the result is in {tmp_path / name}\n"
        assert path.read_text() == "mine"
        assert set(read_calibration(tmp_path / name)) == {"cam01", "cam02"}
    lines(*OPTIONS, "-o", path, "--force")
    assert set(read_calibration(path)) == {"cam01", "cam02"}


@pytest.mark.parametrize("as_json", [False, True])
def test_a_calibration_of_a_walk_that_is_beside_another_one_loses_no_delays(as_json, tmp_path, monkeypatch):
    """The command ended before it wrote sync.toml, and showed no report."""
    path, cameras = tmp_path / "a.toml", read_calibration(DEMO)

    def calibrated(*_):
        path.write_text("mine")
        sighted = [SimpleNamespace(camera=camera, off_px=0.5) for camera in cameras.values()]
        return SimpleNamespace(cameras=sighted, delays={"cam01": Delay(0.0, 0.0), "cam02": Delay(0.12, 0.001)})

    begins = dict.fromkeys(cameras, 0.0)
    monkeypatch.setattr(films, "filmed", lambda *_: films.FilmedWalk(cameras, {}, None, begins, ()))
    monkeypatch.setattr(calibration, "calibrated_films", calibrated)
    monkeypatch.setattr(walk_report, "report", lambda _: ["seen well"])
    monkeypatch.setattr(walk_report, "report_data", lambda _: {"error_m": 0.1})
    monkeypatch.setattr(walk_report, "verdict", lambda _: ("good", ()))
    options = ("--height", "1.75", "--lenses", DEMO, "-o", path, *["--json"] * as_json)
    status, text, errors = zenocap("calibrate", "walk", tmp_path, *options)
    assert status == 1
    assert f"error: {path}: exists since a moment ago, and stays: the result is in {tmp_path / 'a-2.toml'}\n" in errors
    if as_json:
        assert json.loads(text) == {"error_m": 0.1, "written": None}
    else:
        assert text == f"seen well\nwritten: {tmp_path / 'sync.toml'}\nverdict: good\n"
    assert '"cam02" = 0.1200' in (tmp_path / "sync.toml").read_text()
    assert list(read_calibration(tmp_path / "a-2.toml")) == list(cameras)
