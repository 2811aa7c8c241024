"""Boards: numbering of corners, variants, pictures, and allowed measures."""

import numpy as np
import pytest

from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board import checked_board


def test_corners_are_numbered_row_by_row_from_the_outer_corner():
    board = checked_board("charuco", 5, 7, 30.0)
    assert board.corners.shape == (24, 3)
    assert board.corners[0] == pytest.approx([0.03, 0.03, 0.0])
    assert board.corners[3] == pytest.approx([0.12, 0.03, 0.0])
    assert board.corners[4] == pytest.approx([0.03, 0.06, 0.0])
    assert board.middle == pytest.approx([0.075, 0.105, 0.0])
    assert board.corners.mean(axis=0) == pytest.approx(board.middle)
    assert board.marker_m == pytest.approx(0.0225)


def test_opencv_numbers_the_corners_alike():
    for board in checked_board("charuco", 8, 6, 30.0).variants():
        assert np.asarray(board.opencv().getChessboardCorners()) == pytest.approx(board.corners, abs=1e-6)


def test_variants_differ_where_the_patterns_do():
    assert len(checked_board("charuco", 5, 7, 30.0).variants()) == 2  # odd rows: the older pattern is the same
    even = checked_board("charuco", 7, 6, 30.0).variants()
    assert {(one.legacy, one.inverted) for one in even} == {(a, b) for a in (False, True) for b in (False, True)}
    pictures = [one.picture(20) for one in even]
    assert all((a != b).any() for k, a in enumerate(pictures) for b in pictures[:k])
    assert len(checked_board("chessboard", 6, 9, 30.0).variants()) == 1


def test_the_picture_of_a_chessboard_begins_black():
    picture = checked_board("chessboard", 4, 5, 30.0).picture(10)
    assert picture.shape == (50, 40)
    assert picture[5, [5, 15, 25, 35]].tolist() == [0, 255, 0, 255]
    assert picture[15, 5] == 255


def test_the_description_names_what_a_user_must_know():
    assert str(checked_board("charuco", 5, 7, 35.5)) == "charuco, 5 x 7 squares of 35.5 mm, markers 4x4_50"
    assert str(checked_board("chessboard", 6, 9, 25)) == "chessboard, 6 x 9 squares of 25 mm"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("charuco", 2, 7, 30), "--columns 2: allowed: 3 to 40 squares"),
        (("charuco", 5, 41, 30), "--rows 41: allowed: 3 to 40 squares"),
        (("chessboard", 3, 8, 30), "--columns 3: allowed: 4 to 40 squares"),
        (("charuco", 5, 7, 0.03), "--square 0.03: allowed: the side of a square, 2 to 1000 mm"),
        (("charuco", 5, 7, float("nan")), "--square nan: allowed"),
        (("charuco", 5, 7, 30, 30), "--marker 30: allowed: 9 to less than 30 mm"),
        (("charuco", 5, 7, 30, float("nan")), "--marker nan: allowed"),
        (("charuco", 5, 7, 30, None, "DICT_4X4_50"), "--dictionary DICT_4X4_50: allowed: 4x4_50, 4x4_100"),
        (("charuco", 11, 10, 30), "--dictionary 4x4_50: has 50 markers, the board 55: allowed: such as 4x4_100"),
        (("charuco", 40, 40, 30, None, "5x5_50"), "has 50 markers, the board 800: allowed: such as 5x5_1000"),
        (("charuco", 40, 40, 30, None, "apriltag_36h11"), "has 587 markers, the board 800: allowed: such as 4x4_1000"),
        (("aprilgrid", 1, 6, 30), "--columns 1: allowed: 2 to 40 tags"),
        (("aprilgrid", 25, 24, 30), "--columns 25 --rows 24: 600 tags: allowed: up to 587"),
        (("aprilgrid", 6, 6, 1), "--square 1: allowed: the side of a tag, 2 to 1000 mm"),
        (("aprilgrid", 6, 6, 30, 20), "--marker 20: allowed: --square for the tags of an AprilGrid, and --spacing"),
        (("aprilgrid", 6, 6, 30, None, "4x4_50"), "--dictionary 4x4_50: allowed: apriltag_36h11"),
        (("aprilgrid", 6, 6, 30, None, None, 0.05), "--spacing 0.05: allowed: 0.1 to 1, the white between two tags"),
        (("aprilgrid", 6, 6, 30, None, None, float("nan")), "--spacing nan: allowed: 0.1 to 1"),
        (("charuco", 5, 7, 30, None, None, 0.3), "--spacing 0.3: allowed: with --kind aprilgrid"),
        (("chessboard", 5, 7, 30), "a chessboard looks the same turned by 180 degrees"),
    ],
)
def test_wrong_measures_name_option_value_and_range(arguments, message):
    with pytest.raises(UserError) as error:
        checked_board(*arguments)
    assert message in str(error.value)


def test_a_dictionary_with_just_enough_markers_is_allowed():
    assert checked_board("charuco", 10, 10, 30.0).dictionary == "4x4_50"
