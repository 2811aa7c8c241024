"""Printed boards: ChArUco boards, chessboards and AprilGrids, their corners and markers."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import cv2
import numpy as np

from zenocap.common.arrays import Bytes, Floats
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.parameters import MARKER_SHARE

Kind = Literal["charuco", "chessboard", "aprilgrid"]

DEFAULT_COLUMNS, DEFAULT_ROWS = 5, 7  # of `calibrate print` and `calibrate board`; a ChArUco board that fits A4
DEFAULT_CHESSBOARD = 6, 9  # columns, rows of a printed chessboard: one must be even, the other odd
DEFAULT_APRILGRID = 6, 6  # columns, rows of tags: the board of Kalibr's manual
DEFAULT_DICTIONARY, APRILGRID_DICTIONARY = "4x4_50", "apriltag_36h11"
DEFAULT_SPACING = 0.3  # between the tags of an AprilGrid, by their side: Kalibr's default
MIN_SPACING, MAX_SPACING = 0.1, 1.0  # below, OpenCV finds no tags; above, Kalibr makes none
MIN_SQUARES, MAX_SQUARES = 3, 40
MIN_TAGS = 2  # in a row or column of an AprilGrid
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
    if kind == "charuco":
        return DEFAULT_COLUMNS, DEFAULT_ROWS
    return DEFAULT_CHESSBOARD if kind == "chessboard" else DEFAULT_APRILGRID


@dataclass(frozen=True)
class Board:
    """A printed board.  columns, rows: squares, or tags of an AprilGrid.  square_m, marker_m: their sides.

    Its frame: X along a row, Y down the columns, Z into the board.  The origin is the outer corner at the top left, of an
    AprilGrid that of its tags.  legacy: pattern of OpenCV before 4.6, which differs for even rows.  inverted: black and
    white are exchanged.  spacing: between the tags of an AprilGrid, by their side.  border: of a tag, in cells.
    """

    kind: Kind
    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str = DEFAULT_DICTIONARY
    legacy: bool = False
    inverted: bool = False
    spacing: float = 0.0
    border: int = 2

    @cached_property
    def corners(self) -> Floats:
        """Inner corners, or those of the tags, (n, 3) m, row by row; the index is a corner's id."""
        if self.kind == "aprilgrid":
            columns, rows = (np.arange(2 * count) for count in (self.columns, self.rows))
            across, down = np.meshgrid(*(n // 2 * (1.0 + self.spacing) + n % 2 for n in (columns, rows)))
        else:
            across, down = np.meshgrid(np.arange(1.0, self.columns), np.arange(1.0, self.rows))
        flat = np.stack([across, down, np.zeros_like(across)], axis=-1).reshape(-1, 3)
        return np.asarray(flat * self.square_m, dtype=np.float64)

    @property
    def middle(self) -> Floats:
        """(3,) m, in the board's frame."""
        if self.kind == "aprilgrid":
            return np.asarray(self.corners[-1] / 2.0)
        return np.array([self.columns, self.rows, 0.0]) * self.square_m / 2.0

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns of the corners."""
        return (2 * self.rows, 2 * self.columns) if self.kind == "aprilgrid" else (self.rows - 1, self.columns - 1)

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height of what is printed, by the side of a square or tag, with the squares around tags."""
        if self.kind == "aprilgrid":
            return self.columns + (self.columns + 1) * self.spacing, self.rows + (self.rows + 1) * self.spacing
        return float(self.columns), float(self.rows)

    def variants(self) -> list["Board"]:
        """The board itself, its older pattern, and both with black and white exchanged; an AprilGrid with either border."""
        if self.kind == "aprilgrid":
            return [replace(self, border=border) for border in (2, 1)]
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
        """Grey image of the board, `px` a square: (rows * px, columns * px), or the `extent` of an AprilGrid."""
        if self.kind == "aprilgrid":
            return self._april_picture(px)
        if self.kind == "chessboard":
            odd = np.indices((self.rows, self.columns)).sum(axis=0) % 2
            return np.kron(np.where(odd, 255, 0), np.ones((px, px))).astype(np.uint8)
        image = np.asarray(self.opencv().generateImage((self.columns * px, self.rows * px)), dtype=np.uint8)
        return 255 - image if self.inverted else image

    def tag_number(self, column: int, row: int) -> int:
        """The tag of an AprilGrid in a row from the top: Kalibr counts from the bottom left."""
        return (self.rows - 1 - row) * self.columns + column

    def tag(self, number: int) -> Bytes:
        """Cells (side, side) of a tag with its border, upright as Kalibr prints it, 0 black.

        OpenCV has the tags of this family turned by 180 degrees.
        """
        markers = cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary])
        side = markers.markerSize + 2 * self.border
        drawn = cv2.aruco.generateImageMarker(markers, number, side, borderBits=self.border)
        return np.ascontiguousarray(np.asarray(drawn, dtype=np.uint8)[::-1, ::-1])

    def _april_picture(self, px: int) -> Bytes:
        gap = round(self.spacing * px)
        image = np.full((self.rows * (px + gap) + gap, self.columns * (px + gap) + gap), 255, dtype=np.uint8)
        for row in range(self.rows + 1):
            for column in range(self.columns + 1):
                top, left = row * (px + gap), column * (px + gap)
                image[top : top + gap, left : left + gap] = 0
                if row < self.rows and column < self.columns:
                    drawn = cv2.resize(self.tag(self.tag_number(column, row)), (px, px), interpolation=cv2.INTER_NEAREST)
                    image[top + gap : top + gap + px, left + gap : left + gap + px] = drawn
        return image

    def __str__(self) -> str:
        if self.kind == "aprilgrid":
            return f"aprilgrid, {self.columns} x {self.rows} tags of {1000 * self.square_m:g} mm, spacing {self.spacing:g}"
        squares = f"{self.columns} x {self.rows} squares of {1000 * self.square_m:g} mm"
        return f"{self.kind}, {squares}" + ("" if self.kind == "chessboard" else f", markers {self.dictionary}")


