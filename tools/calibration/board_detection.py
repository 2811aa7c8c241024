"""Detection of a printed board in images, and what is wrong where none is found."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image, Ints
from zenocap.tools.calibration.board import DICTIONARIES, Board
from zenocap.tools.calibration.parameters import DARK_LEVEL, MIN_CORNERS

Corners = tuple[Ints, Floats]
"""ids (n,), ascending, and pixels (n, 2) of corners."""

SPREAD = 0.02  # least ratio of the extents of corners: those on one line fix no pose
LAYOUT_PX, LAYOUT_SHARE = 5.0, 0.9  # of marker corners off a layout, and share of them that fit it
REASON_IMAGES = 4  # in which other markers are searched: large dictionaries take a third of a second each
OTHERS = ("4x4_1000", "5x5_1000", "6x6_1000", "7x7_1000", "apriltag_36h11", "original")


class BoardDetector:
    """Finds one board in grey images."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._detector = cv2.aruco.CharucoDetector(board.opencv()) if board.kind == "charuco" else None

    def corners(self, grey: Image) -> Corners | None:
        """Corners of the board in an image (height, width); None for fewer than six, or when they are on a line."""
        image = 255 - grey if self.board.inverted else grey
        found = self._chessboard(image) if self._detector is None else self._charuco(image)
        if found is None or len(found[0]) < MIN_CORNERS:
            return None
        extents = np.linalg.svd(found[1] - found[1].mean(axis=0), compute_uv=False)
        if extents[1] < SPREAD * extents[0] or not self._in_line(found):
            return None
        return found

    def _charuco(self, image: Image) -> Corners | None:
        assert self._detector is not None
        pixels, ids, _, _ = self._detector.detectBoard(image)
        if ids is None or len(ids) == 0:
            return None
        order = np.argsort(ids.ravel())
        return ids.ravel()[order].astype(np.int64), pixels.reshape(-1, 2)[order].astype(np.float64)

    def _chessboard(self, image: Image) -> Corners | None:
        across, down = self.board.columns - 1, self.board.rows - 1
        good, pixels = cv2.findChessboardCornersSB(image, (across, down), None, cv2.CALIB_CB_NORMALIZE_IMAGE)
        if not good:
            return None
        grid = pixels.reshape(down, across, 2).astype(np.float64)
        right, below = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
        if right[0] * below[1] - right[1] * below[0] < 0:  # a board is not seen from behind
            grid = grid[:, ::-1]
        if _first_square_white(image, grid):  # picture(): the square at the top left is black
            grid = grid[::-1, ::-1]
        return np.arange(across * down), grid.reshape(-1, 2)

    def _in_line(self, found: Corners) -> bool:
        """Whether the corners lie as on a plane seen from the front: no mirrored and no wrongly numbered board."""
        plane = self.board.corners[found[0], :2].astype(np.float32)
        seen = found[1].astype(np.float32)
        homography, fitting = cv2.findHomography(plane, seen, cv2.RANSAC, 8.0)
        missing: object = homography  # None where no plane fits, which the stubs do not say
        if missing is None:
            return False
        # The Jacobian of the plane's image is det(H) / w³: positive where the board is seen from its front.
        depth = float(homography[2] @ np.append(plane.mean(axis=0), 1.0))
        return bool(fitting.mean() > 0.7 and np.linalg.det(homography) * depth > 0)


def board_variant(board: Board, images: Sequence[Image]) -> tuple[Board, int]:
    """The variant of the board with the most corners in the images, and their number."""
    counts = []
    for variant in board.variants():
        detector = BoardDetector(variant)
        counts.append(sum(len(found[0]) for image in images if (found := detector.corners(image)) is not None))
    best = int(np.argmax(counts))
    return board.variants()[best], counts[best]


