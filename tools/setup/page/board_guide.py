"""Guide to the next view of a board: coverage, tilts, cameras that saw it together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.tools.setup.calibration.board_views import View
from zenocap.tools.setup.calibration.frame_sets import moved_px
from zenocap.tools.setup.calibration.lens_model import LensModel, plane_poses
from zenocap.tools.setup.calibration.parameters import CELLS
from zenocap.tools.setup.page import parameters as p

Side = Literal["left", "right", "upper", "lower"]
SIDES: tuple[Side, ...] = ("left", "right", "upper", "lower")
"""The edge of the board that is nearest to the camera, as seen in the image."""

# Regions of the image: name, columns and rows of cells, in the order in which they are asked for.
REGIONS: tuple[tuple[str, slice, slice], ...] = (
    ("upper left corner", slice(0, 2), slice(0, 2)),
    ("lower right corner", slice(4, 6), slice(2, 4)),
    ("upper right corner", slice(4, 6), slice(0, 2)),
    ("lower left corner", slice(0, 2), slice(2, 4)),
    ("upper edge", slice(2, 4), slice(0, 1)),
    ("lower edge", slice(2, 4), slice(3, 4)),
    ("middle", slice(2, 4), slice(1, 3)),
)


def nominal_lens(size: tuple[int, int]) -> LensModel:
    """A usual lens of images of `size` (width, height) px, for angles before the lens is known."""
    width, height = size
    focal = p.NOMINAL_FOCAL * width
    return LensModel(size, np.array([focal, focal, (width - 1) / 2, (height - 1) / 2, 0.0, 0.0, 0.0, 0.0]), False)


def tilted_side(view: View, corners: Floats, size: tuple[int, int]) -> Side | None:
    """The edge of the board that is tilted towards the camera; None for less than TILT_DEG, or without a pose.

    corners: (n, 3) of the board, m.  The board's Z axis points away from the camera: with a share to the right, the right
    edge is the nearer one.
    """
    poses = plane_poses(nominal_lens(size), corners[view.ids], view.pixels)
    if not poses:
        return None
    rotation, shift, _ = poses[0]
    ahead = rotation @ corners[view.ids].mean(axis=0) + shift
    ahead /= np.linalg.norm(ahead)
    normal = rotation[:, 2]
    if np.degrees(np.arccos(np.clip(normal @ ahead, -1.0, 1.0))) < p.TILT_DEG:
        return None
    across, down = (normal - (normal @ ahead) * ahead)[:2]
    if abs(across) > abs(down):
        return "right" if across > 0 else "left"
    return "lower" if down > 0 else "upper"


def has_moved(before: View | None, view: View, width: int) -> bool:
    """Whether the board is elsewhere in the image than in an earlier view."""
    return before is None or moved_px(before, view) > p.MOVED_SHARE * width


@dataclass
class CameraProgress:
    """What one camera saw.  moments: different places of the board.  cells: (cells,), see `View.cells`.

    tilted: moments by the nearer edge.
    """

    name: str
    size: tuple[int, int]
    moments: int = 0
    cells: Bools = field(default_factory=lambda: np.zeros(CELLS[0] * CELLS[1], dtype=np.bool_))
    tilted: dict[Side, int] = field(default_factory=lambda: dict.fromkeys(SIDES, 0))
    last: View | None = None

    @property
    def coverage(self) -> float:
        """Share of the cells in which corners were seen."""
        return float(self.cells.mean())

    @property
    def sides(self) -> int:
        """Number of sides to which the board was tilted often enough."""
        return sum(count >= p.MIN_TILTED for count in self.tilted.values())

    @property
    def enough(self) -> bool:
        """Whether its lens can be determined."""
        return self.moments >= p.MIN_CAMERA_MOMENTS and self.coverage >= p.MIN_COVERAGE and self.sides >= p.MIN_SIDES

    def region(self) -> str:
        """The region of the image of which the least is covered."""
        grid = self.cells.reshape(CELLS[1], CELLS[0])
        return min(REGIONS, key=lambda one: float(grid[one[2], one[1]].mean()))[0]


@dataclass
class BoardGuide:
    """Progress of all cameras.  corners: (n, 3) of the board, m.  lens_known: the lenses are given and stay."""

    corners: Floats
    cameras: list[CameraProgress]
    lens_known: bool = False
    pairs: dict[tuple[int, int], int] = field(default_factory=dict)
    _last_pairs: dict[tuple[int, int], tuple[View, View]] = field(default_factory=dict)

    def add_cells(self, camera: int, view: View) -> None:
        """Add the corners of a view to the coverage."""
        self.cameras[camera].cells |= view.cells(self.cameras[camera].size)

    def add(self, views: Mapping[int, View]) -> None:
        """Add one moment: what cameras, by number, saw at the same time."""
        for number, view in views.items():
            self.add_cells(number, view)
            one = self.cameras[number]
            if has_moved(one.last, view, one.size[0]):
                one.moments, one.last = one.moments + 1, view
                if (side := tilted_side(view, self.corners, one.size)) is not None:
                    one.tilted[side] += 1
        for pair in combinations(sorted(views), 2):
            first, second = (views[number] for number in pair)
            before = self._last_pairs.get(pair)
            widths = [self.cameras[number].size[0] for number in pair]
            if before is None or has_moved(before[0], first, widths[0]) or has_moved(before[1], second, widths[1]):
                self.pairs[pair] = self.pairs.get(pair, 0) + 1
                self._last_pairs[pair] = first, second

    def groups(self) -> list[list[int]]:
        """Cameras that are connected by pairs with at least MIN_MOMENTS common moments, the largest group first."""
        group = list(range(len(self.cameras)))
        for (one, other), count in self.pairs.items():
            if count >= p.MIN_MOMENTS:
                group = [group[one] if number == group[other] else number for number in group]
        found = [[k for k, number in enumerate(group) if number == name] for name in dict.fromkeys(group)]
        return sorted(found, key=lambda members: -len(members))

    @property
    def missing(self) -> list[str]:
        """Names of the cameras that are not connected with the largest group of them."""
        return [self.cameras[k].name for group in self.groups()[1:] for k in group]

    @property
    def ready(self) -> bool:
        """Whether nothing more is asked for."""
        return not self.missing and all(self._has_enough(one) for one in self.cameras)

    def _has_enough(self, one: CameraProgress) -> bool:
        return one.enough or (self.lens_known and one.moments >= p.MIN_MOMENTS)

    def advice(self) -> tuple[str, str, str]:
        """What to show next, in one sentence; the camera that it is about, and the region of its image; "" for none."""
        unseen = [one for one in self.cameras if not one.moments]
        if len(unseen) == len(self.cameras):
            return "Hold the board before a camera, so that most of it is in the picture.", "", ""
        if unseen:
            return f"Show the board to {unseen[0].name}: it has not seen it yet.", unseen[0].name, ""
        groups = self.groups()
        if len(groups) > 1:
            pair = self._bridge(groups)
            first, second = (self.cameras[number].name for number in pair)
            have = self.pairs.get((min(pair), max(pair)), 0)
            sentence = f"Hold the board so that {first} and {second} both see it, and move it slowly"
            return f"{sentence}: {have} of {p.MIN_MOMENTS} places.", second, ""
        lacking = [one for one in self.cameras if not self._has_enough(one)]
        for one in sorted(lacking, key=lambda one: one.coverage):
            if one.coverage < p.MIN_COVERAGE:
                region = one.region()
                near = f"in the {region}" if region == "middle" else f"nearer to the {region}"
                return f"Show it {near} of {one.name}, and near the camera.", one.name, region
        for one in lacking:
            if one.sides < p.MIN_SIDES:
                side = min(SIDES, key=lambda name: one.tilted[name])
                return f"Tilt it more before {one.name}: turn its {side} edge towards the camera.", one.name, ""
        for one in lacking:
            return f"Show it longer to {one.name}, at other places: {one.moments} of {p.MIN_CAMERA_MOMENTS}.", one.name, ""
        return "Enough: lay the board on the floor and press Floor, then press Calibrate.", "", ""

    def _bridge(self, groups: Sequence[Sequence[int]]) -> tuple[int, int]:
        """A camera of the largest group and one outside, those that saw the board together most often."""
        ways = [(inside, outside) for inside in groups[0] for group in groups[1:] for outside in group]
        return max(ways, key=lambda way: self.pairs.get((min(way), max(way)), 0))
