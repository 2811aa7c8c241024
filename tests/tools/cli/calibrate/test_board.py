"""`calibrate board` on pictures of a simulated board: the calibration, the report, and wrong calls."""

import json

import pytest
from typer.testing import CliRunner

from tests.support.board_films import SIZE, board_pictures
from tests.support.board_views import places, rig_error_m, room
from tests.support.stored import stored_files
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.tools.cli.calibrate.commands import calibrate
from zenocap.tools.setup.calibration.board import checked_board

pytestmark = pytest.mark.slow
GRID = "--kind aprilgrid --square 200 --columns 4 --rows 5"
BOARD = ("--square", "200", "--columns", "5", "--rows", "7")


def run(*arguments: object):
    return CliRunner().invoke(calibrate, ["board", *(str(a) for a in arguments)])


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("board")
    return stored_files(folder, board_pictures, "board", sources=["tests.support.board_films"]), room(2, size=SIZE)


@pytest.mark.nightly
def test_pictures_of_a_board_give_a_calibration(pictures, tmp_path):
    folder, cameras = pictures
    result = run(folder, *BOARD, "-o", tmp_path / "a.toml", "--json")
    assert result.exit_code in (0, 3), result.output
    data = json.loads(result.output[result.output.index("{") :])
    assert [one["name"] for one in data["cameras"]] == ["cam01", "cam02"]
    assert data["expected_error_m"] < 0.05
    found = read_calibration(tmp_path / "a.toml")
    assert rig_error_m(list(found.values()), cameras, places()) < 0.03


def test_given_lenses_make_it_accurate_and_the_report_is_read_by_people(pictures, tmp_path):
    folder, cameras = pictures
    write_calibration(tmp_path / "lenses.toml", {one.name: one for one in cameras})
    result = run(folder, *BOARD, "--lenses", tmp_path / "lenses.toml", "-o", tmp_path / "a.toml")
    assert result.exit_code == 3, result.output  # without a floor
    for text in (
        "cam01: ",
        "given lens",
        "seen together: cam01 and cam02",
        "verdict: poor\n",
        "the floor is not known",
        "next: ",
    ):
        assert text in result.output
    found = read_calibration(tmp_path / "a.toml")
    assert rig_error_m(list(found.values()), cameras, places()) < 0.004


@pytest.mark.nightly
def test_the_floor_of_pictures_is_that_of_their_number(pictures, tmp_path):
    folder, cameras = pictures
    write_calibration(tmp_path / "lenses.toml", {one.name: one for one in cameras})
    options = ("--lenses", tmp_path / "lenses.toml", "--floor", "15", "-o", tmp_path / "a.toml")
    result = run(folder, *BOARD, *options)
    assert result.exit_code == 0, result.output
    assert "verdict: good" in result.output
    for name, camera in read_calibration(tmp_path / "a.toml").items():
        true = next(one for one in cameras if one.name == name)
        assert camera.centre == pytest.approx(true.centre, abs=0.02)


@pytest.mark.nightly
def test_an_april_grid_is_calibrated_and_its_wrong_spacing_named(tmp_path):
    cameras = board_pictures(tmp_path / "films", 12, checked_board("aprilgrid", 4, 5, 200.0), seed=2)
    write_calibration(tmp_path / "lenses.toml", {one.name: one for one in cameras})
    options = (*GRID.split(), "--lenses", tmp_path / "lenses.toml")
    result = run(tmp_path / "films", *options, "--floor", "11", "-o", tmp_path / "a.toml")
    assert result.exit_code in (0, 3), result.output
    assert "board: aprilgrid, 4 x 5 tags of 200 mm, spacing 0.3" in result.output
    found = read_calibration(tmp_path / "a.toml")
    assert rig_error_m(list(found.values()), cameras, places()) < 0.004
    for name, camera in found.items():  # of the board's place and direction, too
        true = next(one for one in cameras if one.name == name)
        assert camera.centre == pytest.approx(true.centre, abs=0.03)
    result = run(tmp_path / "films", *options, "--spacing", "0.25", "-o", tmp_path / "b.toml")
    assert result.exit_code == 1, result.output
    assert "--spacing 0.25: in the images, 0.30" in result.output
    assert not (tmp_path / "b.toml").exists()


@pytest.mark.parametrize(
    ("options", "status", "text"),
    [
        (("--square", "0.1"), 1, "--square 0.1: allowed: the side of a square, 2 to 1000 mm"),
        (("--square", "200", "--columns", "2"), 1, "--columns 2: allowed: 3 to 40 squares"),
        (("--square", "200", "--dictionary", "9x9"), 1, "--dictionary 9x9: allowed: 4x4_50, "),
        (("--square", "200", "--marker", "220"), 1, "--marker 220: allowed: 60 to less than 200 mm"),
        (
            ("--square", "200", "--kind", "chessboard", "--columns", "5"),
            1,
            "--columns 5 --rows 9: a chessboard looks the same",
        ),
        (("--square", "200", "--spacing", "0.3"), 1, "--spacing 0.3: allowed: with --kind aprilgrid"),
        (("--square", "200", "--kind", "aprilgrid", "--spacing", "3"), 1, "--spacing 3: allowed: 0.1 to 1"),
        pytest.param(("--square", "200", "--kind", "chessboard"), 1, "the board has markers", marks=pytest.mark.nightly),
        (("--square", "200", "--lenses", "none.toml"), 1, "none.toml: no such calibration file"),
        ((), 2, "--square"),
    ],
)
def test_wrong_options_are_refused(pictures, tmp_path, options, status, text):
    result = run(pictures[0], *options, "-o", tmp_path / "a.toml")
    assert (result.exit_code, text in result.output) == (status, True), result.output
    assert not (tmp_path / "a.toml").exists()


@pytest.mark.nightly
def test_other_columns_and_mirrored_pictures_are_named(pictures, tmp_path):
    import cv2

    folder, _ = pictures
    result = run(folder, "--square", "200", "--columns", "6", "--rows", "7", "-o", tmp_path / "a.toml")
    assert result.exit_code == 1
    assert "cam01: the board is not found: " in result.output
    assert "--columns 5 --rows 7" in result.output
    mirrored = tmp_path / "mirrored"
    for camera in ("cam01", "cam02"):
        (mirrored / camera).mkdir(parents=True)
        for path in (folder / camera).iterdir():
            cv2.imwrite(str(mirrored / camera / path.name), cv2.flip(cv2.imread(str(path)), 1))
    result = run(mirrored, *BOARD, "-o", tmp_path / "a.toml")
    assert (result.exit_code, "the images are mirrored" in result.output) == (1, True), result.output


def test_an_existing_calibration_and_empty_folders_are_refused(pictures, tmp_path):
    (tmp_path / "a.toml").write_text("mine")
    result = run(pictures[0], *BOARD, "-o", tmp_path / "a.toml")
    assert (result.exit_code, "exists already: allowed: another name, or --force" in result.output) == (1, True)
    assert (tmp_path / "a.toml").read_text() == "mine"
    (tmp_path / "empty").mkdir()
    result = run(tmp_path / "empty", *BOARD, "-o", tmp_path / "b.toml")
    assert (result.exit_code, "no videos and no folders of images in it" in result.output) == (1, True)
