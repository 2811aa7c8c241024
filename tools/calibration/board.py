"""Printed boards: ChArUco boards and chessboards, their corners and markers."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import cv2
import numpy as np

from zenocap.common.arrays import Bytes, Floats
from zenocap.common.errors import UserError
from zenocap.tools.calibration.parameters import MARKER_SHARE

Kind = Literal["charuco", "chessboard"]

DEFAULT_COLUMNS, DEFAULT_ROWS = 5, 7  # of `calibrate print` and `calibrate board`; a ChArUco board that fits A4
DEFAULT_CHESSBOARD = 6, 9  # columns, rows of a printed chessboard: one must be even, the other odd
DEFAULT_DICTIONARY = "4x4_50"
MIN_SQUARES, MAX_SQUARES = 3, 40
MIN_CHESSBOARD = 4  # squares; OpenCV finds no chessboard with fewer than three inner corners in a row
MIN_SQUARE_M, MAX_SQUARE_M = 0.002, 1.0
DICTIONARIES = {  # OpenCV's, by the name on the command line
    f"{bits}_{count}": getattr(cv2.aruco, f"DICT_{bits.upper()}_{count}")
    for bits in ("4x4", "5x5", "6x6", "7x7")
    for count in (50, 100, 250, 1000)
}
DICTIONARIES["apriltag_36h11"] = cv2.aruco.DICT_APRILTAG_36h11
DICTIONARIES["original"] = cv2.aruco.DICT_ARUCO_ORIGINAL


def usual_squares(kind: Kind) -> tuple[int, int]:
    """Columns and rows of a board that are taken without options."""
    return DEFAULT_CHESSBOARD if kind == "chessboard" else (DEFAULT_COLUMNS, DEFAULT_ROWS)


@dataclass(frozen=True)
class Board:
    """A printed board.  columns, rows: squares.  square_m, marker_m: their sides.

    Its frame: X along a row, Y down the columns, Z into the board; the origin is the outer corner at the top left.
    legacy: pattern of OpenCV before 4.6, which differs for even rows.  inverted: black and white are exchanged.
    """

    kind: Kind
    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str = DEFAULT_DICTIONARY
    legacy: bool = False
    inverted: bool = False

    @cached_property
    def corners(self) -> Floats:
        """Inner corners (n, 3) m, row by row; the index is a corner's id."""
        across, down = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        flat = np.stack([across, down, np.zeros_like(across)], axis=-1).reshape(-1, 3)
        return np.asarray(flat * self.square_m, dtype=np.float64)

    @property
    def middle(self) -> Floats:
        """(3,) m, in the board's frame."""
        return np.array([self.columns, self.rows, 0.0]) * self.square_m / 2.0

    def variants(self) -> list["Board"]:
        """The board itself, its older pattern, and both with black and white exchanged."""
        if self.kind == "chessboard":
            return [self]
        patterns = [self] if self.rows % 2 else [self, replace(self, legacy=True)]
        return [replace(one, inverted=inverted) for inverted in (False, True) for one in patterns]

    def opencv(self) -> Any:
        """The board as OpenCV's CharucoBoard."""
        markers = cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary])
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, markers)
        board.setLegacyPattern(self.legacy)
        return board

    def picture(self, px: int) -> Bytes:
        """Grey image (rows * px, columns * px) of the board, `px` a square."""
        if self.kind == "chessboard":
            odd = np.indices((self.rows, self.columns)).sum(axis=0) % 2
            return np.kron(np.where(odd, 255, 0), np.ones((px, px))).astype(np.uint8)
        image = np.asarray(self.opencv().generateImage((self.columns * px, self.rows * px)), dtype=np.uint8)
        return 255 - image if self.inverted else image

    def __str__(self) -> str:
        squares = f"{self.columns} x {self.rows} squares of {1000 * self.square_m:g} mm"
        return f"{self.kind}, {squares}" + ("" if self.kind == "chessboard" else f", markers {self.dictionary}")


def checked_board(
    kind: Kind,
    columns: int,
    rows: int,
    square_mm: float,
    marker_mm: float | None = None,
    dictionary: str = DEFAULT_DICTIONARY,
) -> Board:
    """The board of these measures; without `marker_mm`, markers have 0.75 of the square's side.  Raises UserError."""
    for option, count in (("--columns", columns), ("--rows", rows)):
        least = MIN_CHESSBOARD if kind == "chessboard" else MIN_SQUARES
        if not least <= count <= MAX_SQUARES:
            raise UserError(f"{option} {count}: allowed: {least} to {MAX_SQUARES} squares")
    if not MIN_SQUARE_M <= square_mm / 1000 <= MAX_SQUARE_M:
        limits = f"{1000 * MIN_SQUARE_M:g} to {1000 * MAX_SQUARE_M:g} mm"
        raise UserError(f"--square {square_mm:g}: allowed: the side of a square, {limits}, measured on the printed board")
    marker = MARKER_SHARE * square_mm if marker_mm is None else marker_mm
    if not 0.3 * square_mm <= marker < square_mm:
        allowed = f"{0.3 * square_mm:g} to less than {square_mm:g} mm, the side of a square"
        raise UserError(f"--marker {marker:g}: allowed: {allowed}")
    if dictionary not in DICTIONARIES:
        raise UserError(f"--dictionary {dictionary}: allowed: {', '.join(DICTIONARIES)}")
    if kind == "chessboard" and (columns + rows) % 2 == 0:
        raise UserError(
            f"--columns {columns} --rows {rows}: a chessboard looks the same turned by 180 degrees then, and cameras could "
            "not agree: allowed: one number even, the other odd"
        )
    board = Board(kind, columns, rows, square_mm / 1000, marker / 1000, dictionary)
    if kind == "charuco":
        held = len(cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary]).bytesList)
        if (needed := columns * rows // 2) > held:
            bits = dictionary[:3] if f"{dictionary[:3]}_1000" in DICTIONARIES else "4x4"
            larger = f"{bits}_{next(size for size in (100, 250, 1000) if needed <= size)}"
            raise UserError(f"--dictionary {dictionary}: has {held} markers, the board {needed}: allowed: such as {larger}")
    return board
