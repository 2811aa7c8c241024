"""AprilGrids: Kalibr's layout, corners in drawn images, the measured spacing, and why none is found."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_pictures import before, picture_of, plain_camera, true_pixels
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.april_grid import AprilGridFinder, check_spacing, columns_of, measured_spacing
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.board_detection import BoardDetector, board_variant, why_not_found
from zenocap.tools.setup.calibration.board_views import View

CAMERA = plain_camera()
GRID = checked_board("aprilgrid", 6, 6, 60.0)
TURNS = [(0.0, 0.0, 0.0), (0.4, -0.3, 0.2), (0.0, 0.7, 1.5), (0.3, 0.3, 3.1)]
TAG_0, TAG_7 = 0xD5D628584, 0x10652E1D4  # published codes of the family: rows of six cells, white where a bit is set


def drawn(board, distance=0.7, turns=TURNS[:2]):
    return [picture_of(board, CAMERA, before(board, distance, turn), seed) for seed, turn in enumerate(turns)]


def view_of(board, distance, turn, seed=0):
    ids, pixels = BoardDetector(board).corners(picture_of(board, CAMERA, before(board, distance, turn), seed))
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


@pytest.mark.nightly
def test_both_borders_are_recognized():
    for border in (1, 2):
        shown = replace(GRID, border=border)
        found, count = board_variant(GRID, drawn(shown))
        assert found == shown
        assert count > 250


@pytest.mark.slow
def test_tags_that_are_there_twice_are_left_out():
    image = drawn(GRID, 0.8)[0]
    twice = np.concatenate([image, image], axis=1)
    assert AprilGridFinder(GRID).corners(twice) is None


@pytest.mark.slow
def test_a_hand_before_the_board_hides_its_tags_only():
    pose = before(GRID, 0.8, TURNS[1])
    image, true = picture_of(GRID, CAMERA, pose), true_pixels(GRID, CAMERA, pose)
    column, row = true[66].astype(int)
    image[row - 50 : row + 50, column - 50 : column + 50] = 120
    ids, pixels = BoardDetector(GRID).corners(image)
    assert 66 not in ids
    assert len(ids) > 80
    assert pixels == pytest.approx(true[ids], abs=0.7)


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
    pose = before(replace(GRID, spacing=0.25), 0.7, TURNS[1])
    image = picture_of(replace(GRID, spacing=0.25), CAMERA, pose)
    ids, pixels = BoardDetector(GRID).corners(image)
    assert len(ids) > 100
    with pytest.raises(UserError, match=r"--spacing 0\.3: in the images, 0\.2"):
        check_spacing(GRID, [View(0.0, ids, pixels, np.zeros_like(pixels))])


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("told", "reason"),
    [
        (replace(GRID, columns=5), "its tags fit --columns 6 --rows 6"),
        (replace(GRID, columns=9, rows=4), "its tags fit --columns 6 --rows 6"),
        (checked_board("charuco", 5, 7, 30.0), "the board has the tags of an AprilGrid: --kind aprilgrid"),
        (checked_board("chessboard", 6, 9, 30.0), "the board has the tags of an AprilGrid: --kind aprilgrid"),
    ],
)
def test_what_is_wrong_with_the_description_is_named(told, reason):
    images = drawn(GRID, turns=TURNS[1:2])
    assert board_variant(told, images)[1] == 0
    assert reason in why_not_found(told, images)


@pytest.mark.nightly
def test_what_is_wrong_with_the_images_is_named():
    images = drawn(GRID, turns=TURNS[1:2])
    assert "the images are mirrored" in why_not_found(GRID, [np.ascontiguousarray(image[:, ::-1]) for image in images])
    assert "too dark" in why_not_found(GRID, [(image * 0.08).astype(np.uint8) for image in images])
    noise = np.random.default_rng(0).normal(120, 20, (480, 640)).astype(np.uint8)
    assert "no tags are seen: is this a aprilgrid, 6 x 6 tags of 60 mm" in why_not_found(GRID, [noise])
    charuco = checked_board("charuco", 5, 7, 60.0)
    assert "no AprilGrid is seen, but markers: --kind charuco --dictionary 4x4_50" in why_not_found(GRID, drawn(charuco))


@pytest.mark.slow
def test_the_tags_of_a_row_are_counted_from_the_image():
    assert columns_of(AprilGridFinder(GRID).alike(drawn(GRID)[1])) == 6
    assert columns_of({}) is None
