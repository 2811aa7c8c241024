"""Printed boards: rendered by PDFium, found by the detector, true to scale."""

import cv2
import numpy as np
import pypdfium2
import pytest

from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.board_detection import BoardDetector
from zenocap.tools.setup.calibration.board_print import MARGIN_MM, PAPERS, POINTS, board_pdf, default_square, largest_square

PX_MM, FINER = 6.0, 3  # of the renderings


def rendered(pdf: bytes) -> np.ndarray:
    """Grey image, PX_MM a mm.  PDFium puts edges on whole pixels: it draws FINER times as large."""
    drawn = pypdfium2.PdfDocument(pdf)[0].render(scale=FINER * PX_MM / POINTS, grayscale=True).to_numpy()
    drawn = np.ascontiguousarray(drawn.reshape(*drawn.shape[:2]))
    return cv2.resize(drawn, None, fx=1 / FINER, fy=1 / FINER, interpolation=cv2.INTER_AREA)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("kind", "columns", "rows", "square", "dictionary", "paper"),
    [
        ("charuco", 5, 7, 35.0, "4x4_50", "a4"),
        ("charuco", 9, 6, 25.0, "5x5_100", "a4"),  # even rows; lying paper
        ("charuco", 7, 5, 20.0, "apriltag_36h11", "letter"),
        ("chessboard", 6, 9, 25.0, "4x4_50", "a4"),
        ("aprilgrid", 6, 6, 20.0, None, "a4"),
        ("aprilgrid", 7, 4, 24.0, None, "a3"),
        ("chessboard", 9, 6, 30.0, "4x4_50", "a3"),
    ],
)
def test_all_corners_of_a_print_are_found_where_they_belong(kind, columns, rows, square, dictionary, paper):
    board = checked_board(kind, columns, rows, square, dictionary=dictionary)
    image = rendered(board_pdf(board, paper))
    width, height = PAPERS[paper]
    assert sorted(image.shape) == pytest.approx(sorted([PX_MM * width, PX_MM * height]), abs=1.5)
    ids, pixels = BoardDetector(board).corners(image)
    assert ids.tolist() == list(range(len(board.corners)))
    expected = 1000 * PX_MM * (board.corners[:, :2] - board.corners[:, :2].mean(axis=0))
    found = pixels - pixels.mean(axis=0)
    assert found == pytest.approx(expected, abs=0.4)
    assert (found * expected).sum(axis=0) / (expected**2).sum(axis=0) == pytest.approx(1.0, abs=1e-3)
    left, top = pixels[0] / PX_MM - square * (board.spacing or 1.0)
    page = image.shape[1] / PX_MM
    assert (left, top) == pytest.approx(((page - board.extent[0] * square) / 2, MARGIN_MM), abs=0.2)


def test_the_margin_is_white_and_the_ruler_is_100_mm():
    image = rendered(board_pdf(checked_board("charuco", 5, 7, 35.0), "a4"))
    margin = int(9.7 * PX_MM)
    for edge in (image[:margin], image[-margin:], image[:, :margin], image[:, -margin:]):
        assert edge.min() > 250
    row = image[round((10 + 7 * 35 + 8 - 1) * PX_MM)]  # 1 mm above the ruler: its ticks
    black = np.flatnonzero(row < 128)
    ticks = black[(black > 5 * PX_MM) & (black < 112 * PX_MM)]
    assert (ticks[-1] - ticks[0]) / PX_MM == pytest.approx(100.0, abs=0.5)
    assert np.all(image[round((10 + 7 * 35 + 8) * PX_MM), ticks[0] : ticks[-1]] < 230)


def test_the_words_and_the_wish_not_to_be_scaled_are_in_the_file():
    pdf = board_pdf(checked_board("charuco", 5, 7, 35.0), "a4")
    assert b"/PrintScaling /None" in pdf
    text = pypdfium2.PdfDocument(pdf)[0].get_textpage().get_text_bounded()
    for words in (
        "charuco, 5 x 7 squares of 35 mm, markers 4x4_50",
        "square: 35 mm: measure it with a ruler after printing; print at 100 %, not 'fit to page'",
        "100 mm: check with a ruler",
    ):
        assert words in text


def test_the_cross_reference_table_points_at_the_objects():
    pdf = board_pdf(checked_board("chessboard", 6, 9, 25.0), "a4")
    start = int(pdf.rsplit(b"startxref\n", 1)[1].split()[0])
    rows = pdf[start:].split(b"trailer")[0].splitlines()[3:]
    for number, row in enumerate(rows, 1):
        assert pdf[int(row[:10]) :].startswith(b"%d 0 obj" % number)


@pytest.mark.parametrize("paper", list(PAPERS))
def test_the_largest_square_fits_and_a_larger_one_does_not(paper):
    largest = largest_square(5, 7, paper)
    board_pdf(checked_board("charuco", 5, 7, largest), paper)
    assert default_square(5, 7, paper) <= largest
    too_large = f"do not fit --paper {paper} with a margin of 10 mm: allowed: up to {largest:g} mm"
    with pytest.raises(UserError, match=too_large):
        board_pdf(checked_board("charuco", 5, 7, largest + 0.1), paper)


def test_the_most_squares_fit_the_smallest_paper():
    assert default_square(40, 40, "a5") == 3.0
    assert default_square(40, 40, "a4") == 4.5
