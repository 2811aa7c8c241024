"""AprilGrids: tag corners in an image, spacing, numbers.

OpenCV finds tags; where squares touch their corners it misses many, above all small ones.  The others are predicted from
their neighbours and accepted where the cells in the image are those of the tag.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image, Ints
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration import parameters as p
from zenocap.tools.setup.calibration.board import DICTIONARIES, Board
from zenocap.tools.setup.calibration.board_views import View

Quads = dict[int, Floats]
"""Corners (4, 2) px by the number of a tag: clockwise from the one at the top left of the upright tag."""

UNIT = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
NEAREST = 4  # tags that predict another one
REFINEMENT = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 0.01)


class AprilGridFinder:
    """Finds the tags of one AprilGrid in grey images."""

    def __init__(self, board: Board) -> None:
        self.board = board
        dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[board.dictionary])
        self._passes = []
        for scale, contrast in p.TAG_PASSES:
            parameters = cv2.aruco.DetectorParameters()
            parameters.markerBorderBits, parameters.adaptiveThreshConstant = board.border, contrast
            self._passes.append((scale, cv2.aruco.ArucoDetector(dictionary, parameters)))
        numbers = range(board.columns * board.rows)
        self._cells = {number: board.tag(number).astype(np.float64) / 255.0 for number in numbers}
        # Column and row, from the top, of each tag.
        self._places = {board.tag_number(j, k): (j, k) for k in range(board.rows) for j in range(board.columns)}
        side = 6 + 2 * board.border
        middles = (np.arange(side) + 0.5) / side
        self._middles = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 1, 2)

    def corners(self, image: Image) -> tuple[Ints, Floats] | None:
        """Numbers (n,), ascending, and pixels (n, 2) of the corners of all tags in an image (height, width)."""
        quads = self.alike(image)
        spacing = measured_spacing(self.board, [self._view(quads)]) or self.board.spacing  # it may be given wrongly
        tried: set[int] = set()
        while quads:
            predicted = self._predicted(quads, tried, spacing)
            tried |= set(predicted)
            found = self._refined(image, predicted)
            if not found:
                break
            quads |= found
        quads = self._consistent(quads, spacing)
        view = self._view(quads)
        return (view.ids, view.pixels) if quads else None

    def _view(self, quads: Quads) -> View:
        """The corners of tags as a view."""
        ids, pixels = [], []
        for number, quad in quads.items():
            column, row = self._places[number]
            for (right, below), pixel in zip(UNIT.astype(int), quad, strict=True):
                ids.append((2 * row + below) * 2 * self.board.columns + 2 * column + right)
                pixels.append(pixel)
        order = np.argsort(ids)
        places = np.array(pixels, dtype=np.float64).reshape(-1, 2)[order]
        return View(0.0, np.array(ids, dtype=np.int64)[order], places, np.zeros_like(places))

    def alike(self, image: Image) -> Quads:
        """Tags that OpenCV finds and that look like them, exact."""
        return self._refined(image, self.tags(image))

    def tags(self, image: Image) -> Quads:
        """Tags that OpenCV finds, with numbers of the board; none that are there twice."""
        found: Quads = {}
        for scale, detector in self._passes:
            larger = image if scale == 1 else cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
            quads, ids, _ = detector.detectMarkers(larger)
            if len(quads) == 0:  # then ids are None
                continue
            numbers = [int(number) for number in np.ravel(ids)]
            for number, quad in zip(numbers, quads, strict=True):
                if number in self._places and numbers.count(number) == 1:
                    upright = np.roll(np.asarray(quad, dtype=np.float64).reshape(4, 2), 2, axis=0)
                    found.setdefault(number, (upright + 0.5) / scale - 0.5)
            if len(found) >= p.FEW_TAGS:
                break
        return found

    def _predicted(self, quads: Quads, tried: set[int], spacing: float) -> Quads:
        """Places of tags beside the known ones."""
        found: Quads = {}
        places = np.array([self._places[number] for number in quads])
        known = list(quads)
        for number, place in self._places.items():
            apart = np.abs(places - place).max(axis=1)
            if number in quads or number in tried or apart.min() > 1:
                continue
            near = [known[k] for k in np.argsort(apart, kind="stable")[:NEAREST]]
            flat = np.concatenate([self._flat(one, spacing) for one in near])
            homography, _ = cv2.findHomography(flat, np.concatenate([quads[one] for one in near]))
            if np.shape(homography) == (3, 3):  # else these corners are on a line
                found[number] = cv2.perspectiveTransform(self._flat(number, spacing)[None], homography)[0]
        return found

    def _consistent(self, quads: Quads, spacing: float) -> Quads:
        """The tags that are where their neighbours predict them; those without any stay."""
        kept: Quads = {}
        for number, quad in quads.items():
            others = {one: place for one, place in quads.items() if one != number}
            predicted = self._predicted(others, set(self._places) - {number}, spacing).get(number) if others else None
            side = float(np.hypot(*(np.roll(quad, -1, axis=0) - quad).T).max())
            if predicted is None or np.hypot(*(predicted - quad).T).max() < 0.5 + p.TAG_BEND * side:
                kept[number] = quad
        return kept

    def _flat(self, number: int, spacing: float) -> Floats:
        """Corners (4, 2) of a tag on the board, by the side of a tag."""
        return UNIT + np.array(self._places[number]) * (1.0 + spacing)

    def _refined(self, image: Image, quads: Quads) -> Quads:
        """Tags with exact corners, of those that look like the tag."""
        found: Quads = {}
        height, width = image.shape
        for number, quad in quads.items():
            sides = np.hypot(*(np.roll(quad, -1, axis=0) - quad).T)
            # No other corner in the window: half of the border of a tag, or of the white beside it.
            cell = float(sides.min()) / (6 + 2 * self.board.border)
            if not np.isfinite(quad).all() or cell * (6 + 2 * self.board.border) < p.MIN_TAG_PX:
                continue
            reach = int(np.clip(0.5 * min(self.board.border * cell, self.board.spacing * float(sides.min())), 1, 6))
            if (quad <= reach + 1).any() or (quad >= np.array([width, height]) - reach - 2).any():
                continue
            exact = quad.astype(np.float32).reshape(4, 1, 2).copy()
            cv2.cornerSubPix(image, exact, (reach, reach), (-1, -1), REFINEMENT)
            refined = exact.reshape(4, 2).astype(np.float64)
            if np.hypot(*(refined - quad).T).max() > reach + 1.0 or not self._alike(image, number, refined):
                continue
            found[number] = refined
        return found

    def _alike(self, image: Image, number: int, quad: Floats) -> bool:
        """Whether the cells in the image correlate with those of the tag."""
        homography = cv2.getPerspectiveTransform(UNIT.astype(np.float32), quad.astype(np.float32))
        places = cv2.perspectiveTransform(self._middles, homography).astype(np.float32)
        seen = cv2.remap(image, places[..., 0], places[..., 1], cv2.INTER_LINEAR).ravel().astype(np.float64)
        return bool(seen.std() > 1.0 and np.corrcoef(seen, self._cells[number].ravel())[0, 1] > p.TAG_ALIKE)


def columns_of(quads: Quads) -> int | None:
    """Tags in a row of an AprilGrid, from the numbers and places of its tags in an image; None where that is not seen."""
    counts: dict[int, int] = {}
    for number, quad in quads.items():
        homography = cv2.getPerspectiveTransform(quad.astype(np.float32), UNIT.astype(np.float32))
        for other, place in quads.items():
            across, down = cv2.perspectiveTransform(place.mean(axis=0).reshape(1, 1, 2), homography)[0, 0] - 0.5
            # The tag straight above has the number that is larger by the tags of a row.
            if other > number + 1 and abs(across) < 0.5 and -2.2 < down < -1.0:
                counts[other - number] = counts.get(other - number, 0) + 1
    return max(counts, key=lambda count: counts[count]) if counts else None


def measured_spacing(board: Board, views: Sequence[View]) -> float | None:
    """Spacing of an AprilGrid, by the side of its tags, that fits pairs of neighbouring tags best; None without pairs.

    The eight corners of a pair lie on a plane that any view maps by a homography, which leaves the spacing over.
    """
    pairs = _pairs(board, views)
    if len(pairs) == 0:
        return None
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(lambda spacing: _misfit(pairs, float(spacing)), bounds=(0.02, 1.5), method="bounded")
    return float(found.x)


def check_spacing(board: Board, views: Sequence[View]) -> None:
    """Raise UserError where the tags of an AprilGrid are not as far apart as its description has them."""
    if board.kind != "aprilgrid" or (found := measured_spacing(board, views)) is None:
        return
    if abs(found - board.spacing) > p.SPACING_OFF:
        raise UserError(
            f"--spacing {board.spacing:g}: in the images, {found:.3f} of the side of a tag is between two tags: allowed: "
            "what is measured on the print, the white between two tags by the side of a tag"
        )


def _pairs(board: Board, views: Sequence[View]) -> Floats:
    """Pixels (n, 8, 2) of two neighbouring tags, the second along the first axis of the board; at most SPACING_PAIRS."""
    found = []
    for view in views:
        grid = np.full((*board.grid, 2), np.nan)
        grid.reshape(-1, 2)[view.ids] = view.pixels
        tags = np.stack([grid[0::2, 0::2], grid[0::2, 1::2], grid[1::2, 1::2], grid[1::2, 0::2]], axis=2)
        turned = tags[:, :, [0, 3, 2, 1]].swapaxes(0, 1)  # columns become rows
        for one in (tags, turned):
            found.append(np.concatenate([one[:, :-1], one[:, 1:]], axis=2).reshape(-1, 8, 2))
    pairs = np.concatenate(found) if found else np.zeros((0, 8, 2))
    pairs = pairs[np.isfinite(pairs).all(axis=(1, 2))]
    sizes = np.ptp(pairs, axis=1).max(axis=1)
    pairs = pairs[sizes >= np.median(sizes)] if len(pairs) else pairs  # small tags seem farther apart
    return np.asarray(pairs[:: max(1, -(-len(pairs) // p.SPACING_PAIRS))])


def _misfit(pairs: Floats, spacing: float) -> float:
    """Mean distance of the corners of pairs (n, 8, 2) from the best homographies of a spacing, px; outliers count less."""
    flat = np.concatenate([UNIT, UNIT + np.array([1.0 + spacing, 0.0])])
    middle = pairs.mean(axis=1, keepdims=True)
    size = np.abs(pairs - middle).max(axis=(1, 2), keepdims=True)
    seen = (pairs - middle) / size
    ones, none = np.ones(8), np.zeros((8, 3))
    plane = np.column_stack([flat, ones])
    rows = []
    for axis in (0, 1):
        first, second = (plane, none) if axis == 0 else (none, plane)
        fixed = np.broadcast_to(np.hstack([first, second]), (len(pairs), 8, 6))
        rows.append(np.concatenate([fixed, -seen[:, :, axis, None] * flat], axis=2))
    matrix, target = np.concatenate(rows, axis=1), np.concatenate([seen[..., 0], seen[..., 1]], axis=1)
    solved = np.linalg.solve(matrix.transpose(0, 2, 1) @ matrix, (matrix.transpose(0, 2, 1) @ target[..., None]))[..., 0]
    homography = np.concatenate([solved, np.ones((len(pairs), 1))], axis=1).reshape(-1, 3, 3)
    mapped = plane @ homography.transpose(0, 2, 1)
    errors = np.hypot(*np.moveaxis((mapped[..., :2] / mapped[..., 2:] - seen) * size, -1, 0))
    return float(np.sqrt((errors**2).mean(axis=1)).mean())
