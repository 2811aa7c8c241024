"""AprilGrids: Kalibr's layout, corners in drawn images, the measured spacing."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_pictures import before, picture_of, plain_camera, true_pixels
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.april_grid import AprilGridFinder, check_spacing, columns_of, measured_spacing
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.board_detection import BoardDetector
from zenocap.tools.setup.calibration.board_views import View

CAMERA = plain_camera()
GRID = checked_board("aprilgrid", 6, 6, 60.0)
TURNS = [(0.0, 0.0, 0.0), (0.4, -0.3, 0.2), (0.0, 0.7, 1.5), (0.3, 0.3, 3.1)]
TAG_0, TAG_7 = 0xD5D628584, 0x10652E1D4  # published codes of the family: rows of six cells, white where a bit is set


def drawn(distance, turn, board=GRID):
    return picture_of(board, CAMERA, before(board, distance, turn))


def view_of(board, distance, turn):
    ids, pixels = BoardDetector(board).corners(drawn(distance, turn, board))
    return View(0.0, ids, pixels, np.zeros_like(pixels))


@pytest.mark.parametrize(("number", "code"), [(0, TAG_0), (7, TAG_7)])
def test_tags_are_upright_as_kalibr_prints_them(number, code):
    cells = GRID.tag(number)
    assert cells.shape == (10, 10)
    assert (cells[:2] == 0).all()
    assert (cells[:, -2:] == 0).all()
    bits = "".join("1" if cell else "0" for cell in cells[2:-2, 2:-2].ravel())
    assert int(bits, 2) == code


def test_tags_are_numbered_from_the_bottom_left_and_corners_from_the_top():
    assert [GRID.tag_number(column, row) for column, row in ((0, 5), (5, 5), (0, 4), (5, 0))] == [0, 5, 6, 35]
    assert GRID.corners.shape == (144, 3)
    assert GRID.corners[[0, 1, 2, 12, 24]][:, :2] == pytest.approx(
        np.array([[0, 0], [0.06, 0], [0.078, 0], [0, 0.06], [0, 0.078]])
    )
    assert GRID.middle == pytest.approx(GRID.corners.mean(axis=0))


@pytest.mark.nightly
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("distance", [0.5, 0.8, 1.1])
def test_corners_are_found_where_they_are(turn, distance):
    pose = before(GRID, distance, turn, (0.02, -0.01))
    ids, pixels = BoardDetector(GRID).corners(picture_of(GRID, CAMERA, pose))
    true = true_pixels(GRID, CAMERA, pose)
    errors = np.hypot(*(pixels - true[ids]).T)
    inside = ((true > 12) & (true < np.array(CAMERA.size) - 13)).all(axis=1)
    assert len(ids) >= 0.95 * 4 * inside.reshape(6, 2, 6, 2).all(axis=(1, 3)).sum() > 60  # of whole tags
    assert (np.diff(ids) > 0).all()
    assert errors.max() < 0.35
    assert np.sqrt((errors**2).mean()) < 0.15


@pytest.mark.slow
def test_tags_that_are_there_twice_are_left_out():
    twice = np.concatenate([drawn(0.8, TURNS[0])] * 2, axis=1)
    assert AprilGridFinder(GRID).corners(twice) is None


@pytest.mark.nightly
@pytest.mark.parametrize("spacing", [0.2, 0.3, 0.5])
def test_the_spacing_is_measured_and_a_wrong_one_is_refused(spacing):
    shown = replace(GRID, spacing=spacing)
    views = [view_of(shown, distance, turn) for distance, turn in zip((0.6, 0.8, 0.9), TURNS[:3], strict=True)]
    assert measured_spacing(GRID, views) == pytest.approx(spacing, abs=0.004)
    check_spacing(shown, views)
    for told in (spacing - 0.03, spacing + 0.03):
        with pytest.raises(UserError, match=rf"--spacing {told:g}: in the images, {spacing:.1f}\d\d of the side of a tag"):
            check_spacing(replace(GRID, spacing=told), views)


def test_without_neighbouring_tags_no_spacing_is_measured():
    assert measured_spacing(GRID, []) is None
    check_spacing(checked_board("charuco", 5, 7, 30.0), [])


@pytest.mark.slow
def test_a_wrong_spacing_still_finds_the_tags_whose_spacing_is_then_named():
    """Otherwise the answer would be that there is no board."""
    ids, pixels = BoardDetector(GRID).corners(drawn(0.7, TURNS[1], replace(GRID, spacing=0.25)))
    assert len(ids) > 100
    with pytest.raises(UserError, match=r"--spacing 0\.3: in the images, 0\.2"):
        check_spacing(GRID, [View(0.0, ids, pixels, np.zeros_like(pixels))])


@pytest.mark.slow
def test_the_tags_of_a_row_are_counted_from_the_image():
    assert columns_of(AprilGridFinder(GRID).alike(drawn(0.7, TURNS[1]))) == 6
    assert columns_of({}) is None
