"""Printed boards as PDF files, true to scale: one page of filled rectangles and a few lines of words.

PDF 1.4 (ISO 32000-1).  Lengths are mm from the bottom left of the page until they are written in points of 1/72 inch.
"""

from collections.abc import Sequence
from itertools import groupby
from math import floor

import cv2
import numpy as np

from zenocap.common.arrays import Bytes
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board import DICTIONARIES, Board

PAPERS = {  # width and height, upright, mm
    "a5": (148.0, 210.0),
    "a4": (210.0, 297.0),
    "a3": (297.0, 420.0),
    "a2": (420.0, 594.0),
    "a1": (594.0, 841.0),
    "a0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
}
POINTS = 72 / 25.4  # a mm
MARGIN_MM = 10.0  # that printers leave white, and a board needs white around it
CAPTION_MM = 24.0  # below the board: white, the ruler, and the words
GAP_MM, RULER_MM, TEXT_MM, LINE_MM = 8.0, 100.0, 3.0, 4.2  # white below the board; ruler; height of letters; of lines

Rectangle = tuple[float, float, float, float]
"""left, bottom, width, height, mm."""


def largest_square(columns: float, rows: float, paper: str) -> float:
    """Side in mm, rounded down to 0.1 mm, of the largest squares with which a board fits the paper.

    columns, rows: of squares; of an AprilGrid the board's extent by the side of a tag.
    """
    return max(floor(10 * side + 1e-6) / 10 for side in _sides(columns, rows, paper))


def default_square(columns: float, rows: float, paper: str) -> float:
    """The largest multiple of 5 mm with which a board fits the paper; of 0.5 mm below 5 mm."""
    largest = largest_square(columns, rows, paper)
    step = 5.0 if largest >= 5.0 else 0.5
    return floor(largest / step) * step


def board_pdf(board: Board, paper: str) -> bytes:
    """A PDF with one page: the board, a ruler of 100 mm, and what to do.  Raises UserError where it does not fit."""
    side = 1000 * board.square_m
    across, down = board.extent
    upright, lying = _sides(across, down, paper)
    if side > max(upright, lying) + 1e-6:
        largest = largest_square(across, down, paper)
        pieces = "tags" if board.kind == "aprilgrid" else "squares"
        raise UserError(
            f"--square {side:g}: {board.columns} x {board.rows} {pieces} do not fit --paper {paper} with a margin of "
            f"{MARGIN_MM:g} mm: allowed: up to {largest:g} mm, fewer {pieces}, or a larger paper"
        )
    size = PAPERS[paper] if side <= upright + 1e-6 else PAPERS[paper][::-1]
    left, top = (size[0] - across * side) / 2, size[1] - MARGIN_MM
    shapes = [[(left + x, top - y - h, w, h) for x, y, w, h in shape] for shape in _black(board)]
    foot = top - down * side - GAP_MM
    ruler = [(MARGIN_MM, foot, RULER_MM, 0.3), (MARGIN_MM - 0.15, foot - 2, 0.3, 4.0)]
    ruler.append((MARGIN_MM + RULER_MM - 0.15, foot - 2, 0.3, 4.0))
    words = [(MARGIN_MM + RULER_MM + 3, foot - 1, f"{RULER_MM:g} mm: check with a ruler")]
    name = "tag" if board.kind == "aprilgrid" else "square"
    measured = f"{name}: {side:g} mm: measure it with a ruler after printing; print at 100 %, not 'fit to page'"
    for number, line in enumerate((f"{board}", measured, "glue it to something flat and stiff; keep the white around it")):
        words.append((MARGIN_MM, foot - 6.5 - number * LINE_MM, line))
    return _document(size, _content([*shapes, ruler], words), f"{board}")


def _sides(columns: float, rows: float, paper: str) -> tuple[float, float]:
    """Largest sides of the squares, mm, on the upright paper and on the lying one."""
    width, height = PAPERS[paper]
    upright = min((width - 2 * MARGIN_MM) / columns, (height - 2 * MARGIN_MM - CAPTION_MM) / rows)
    return upright, min((height - 2 * MARGIN_MM) / columns, (width - 2 * MARGIN_MM - CAPTION_MM) / rows)


