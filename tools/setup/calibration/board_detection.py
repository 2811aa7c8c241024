"""Detection of a printed board in images, and what is wrong where none is found."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image, Ints
from zenocap.tools.setup.calibration.april_grid import REFINEMENT, AprilGridFinder, columns_of
from zenocap.tools.setup.calibration.board import APRILGRID_DICTIONARY, DICTIONARIES, Board
from zenocap.tools.setup.calibration.parameters import DARK_LEVEL, MIN_CORNERS

Corners = tuple[Ints, Floats]
"""ids (n,), ascending, and pixels (n, 2) of corners."""

SPREAD = 0.02  # least ratio of the extents of corners: those on one line fix no pose
IN_ORDER = 0.9  # least share of neighbouring corners that lie as on a board
MAX_BEND = 0.5  # of the distance of the outer ones of three corners: the middle one is off theirs; equal to 1 : 3 squares
REFINED_PX = 16.0  # least distance of corners that are refined: smaller windows gain nothing
LAYOUT_PX, LAYOUT_SHARE = 5.0, 0.9  # of marker corners off a layout, and share of them that fit it
REASON_IMAGES = 4  # in which other markers are searched: large dictionaries take a third of a second each
OTHERS = ("4x4_1000", "5x5_1000", "6x6_1000", "7x7_1000", "apriltag_36h11", "original")
EVERY_TAG = Board("aprilgrid", 1, 587, 1.0, 1.0, APRILGRID_DICTIONARY, spacing=0.3)  # all tags of the family
CHESSBOARD_SQUARES = 5  # at least, of a chessboard that is named; between blurred markers fewer are seen
APRILGRID_SEEN = "the board has the tags of an AprilGrid: --kind aprilgrid"
MIRRORED = "the images are mirrored: switch mirroring off in the camera or its program"


class BoardDetector:
    """Finds one board in grey images."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._detector = cv2.aruco.CharucoDetector(board.opencv()) if board.kind == "charuco" else None
        self._grid = AprilGridFinder(board) if board.kind == "aprilgrid" else None

    def corners(self, grey: Image) -> Corners | None:
        """Corners of the board in an image (height, width); None for fewer than six, or when they are on a line."""
        image = 255 - grey if self.board.inverted else grey
        if self._grid is not None:
            found = self._grid.corners(image)
        else:
            found = self._chessboard(image) if self._detector is None else self._charuco(image)
        return found if found is not None and is_view(self.board, found) else None

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
        apart = (np.diff(pixels.reshape(down, across, 2), axis=axis) for axis in (0, 1))
        if (step := float(min(np.hypot(*np.moveaxis(one, -1, 0)).min() for one in apart))) >= REFINED_PX:
            reach = int(np.clip(step / 4, 3, 8))
            cv2.cornerSubPix(image, pixels, (reach, reach), (-1, -1), REFINEMENT)
        grid = pixels.reshape(down, across, 2).astype(np.float64)
        right, below = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
        if right[0] * below[1] - right[1] * below[0] < 0:  # a board is not seen from behind
            grid = grid[:, ::-1]
        if _first_square_white(image, grid):  # picture(): the square at the top left is black
            grid = grid[::-1, ::-1]
        return np.arange(across * down), grid.reshape(-1, 2)


def is_view(board: Board, found: Corners) -> bool:
    """Whether corners are enough, not on one line, and in order."""
    if len(found[0]) < MIN_CORNERS:
        return False
    extents = np.linalg.svd(found[1] - found[1].mean(axis=0), compute_uv=False)
    return bool(extents[1] >= SPREAD * extents[0]) and in_order(board, found)


def in_order(board: Board, found: Corners) -> bool:
    """Whether neighbours lie as on a plane seen from the front: no mirrored and no wrongly numbered board.

    Only neighbours are compared: over the whole image a lens may bend the board by many pixels.
    """
    grid = np.full((*board.grid, 2), np.nan)
    grid.reshape(-1, 2)[found[0]] = found[1]
    square = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]  # clockwise in the image
    turned = np.concatenate([_area(*(square[k] for k in range(4) if k != left)).ravel() for left in range(4)])
    step = 2 if board.kind == "aprilgrid" else 1  # from tag to tag: corners that are equally far apart
    ends = slice(None, -2 * step), slice(step, -step), slice(2 * step, None)
    bent = np.concatenate([_bend(*(grid[:, one] for one in ends)), _bend(*(grid[one] for one in ends))])
    turned, bent = turned[np.isfinite(turned)], bent[np.isfinite(bent)]
    straight = len(bent) == 0 or bool((bent < MAX_BEND).mean() > IN_ORDER)
    return straight and len(turned) > 0 and bool((turned > 0).mean() > IN_ORDER)


def board_variant(board: Board, images: Sequence[Image]) -> tuple[Board, int]:
    """The variant of the board with the most corners in the images, and their number."""
    return best_variant(board, variant_counts(board, images))


def variant_counts(board: Board, images: Sequence[Image]) -> list[int]:
    """Numbers of corners in the images by variant of the board."""
    counts = []
    for variant in board.variants():
        detector = BoardDetector(variant)
        counts.append(sum(len(found[0]) for image in images if (found := detector.corners(image)) is not None))
    return counts


def best_variant(board: Board, counts: Sequence[int]) -> tuple[Board, int]:
    """The variant with the most corners, and their number; see `variant_counts`."""
    best = int(np.argmax(counts))
    return board.variants()[best], counts[best]


