"""Corners of boards in drawn images with known truth; variants; what is said where no board is found."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_pictures import before, picture_of, plain_camera, true_pixels
from tests.support.board_views import with_fisheye
from tests.support.carried_board import seen_corners
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.board_detection import BoardDetector, board_variant, in_order, why_not_found

CAMERA = plain_camera()
CHARUCO = checked_board("charuco", 5, 7, 35.0)
EVEN = checked_board("charuco", 8, 6, 28.0)
CHESSBOARD = checked_board("chessboard", 6, 9, 30.0)
GRID = checked_board("aprilgrid", 6, 6, 60.0)
TURNS = [(0.0, 0.0, 0.0), (0.4, -0.3, 0.2), (0.0, 0.5, 1.5), (0.3, 0.3, 3.1), (-0.3, 0.2, -2.0)]


def drawn(board, turns=TURNS[1:2]):
    """Images in which the board fills most of the height."""
    distance = 0.7 if board.kind == "aprilgrid" else 0.6
    return [picture_of(board, CAMERA, before(board, distance, turn), seed) for seed, turn in enumerate(turns)]


@pytest.mark.nightly
@pytest.mark.parametrize("board", [*CHARUCO.variants(), *EVEN.variants(), CHESSBOARD])
@pytest.mark.parametrize("turn", TURNS)
def test_corners_are_found_where_they_are(board, turn):
    pose = before(board, 0.55, turn, (0.02, -0.01))
    ids, pixels = BoardDetector(board).corners(picture_of(board, CAMERA, pose))
    true = true_pixels(board, CAMERA, pose)
    errors = np.hypot(*(pixels - true[ids]).T)
    assert len(ids) >= 0.8 * len(true)
    assert (np.diff(ids) > 0).all()
    assert errors.max() < 0.3
    assert np.sqrt((errors**2).mean()) < (0.07 if board.kind == "chessboard" else 0.12)


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(6, 9), (9, 6), (4, 5), (7, 4)])
@pytest.mark.parametrize("turn", [0.0, 1.5, 3.1, -1.5])
def test_a_chessboard_has_the_same_numbers_however_it_is_turned(size, turn):
    board = checked_board("chessboard", *size, 30.0)
    pose = before(board, 0.6, (0.2, -0.2, turn))
    ids, pixels = BoardDetector(board).corners(picture_of(board, CAMERA, pose))
    assert ids.tolist() == list(range(len(board.corners)))
    assert pixels == pytest.approx(true_pixels(board, CAMERA, pose), abs=0.3)


@pytest.mark.slow
def test_a_board_at_the_edge_is_found_in_part_and_a_hidden_one_is_not():
    pose = before(CHARUCO, 0.45, (0.1, 0.2, 0.1), (0.2, 0.0))
    image = picture_of(CHARUCO, CAMERA, pose)
    ids, pixels = BoardDetector(CHARUCO).corners(image)
    assert 6 <= len(ids) < 24
    assert pixels == pytest.approx(true_pixels(CHARUCO, CAMERA, pose)[ids], abs=0.4)
    image[:, int(pixels[:, 0].min()) + 40 :] = 90  # one column stays: on a line
    assert BoardDetector(CHARUCO).corners(image) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("board", "distance", "turn", "hidden", "half_px", "least", "error_px"),
    [(CHARUCO, 0.5, (0.2, 0.2, 0.0), 13, 40, 10, 0.4), (GRID, 0.8, TURNS[1], 66, 50, 81, 0.7)],
    ids=["charuco", "aprilgrid"],
)
def test_a_hand_before_the_board_hides_its_corners_only(board, distance, turn, hidden, half_px, least, error_px):
    pose = before(board, distance, turn)
    image, true = picture_of(board, CAMERA, pose), true_pixels(board, CAMERA, pose)
    column, row = true[hidden].astype(int)
    image[row - half_px : row + half_px, column - half_px : column + half_px] = 120
    ids, pixels = BoardDetector(board).corners(image)
    assert hidden not in ids
    assert len(ids) >= least
    assert pixels == pytest.approx(true[ids], abs=error_px)


@pytest.mark.nightly
@pytest.mark.parametrize(("board", "least"), [(EVEN, 60), (GRID, 251)], ids=["charuco", "aprilgrid"])
def test_variants_are_recognized(board, least):
    for variant in board.variants():
        found, count = board_variant(board, drawn(variant, TURNS[:2]))
        assert found == variant
        assert count >= least


@pytest.mark.slow
def test_near_boards_are_accepted_however_the_lens_bends_them():
    """A board that fills the image says the most about the lens."""
    rng, accepted, seen_views = np.random.default_rng(0), 0, 0
    for camera in (plain_camera(focal=350.0, k1=-0.25), with_fisheye(plain_camera((1280, 720)))):
        for _ in range(100):
            pose = before(CHARUCO, rng.uniform(0.15, 0.4), rng.normal(0, [0.4, 0.4, 1.0]), rng.normal(0, 0.1, 2))
            local = CHARUCO.corners @ pose[0].T + pose[1]
            pixels, seen = seen_corners(camera, CHARUCO.corners, pose)
            seen &= np.hypot(*local[:, :2].T) < 0.95 * local[:, 2]  # beyond, the polynomial of the lens turns back
            if seen.sum() >= 6:
                seen_views += 1
                accepted += in_order(CHARUCO, (np.flatnonzero(seen), pixels[seen]))
    assert seen_views > 100
    assert accepted >= 0.98 * seen_views


def test_mirrored_and_wrongly_numbered_corners_are_not_accepted():
    true = true_pixels(CHARUCO, CAMERA, before(CHARUCO, 0.5, (0.2, 0.3, 0.5)))
    ids, rng = np.arange(24), np.random.default_rng(0)
    assert in_order(CHARUCO, (ids, true))
    assert not in_order(CHARUCO, (ids, true * [-1, 1] + [640, 0]))
    assert not in_order(CHARUCO, (ids, true.reshape(6, 4, 2)[:, ::-1].reshape(-1, 2)))
    for _ in range(20):
        assert not in_order(CHARUCO, (ids, rng.permutation(true)))
    other = checked_board("charuco", 7, 5, 35.0)
    assert not in_order(other, (ids, true))


MARKERS_250 = checked_board("charuco", 8, 6, 28.0, dictionary="5x5_250")


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("shown", "told", "reason"),
    [
        (CHARUCO, replace(CHARUCO, columns=7, rows=5), "its markers fit --columns 5 --rows 7"),
        (CHARUCO, replace(CHARUCO, columns=4), "its markers fit --columns 5 --rows 7"),
        (CHARUCO, replace(CHARUCO, dictionary="5x5_100"), "are of another dictionary: --dictionary 4x4_50"),
        (MARKERS_250, replace(MARKERS_250, dictionary="apriltag_36h11"), "another dictionary: --dictionary 5x5_50"),
        (CHESSBOARD, replace(CHESSBOARD, columns=5, rows=8), "6 and 9 fit (squares, not inner corners)"),
        (CHESSBOARD, CHARUCO, "a chessboard of 6 and 9 squares without markers is seen: --kind chessboard"),
        (CHARUCO, CHESSBOARD, "the board has markers: --kind charuco --dictionary 4x4_50"),
        (CHARUCO, GRID, "no AprilGrid is seen, but markers: --kind charuco --dictionary 4x4_50"),
        (GRID, replace(GRID, columns=5), "its tags fit --columns 6 --rows 6"),
        (GRID, replace(GRID, columns=9, rows=4), "its tags fit --columns 6 --rows 6"),
        (GRID, CHARUCO, "the board has the tags of an AprilGrid: --kind aprilgrid"),
        (GRID, CHESSBOARD, "the board has the tags of an AprilGrid: --kind aprilgrid"),
    ],
)
def test_what_is_wrong_with_the_description_is_named(shown, told, reason):
    images = drawn(shown)
    assert board_variant(told, images)[1] == 0
    assert reason in why_not_found(told, images)


CHANGES = {
    "mirrored": lambda image: image[:, ::-1],
    "dark": lambda image: (image * 0.08).astype(np.uint8),
    "noise": lambda image: np.random.default_rng(0).normal(120, 20, image.shape).astype(np.uint8),
    "half hidden": lambda image: np.where(np.arange(640) < 300, image, 120).astype(np.uint8),
}


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("board", "change", "reason"),
    [
        (CHARUCO, "mirrored", "the images are mirrored"),
        (CHARUCO, "dark", "too dark (mean level 14 of 255): more light"),
        (CHARUCO, "noise", "no markers are seen: is it a charuco, 5 x 7 squares of 35 mm"),
        (CHARUCO, "half hidden", "markers are seen at once: show more of the board"),
        (CHESSBOARD, "noise", "is it a chessboard, 6 x 9 squares"),
        (GRID, "mirrored", "the images are mirrored"),
        (GRID, "dark", "too dark"),
        (GRID, "noise", "no tags are seen: is this a aprilgrid, 6 x 6 tags of 60 mm"),
    ],
)
def test_what_is_wrong_with_the_images_is_named(board, change, reason):
    assert reason in why_not_found(board, [CHANGES[change](image) for image in drawn(board)])