def _black(board: Board) -> list[list[Rectangle]]:
    """Black shapes, each of rectangles (left, top, width, height), mm from the top left of the board."""
    side = 1000 * board.square_m
    if board.kind == "chessboard":
        return [
            [(j * side, k * side, side, side)] for k in range(board.rows) for j in range(board.columns) if (j + k) % 2 == 0
        ]
    if board.kind == "aprilgrid":
        return _black_grid(board)
    drawn = board.opencv()
    places = [1000 * np.asarray(corners, dtype=np.float64)[:, :2].min(axis=0) for corners in drawn.getObjPoints()]
    white = {(int(place[0] // side), int(place[1] // side)) for place in places}
    squares = [(j, k) for k in range(board.rows) for j in range(board.columns) if (j, k) not in white]
    markers = [_marker(board, int(number), place) for number, place in zip(np.ravel(drawn.getIds()), places, strict=True)]
    return [[(j * side, k * side, side, side)] for j, k in squares] + markers


def _black_grid(board: Board) -> list[list[Rectangle]]:
    """The tags of an AprilGrid and the squares at their corners; see `_black`."""
    side = 1000 * board.square_m
    gap = board.spacing * side
    step = side + gap
    shapes = [[(j * step, k * step, gap, gap)] for k in range(board.rows + 1) for j in range(board.columns + 1)]
    for k in range(board.rows):
        for j in range(board.columns):
            shapes.append(_runs(board.tag(board.tag_number(j, k)), (gap + j * step, gap + k * step), side))
    return shapes


def _marker(board: Board, number: int, place: Sequence[float]) -> list[Rectangle]:
    """Runs of black cells of a marker, with its border of one cell."""
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[board.dictionary])
    cells = dictionary.markerSize + 2
    bits = cv2.aruco.generateImageMarker(dictionary, number, cells)
    return _runs(np.asarray(bits, dtype=np.uint8), place, 1000 * board.marker_m)


def _runs(bits: Bytes, place: Sequence[float], side: float) -> list[Rectangle]:
    """Runs of black cells (n, n) of a marker of a side, mm, whose left upper corner is at `place`."""
    cell, runs = side / len(bits), []
    for k, row in enumerate(bits):
        begin = 0
        for white, group in groupby(row > 127):
            count = len(list(group))
            if not white:
                runs.append((place[0] + begin * cell, place[1] + k * cell, count * cell, cell))
            begin += count
    return runs


def _content(shapes: Sequence[Sequence[Rectangle]], words: Sequence[tuple[float, float, str]]) -> bytes:
    """The page's operators.  A shape is one path: no light seams between its rectangles."""
    lines = ["0 g"]
    for shape in shapes:
        lines += [" ".join(f"{value * POINTS:.4f}" for value in one) + " re" for one in shape] + ["f"]
    for x, y, text in words:
        escaped = text.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")
        lines.append(f"BT /F1 {TEXT_MM * POINTS:.2f} Tf {x * POINTS:.3f} {y * POINTS:.3f} Td ({escaped}) Tj ET")
    return "\n".join(lines).encode("ascii")


def _document(size: tuple[float, float], content: bytes, title: str) -> bytes:
    """A PDF of one page.  Its preferences ask viewers not to scale it."""
    box = " ".join(f"{value * POINTS:.4f}" for value in size)
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {box}] /Contents 4 0 R "
        "/Resources << /Font << /F1 5 0 R >> >> >>".encode(),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        f"<< /Title ({title}) /Producer (zenocap) >>".encode("ascii"),
    ]
    written, starts = b"%PDF-1.4\n", []
    for number, text in enumerate(objects, 1):
        starts.append(len(written))
        written += b"%d 0 obj\n%s\nendobj\n" % (number, text)
    table = b"".join(b"%010d 00000 n \n" % start for start in starts)
    count = len(objects) + 1
    trailer = b"trailer\n<< /Size %d /Root 1 0 R /Info 6 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (count, len(written))
    return written + b"xref\n0 %d\n0000000000 65535 f \n" % count + table + trailer