def why_not_found(board: Board, images: Sequence[Image]) -> str:
    """Why no view of the board was found in grey images, in words, and what to do."""
    if (level := float(np.mean([image.mean() for image in images]))) < DARK_LEVEL:
        return f"the images are too dark (mean level {level:.0f} of 255): more light, or a longer exposure"
    images = images[:: max(1, len(images) // REASON_IMAGES)]
    if board.kind == "chessboard":
        return _other_chessboard(board, images)
    if board_variant(board, [np.ascontiguousarray(image[:, ::-1]) for image in images])[1]:
        return "the images are mirrored: switch mirroring off in the camera or its program"
    names = [board.dictionary, *(name for name in OTHERS if name != board.dictionary)]
    seen = {name: max((_markers(name, image) for image in images), key=lambda found: len(found[0])) for name in names}
    name = max(names, key=lambda one: (len(seen[one][0]), one == board.dictionary))
    ids, corners = seen[name]
    if len(ids) < 3:
        return f"no markers are seen: is it a {board}? It must be flat, sharp, lit evenly, and cover a tenth of the image"
    if name != board.dictionary and len(ids) > len(seen[board.dictionary][0]) + 2:
        return f"its markers are of another dictionary: --dictionary {_smallest(name, int(ids.max()))}"
    if (layout := _layout(board, ids, corners)) is not None and layout != (board.columns, board.rows):
        columns, rows = layout
        return f"the board has other numbers of squares: its markers fit --columns {columns} --rows {rows}"
    return f"only {len(ids)} markers are seen at once: show more of the board, nearer and sharper"


def _first_square_white(image: Image, grid: Floats) -> bool:
    """Whether the square with the first two corners of a row and of a column, inside the grid, is white."""
    inside = [grid[k : k + 2, j : j + 2].reshape(-1, 2).mean(axis=0) for k in (0, 1) for j in (0, 1)][:2]
    levels = [cv2.getRectSubPix(image, (3, 3), tuple(float(value) for value in place)).mean() for place in inside]
    return bool(levels[0] > levels[1])


def _markers(dictionary: str, image: Image) -> Corners:
    markers = cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary])
    for seen in (image, np.asarray(255 - image, dtype=np.uint8)):
        corners, ids, _ = cv2.aruco.ArucoDetector(markers).detectMarkers(seen)
        if corners:
            return np.asarray(ids, dtype=np.int64).ravel(), np.array(corners, dtype=np.float64).reshape(-1, 4, 2)
    return np.zeros(0, dtype=np.int64), np.zeros((0, 4, 2))


def _smallest(name: str, greatest: int) -> str:
    """The smallest dictionary of the same markers that has the id `greatest`."""
    kind, _, count = name.rpartition("_")
    if not count.isdigit():
        return name
    return next(f"{kind}_{size}" for size in (50, 100, 250, 1000) if greatest < size)


def _layout(board: Board, ids: Ints, corners: Floats) -> tuple[int, int] | None:
    """Columns and rows of the board on which markers lie as in the image; None when none fits or several do."""
    fits = []
    for columns in range(3, 16):
        rows = max(3, -(-2 * (int(ids.max()) + 1) // columns))
        for one in replace(board, columns=columns, rows=rows + rows % 2).variants():
            places = [np.asarray(corner)[:, :2] for corner in one.opencv().getObjPoints()]
            if one.inverted or ids.max() >= len(places):
                continue
            plane = np.concatenate([places[id] for id in ids]).astype(np.float32)
            _, fitting = cv2.findHomography(plane, corners.reshape(-1, 2).astype(np.float32), cv2.RANSAC, LAYOUT_PX)
            if fitting is not None and fitting.mean() > LAYOUT_SHARE:
                fits.append((columns, rows))
    kept = set(fits)
    if any(columns == board.columns for columns, _ in kept):
        columns, rows = next(one for one in fits if one[0] == board.columns)
        return (columns, max(rows, board.rows))
    return kept.pop() if len(kept) == 1 else None


def _other_chessboard(board: Board, images: Sequence[Image]) -> str:
    for columns in range(4, 12):
        for rows in range(3, columns + 1):
            if {columns, rows} == {board.columns, board.rows}:
                continue
            if any(cv2.findChessboardCornersSB(image, (columns - 1, rows - 1), None)[0] for image in images[:3]):
                return f"the board has other numbers of squares: {columns} and {rows} fit (squares, not inner corners)"
    return f"is it a {board}? All of a chessboard must be seen, flat, sharp, and with a white margin"
