"""Adjustment of all cameras: silhouettes agree, the head keeps its height, feet are on the floor.

Residuals, in standard deviations:

    angles of the tangent planes of each pair of cameras (`zenocap.tools.setup.calibration.silhouettes`),
    height of the head, triangulated from all views of an instant, less that of the head in a walk,
    distance of the views' tops of the head from it, px,
    height over the floor of the lowest point of each view, below the head and nearer to the camera by what a foot is.

The gauge is that of the world Y up with its floor at 0; its place and direction on the floor are those of the start.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares

from zenocap.common.arrays import Bools, Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.setup.calibration.drift import moved_camera
from zenocap.tools.setup.calibration.silhouettes import Hulls, losses, pair_residuals
from zenocap.tools.setup.calibration.walk import parameters as p
from zenocap.tools.setup.calibration.walk.single_view import elevations

GAUGE_M, GAUGE_RAD = 1e-3, 1e-3  # tolerance of the first camera's place and direction on the floor
UNIT = np.array([0.02] * 3 + [0.05] * 3)  # rad and m: change of a pose of about equal effect
DELAY_UNIT_S = 0.03  # change of a delay of about the same effect: a walk of 1 m/s


@dataclass(frozen=True)
class Walk:
    """hulls: by camera, at the same instants.  stature_m: of the person."""

    hulls: Mapping[str, Hulls]
    stature_m: float

    def part(self, kept: Sequence[int] | np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> "Walk":
        """The walk at some of the instants."""
        return Walk({name: Hulls(one.local[kept], one.cut[kept]) for name, one in self.hulls.items()}, self.stature_m)


@dataclass(frozen=True)
class Heads:
    """places: (n, 3) of the triangulated head, m, NaN where fewer than two cameras see it.

    off_px: by camera (n,), reprojection error.  floor_m: by camera (n,), height of the lowest point.
    """

    places: Floats
    off_px: Mapping[str, Floats]
    floor_m: Mapping[str, Floats]


def heads_of(cameras: Mapping[str, Camera], walk: Walk) -> Heads:
    """Heads and feet of the walk, as these cameras see them."""
    count = len(next(iter(walk.hulls.values())).local)
    normal, target, views = np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros(count)
    rays, bottoms = {}, {}
    for name, camera in cameras.items():
        seen = elevations(walk.hulls[name], camera.rotation[:, 1])
        ray = seen.head @ camera.rotation
        known = np.isfinite(ray[:, 0])
        across = np.where(known[:, None, None], np.eye(3) - ray[:, :, None] * ray[:, None, :], 0.0)
        normal += across
        target += across @ camera.centre
        views += known
        rays[name], bottoms[name] = ray, seen.bottom
    places = np.full((count, 3), np.nan)
    enough = views >= 2
    if enough.any():
        places[enough] = np.linalg.solve(normal[enough] + 1e-9 * np.eye(3), target[enough][..., None])[..., 0]
    off_px, floor_m = {}, {}
    for name, camera in cameras.items():
        to_head = places - camera.centre
        away = np.linalg.norm(to_head, axis=1)
        cosine = (rays[name] * to_head).sum(axis=1) / away
        focal = 0.5 * float(camera.matrix[0, 0] + camera.matrix[1, 1])
        off_px[name] = focal * np.arccos(np.clip(cosine, -1.0, 1.0))
        level = np.hypot(to_head[:, 0], to_head[:, 2]) - p.FOOT_NEARER * walk.stature_m
        floor_m[name] = camera.centre[1] + level * bottoms[name]
    return Heads(places, off_px, floor_m)


def adjusted(
    cameras: Mapping[str, Camera],
    walk_at: Callable[[Mapping[str, float]], Walk],
    delays: Mapping[str, float] | None = None,
    rounds: int = p.ROUNDS,
) -> tuple[dict[str, Camera], dict[str, float]]:
    """Cameras that fit the walk best, from ones near to them, and delays, s, where these are free.

    walk_at: the walk at delays of the cameras.  delays: start; the first camera's stays.  Without any they are 0 and stay.
    """
    names = list(cameras)
    late = names[1:] if delays is not None else []
    first = cameras[names[0]]
    present, times = dict(cameras), {name: 0.0 for name in names} | dict(delays or {})
    scene = middle_of(cameras, walk_at(times))

    def moved(values: Floats) -> tuple[dict[str, Camera], dict[str, float]]:
        parts = values[: 6 * len(names)].reshape(len(names), 6) * UNIT
        state = {name: moved_camera(start[name], part) for name, part in zip(names, parts, strict=True)}
        changes = dict(zip(late, values[6 * len(names) :] * DELAY_UNIT_S, strict=True))
        return state, {name: begun[name] + changes.get(name, 0.0) for name in names}

    for _ in range(rounds):
        start, begun = present, times
        known = [np.isfinite(one) for one in _residuals(start, walk_at(begun), scene)]

        def off(values: Floats, known: list[Bools] = known, scene: Floats = scene) -> Floats:
            state, delays = moved(values)
            found = [
                np.where(mask, np.nan_to_num(one, nan=10.0), 0.0)
                for one, mask in zip(_residuals(state, walk_at(delays), scene), known, strict=True)
            ]
            robust = np.sqrt(losses(np.concatenate(found)))
            gauge = _gauge(state[names[0]], first)
            return np.concatenate([robust, gauge])

        result = least_squares(off, np.zeros(6 * len(names) + len(late)), max_nfev=15, x_scale=1.0, diff_step=1e-3)
        present, times = moved(result.x)
        scene = middle_of(present, walk_at(times))
    return present, times


def _gauge(camera: Camera, first: Camera) -> Floats:
    """Residuals of the first camera's place and direction on the floor."""
    shift = (camera.centre - first.centre)[[0, 2]] / GAUGE_M
    ahead, before = camera.rotation[2], first.rotation[2]
    turned = np.arctan2(ahead[0], ahead[2]) - np.arctan2(before[0], before[2])
    return np.append(shift, (np.mod(turned + np.pi, 2 * np.pi) - np.pi) / GAUGE_RAD)


def middle_of(cameras: Mapping[str, Camera], walk: Walk) -> Floats:
    """Middle of the walk at half the person's height."""
    places = heads_of(cameras, walk).places
    middle: Floats = np.nanmedian(places, axis=0)
    middle[1] = 0.5 * walk.stature_m
    return middle


def _residuals(cameras: Mapping[str, Camera], walk: Walk, scene: Floats) -> list[Floats]:
    heads = heads_of(cameras, walk)
    found = [pair_residuals(cameras, walk.hulls, pair, scene) for pair in combinations(cameras, 2)]
    found.append((heads.places[:, 1] - p.HEAD_IN_WALK * walk.stature_m) / p.HEAD_NOISE_M)
    found += [one / p.HEAD_PX for one in heads.off_px.values()]
    found += [one / p.FLOOR_NOISE_M for one in heads.floor_m.values()]
    return found