def why_not_found(board: Board, images: Sequence[Image]) -> str:
    """Reason that no view of the board was found in grey images, and the remedy."""
    if (level := float(np.mean([image.mean() for image in images]))) < DARK_LEVEL:
        return f"the images are too dark (mean level {level:.0f} of 255): more light, or a longer exposure"
    images = images[:: max(1, len(images) // REASON_IMAGES)]
    if board.kind == "chessboard":
        return _other_chessboard(board, images)
    if board.kind == "aprilgrid":
        return _other_grid(board, images)
    if _mirrored(board, images):
        return MIRRORED
    names = [board.dictionary, *(name for name in OTHERS if name != board.dictionary)]
    seen = {name: max((_markers(name, image) for image in images), key=lambda found: len(found[0])) for name in names}
    name = max(names, key=lambda one: (len(seen[one][0]), one == board.dictionary))
    ids, corners = seen[name]
    if len(ids) < 3 and len(_most_tags(images)) >= 3:
        return APRILGRID_SEEN
    if len(ids) < 3:
        squares = _chessboard_squares(images)
        if squares is not None and squares[0] >= CHESSBOARD_SQUARES:
            return f"a chessboard of {squares[0]} and {squares[1]} squares without markers is seen: --kind chessboard"
        return f"no markers are seen: is it a {board}? It must be flat, sharp, lit evenly, and cover a tenth of the image"
    if name != board.dictionary and len(ids) > len(seen[board.dictionary][0]) + 2:
        return f"its markers are of another dictionary: --dictionary {_smallest(name, int(ids.max()))}"
    if (layout := _layout(board, ids, corners)) is not None and layout != (board.columns, board.rows):
        columns, rows = layout
        return f"the board has other numbers of squares: its markers fit --columns {columns} --rows {rows}"
    return f"only {len(ids)} markers are seen at once: show more of the board, nearer and sharper"


def _mirrored(board: Board, images: Sequence[Image]) -> bool:
    """Whether the board is found in the mirrored images."""
    return board_variant(board, [np.ascontiguousarray(image[:, ::-1]) for image in images])[1] > 0


def _area(one: Floats, next_one: Floats, last: Floats) -> Floats:
    """Twice the areas of triangles (..., 2), positive when clockwise in the image."""
    first, second = next_one - one, last - one
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


def _bend(one: Floats, middle: Floats, last: Floats) -> Floats:
    """Offset of the middle one of three points (..., 2) from the outer ones' middle, over the distance of these; (n,)."""
    off, whole = one + last - 2 * middle, last - one
    return np.asarray(np.hypot(off[..., 0], off[..., 1]) / np.maximum(np.hypot(whole[..., 0], whole[..., 1]), 1e-9)).ravel()


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


def _most_tags(images: Sequence[Image]) -> dict[int, Floats]:
    """The tags of the image with most tags of AprilGrids, of any numbers."""
    finders = [AprilGridFinder(EVERY_TAG), AprilGridFinder(replace(EVERY_TAG, border=1))]
    return max((finder.alike(image) for image in images for finder in finders), key=len)


def _other_grid(board: Board, images: Sequence[Image]) -> str:
    """Reason that no AprilGrid was found in images, for people."""
    most = _most_tags(images)
    if _mirrored(board, images):
        return MIRRORED
    if len(most) >= 3:
        columns = columns_of(most)
        if columns is not None and columns != board.columns:
            rows = max(board.rows if columns * board.rows > max(most) else 0, max(most) // columns + 1)
            return f"the board has other numbers of tags: its tags fit --columns {columns} --rows {rows}"
        return f"only {len(most)} tags are seen at once: show more of the board, nearer and sharper"
    for name in OTHERS:
        ids = max((_markers(name, image)[0] for image in images), key=len)
        if len(ids) >= 3 and name != APRILGRID_DICTIONARY:
            return f"no AprilGrid is seen, but markers: --kind charuco --dictionary {_smallest(name, int(ids.max()))}"
    return f"no tags are seen: is this a {board}? It must be flat, sharp, lit evenly, and each tag 22 px large or more"


def _other_chessboard(board: Board, images: Sequence[Image]) -> str:
    for name in OTHERS:
        ids = max((_markers(name, image)[0] for image in images), key=len)
        if len(ids) >= 3 and name == APRILGRID_DICTIONARY:
            return f"{APRILGRID_SEEN}, or --kind charuco --dictionary {name}"
        if len(ids) >= 3:
            return f"the board has markers: --kind charuco --dictionary {_smallest(name, int(ids.max()))}"
    if len(_most_tags(images)) >= 3:
        return APRILGRID_SEEN
    seen = _chessboard_squares(images)
    if seen is not None and set(seen) != {board.columns, board.rows}:
        return f"the board has other numbers of squares: {seen[0]} and {seen[1]} fit (squares, not inner corners)"
    return f"is it a {board}? All of a chessboard must be seen, flat, sharp, and with a white margin"


def _chessboard_squares(images: Sequence[Image]) -> tuple[int, int] | None:
    """Numbers of squares, the smaller first, of the chessboard in most of the images."""
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_LARGER
    found = (cv2.findChessboardCornersSBWithMeta(image, (3, 3), flags) for image in images)
    sizes = Counter(tuple(sorted(meta.shape[:2])) for good, _, meta in found if good)
    if not sizes:
        return None
    fewer, more = sizes.most_common(1)[0][0]
    return fewer + 1, more + 1
