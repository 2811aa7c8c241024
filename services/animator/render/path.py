"""The camera's path over a film: standing, going with the person, or going round."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from common.body.anatomy import Floats
from common.camera.pinhole import Camera
from services.animator.render.scene import Ground, sun_of
from services.animator.render.viewpoint import VIEWS, focused, looking, moved, orbited

AROUND_M = 0.16  # what a body has around its joint centres
SMOOTH_S = 0.5  # standard deviation by which a camera that goes along smooths the person's way
LIT = 1.6  # radius of the lit floor, in that of what happens on it, and at least
LEAST_LIT_M = 3.2


@dataclass(frozen=True)
class Shot:
    """view: one of VIEWS, or the id of a viewer.  follows: goes with the person.

    turning: radians per second round the scene, counter-clockwise as seen from above; 0 stands still.
    """

    view: str = "quarter"
    follows: bool = False
    turning: float = 0.0


@dataclass(frozen=True)
class Path:
    """first: the camera at row 0.  moves: (n, 3) metres from there by row.  turns: (n,) radians about `middle` (3,)."""

    first: Camera
    ground: Ground
    sun: Floats
    middle: Floats
    moves: Floats
    turns: Floats

    @property
    def moving(self) -> bool:
        """Whether rows have cameras of their own."""
        return bool(self.moves.any() or self.turns.any())

    def at(self, row: int) -> tuple[Camera, Ground, Floats]:
        """Camera, lit floor and direction to the sun of a row."""
        camera = moved(orbited(self.first, self.middle, float(self.turns[row])), self.moves[row])
        ground = Ground(self.ground.middle + self.moves[row][[0, 2]], self.ground.radius)
        return camera, ground, self.sun


def path_of(centres: Floats, times_s: Floats, shot: Shot, size: tuple[int, int], viewers: Mapping[str, Camera]) -> Path:
    """The path over n rows.  Raises ValueError for a view that there is not.

    centres: (n, markers, 3) metres, NaN while the person is lost, not everywhere.  times_s: (n,).  viewers: the cameras of
    the rig, by id.
    """
    way = _way(centres, times_s)
    moves = way - way[0] if shot.follows else np.zeros_like(way)
    turns = shot.turning * (times_s - times_s[0])
    there = (centres - moves[:, None]).reshape(-1, 3)
    there = there[np.isfinite(there).all(axis=1)]
    around = np.concatenate([there + AROUND_M * side for side in np.concatenate([np.eye(3), -np.eye(3)])])
    points = np.concatenate([around, there * [1.0, 0.0, 1.0]])
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    ground = Ground(middle[[0, 2]], max(LIT * float(np.hypot(*(high - low)[[0, 2]])), LEAST_LIT_M))
    if shot.view in VIEWS:
        azimuth, elevation = np.radians(VIEWS[shot.view])
        camera = looking(float(azimuth), float(elevation), points, size, turned=bool(shot.turning))
    elif shot.view in viewers:
        camera = focused(viewers[shot.view], size)
        away = camera.centre - middle
        azimuth = np.arctan2(away[0], away[2])
    else:
        others = f", or a viewer: {', '.join(sorted(viewers))}" if viewers else ""
        raise ValueError(f"view {shot.view!r}: allowed: {', '.join(VIEWS)}{others}")
    return Path(camera, ground, sun_of(float(azimuth)), middle, moves, turns)


def _way(centres: Floats, times_s: Floats) -> Floats:
    """(n, 3) the person's way over the ground, metres, smooth; held while the person is lost."""
    middle = np.mean(centres, axis=1)
    known = np.flatnonzero(np.isfinite(middle).all(axis=1))
    rows = np.arange(len(middle))
    way = np.stack([np.interp(rows, known, middle[known, axis]) for axis in range(3)], axis=1)
    way[:, 1] = 0.0
    step_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
    if step_s > 0:
        way = gaussian_filter1d(way, SMOOTH_S / step_s, axis=0, mode="nearest")
    return way
