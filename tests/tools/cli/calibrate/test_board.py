"""`calibrate board` on pictures of a simulated board: the calibration, the report, and wrong calls."""

import json
from functools import partial

import cv2
import pytest

from tests.support.board_films import SIZE, board_pictures
from tests.support.board_views import places, rig_error_m, room
from tests.support.command import printed, zenocap
from tests.support.stored import stored_files
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.tools.setup.calibration.board import checked_board

pytestmark = pytest.mark.slow
GRID = ("--kind", "aprilgrid", "--square", "200", "--columns", "4", "--rows", "5")
BOARD = ("--square", "200", "--columns", "5", "--rows", "7")
board = partial(printed, "calibrate", "board")


def assert_true(path, cameras, error_m, centre_m=None):
    """A calibration file is that of the cameras, within an error of the rig and, if given, of the place in the world."""
    found = read_calibration(path)
    assert rig_error_m(list(found.values()), cameras, places()) < error_m
    for true in cameras if centre_m else ():
        assert found[true.name].centre == pytest.approx(true.centre, abs=centre_m)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("board")
    return stored_files(folder, board_pictures, "board", sources=["tests.support.board_films"])


@pytest.fixture(scope="module")
def cameras():
    return room(2, size=SIZE)


@pytest.fixture
def lenses(cameras, tmp_path):
    write_calibration(tmp_path / "lenses.toml", {one.name: one for one in cameras})
    return "--lenses", tmp_path / "lenses.toml"


@pytest.mark.nightly
def test_pictures_of_a_board_give_a_calibration(pictures, cameras, tmp_path):
    status, output, _ = zenocap("calibrate", "board", pictures, *BOARD, "-o", tmp_path / "a.toml", "--json")
    assert status in (0, 3), output
    data = json.loads(output[output.index("{") :])
    assert [one["name"] for one in data["cameras"]] == ["cam01", "cam02"]
    assert data["expected_error_m"] < 0.05
    assert_true(tmp_path / "a.toml", cameras, 0.03)


def test_given_lenses_make_it_accurate_and_the_report_is_read_by_people(pictures, cameras, lenses, tmp_path):
    output = board(pictures, *BOARD, *lenses, "-o", tmp_path / "a.toml", status=3)  # without a floor
    for text in ("cam01: ", "given lens", "seen together: cam01 and cam02", "the floor is not known", "next: "):
        assert text in output
    assert "verdict: poor\n" in output
    assert_true(tmp_path / "a.toml", cameras, 0.004)


@pytest.mark.nightly
def test_the_floor_of_pictures_is_that_of_their_number(pictures, cameras, lenses, tmp_path):
    assert "verdict: good" in board(pictures, *BOARD, *lenses, "--floor", "15", "-o", tmp_path / "a.toml")
    assert_true(tmp_path / "a.toml", cameras, 0.03, centre_m=0.02)


@pytest.mark.nightly
def test_an_april_grid_is_calibrated_and_its_wrong_spacing_named(lenses, tmp_path):
    cameras = board_pictures(tmp_path / "films", 12, checked_board("aprilgrid", 4, 5, 200.0), seed=2)
    write_calibration(lenses[1], {one.name: one for one in cameras})
    options = (tmp_path / "films", *GRID, *lenses)
    status, output, _ = zenocap("calibrate", "board", *options, "--floor", "11", "-o", tmp_path / "a.toml")
    assert status in (0, 3), output
    assert "board: aprilgrid, 4 x 5 tags of 200 mm, spacing 0.3" in output
    assert_true(tmp_path / "a.toml", cameras, 0.004, centre_m=0.03)
    output = board(*options, "--spacing", "0.25", "-o", tmp_path / "b.toml", status=1)
    assert "--spacing 0.25: in the images, 0.30" in output
    assert not (tmp_path / "b.toml").exists()


@pytest.mark.parametrize(
    ("options", "status", "text"),
    [
        ("--square 0.1", 1, "--square 0.1: allowed: the side of a square, 2 to 1000 mm"),
        ("--square 200 --dictionary 9x9", 1, "--dictionary 9x9: allowed: 4x4_50, "),
        ("--square 200 --marker 220", 1, "--marker 220: allowed: 60 to less than 200 mm"),
        ("--square 200 --kind chessboard --columns 5", 1, "--columns 5 --rows 9: a chessboard looks the same"),
        pytest.param("--square 200 --kind chessboard", 1, "the board has markers", marks=pytest.mark.nightly),
        ("--square 200 --lenses none.toml", 1, "none.toml: no such calibration file"),
        ("", 2, "--square"),
    ],
)
def test_wrong_options_are_refused(pictures, tmp_path, options, status, text):
    assert text in board(pictures, *options.split(), "-o", tmp_path / "a.toml", status=status)
    assert not (tmp_path / "a.toml").exists()


@pytest.mark.nightly
def test_other_columns_and_mirrored_pictures_are_named(pictures, tmp_path):
    output = board(pictures, "--square", "200", "--columns", "6", "--rows", "7", "-o", tmp_path / "a.toml", status=1)
    assert "cam01: the board is not found: " in output
    assert "--columns 5 --rows 7" in output
    mirrored = tmp_path / "mirrored"
    for camera in ("cam01", "cam02"):
        (mirrored / camera).mkdir(parents=True)
        for path in (pictures / camera).iterdir():
            cv2.imwrite(str(mirrored / camera / path.name), cv2.flip(cv2.imread(str(path)), 1))
    assert "the images are mirrored" in board(mirrored, *BOARD, "-o", tmp_path / "a.toml", status=1)


def test_an_existing_calibration_and_empty_folders_are_refused(pictures, tmp_path):
    (tmp_path / "a.toml").write_text("mine")
    output = board(pictures, *BOARD, "-o", tmp_path / "a.toml", status=1)
    assert "exists already: allowed: another name, or --force" in output
    assert (tmp_path / "a.toml").read_text() == "mine"
    (tmp_path / "empty").mkdir()
    output = board(tmp_path / "empty", *BOARD, "-o", tmp_path / "b.toml", status=1)
    assert "no videos and no folders of images in it" in output