def checked_board(
    kind: Kind,
    columns: int,
    rows: int,
    square_mm: float,
    marker_mm: float | None = None,
    dictionary: str | None = None,
    spacing: float | None = None,
) -> Board:
    """The board of these measures; without `marker_mm`, markers have 0.75 of the square's side.  Raises UserError.

    dictionary, spacing: None for those that are usual for the kind.
    """
    if kind == "aprilgrid":
        return _checked_grid(columns, rows, square_mm, marker_mm, dictionary, spacing)
    if spacing is not None:
        raise UserError(f"--spacing {spacing:g}: allowed: with --kind aprilgrid")
    dictionary = dictionary or DEFAULT_DICTIONARY
    _check_sizes(columns, rows, MIN_CHESSBOARD if kind == "chessboard" else MIN_SQUARES, square_mm, "square")
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


def _check_sizes(columns: int, rows: int, least: int, square_mm: float, of: str) -> None:
    """Raises UserError for numbers or sides of squares or tags that are not allowed."""
    for option, count in (("--columns", columns), ("--rows", rows)):
        if not least <= count <= MAX_SQUARES:
            raise UserError(f"{option} {count}: allowed: {least} to {MAX_SQUARES} {of}s")
    if not MIN_SQUARE_M <= square_mm / 1000 <= MAX_SQUARE_M:
        limits = f"{1000 * MIN_SQUARE_M:g} to {1000 * MAX_SQUARE_M:g} mm"
        raise UserError(f"--square {square_mm:g}: allowed: the side of a {of}, {limits}, measured on the printed board")


def _checked_grid(
    columns: int, rows: int, tag_mm: float, marker_mm: float | None, dictionary: str | None, spacing: float | None
) -> Board:
    """An AprilGrid.  Raises UserError."""
    _check_sizes(columns, rows, MIN_TAGS, tag_mm, "tag")
    if marker_mm is not None:
        allowed = "--square for the tags of an AprilGrid, and --spacing between them"
        raise UserError(f"--marker {marker_mm:g}: allowed: {allowed}")
    if dictionary not in (None, APRILGRID_DICTIONARY):
        raise UserError(f"--dictionary {dictionary}: allowed: {APRILGRID_DICTIONARY}, of an AprilGrid")
    ratio = DEFAULT_SPACING if spacing is None else spacing
    if not MIN_SPACING <= ratio <= MAX_SPACING:
        allowed = f"{MIN_SPACING:g} to {MAX_SPACING:g}, the white between two tags by the side of a tag"
        raise UserError(f"--spacing {ratio:g}: allowed: {allowed}")
    held = len(cv2.aruco.getPredefinedDictionary(DICTIONARIES[APRILGRID_DICTIONARY]).bytesList)
    if columns * rows > held:
        raise UserError(f"--columns {columns} --rows {rows}: {columns * rows} tags: allowed: up to {held}")
    side_m = tag_mm / 1000
    return Board("aprilgrid", columns, rows, side_m, side_m, APRILGRID_DICTIONARY, spacing=ratio)
