"""Where hands and feet have just been: thin tubes behind them that grow thinner with time."""

import numpy as np

from common.body.anatomy import Floats
from services.animator.render.solids import LEFT, RIGHT, Surface, joined

AROUND = 6
THICK_M = 0.008  # radius at the newest end
APART_M = 0.01  # points nearer to each other are one


def trails(paths: dict[str, Floats]) -> Surface | None:
    """paths: by joint centre such as "LWrist", (n, 3) metres, oldest first, NaN where there is none; None for no trail."""
    surfaces = []
    for name, path in paths.items():
        points = _rounded(_thinned(path[np.isfinite(path).all(axis=1)]))
        if len(points) > 1:
            surfaces.append(_tube(points, LEFT if name.startswith("L") else RIGHT))
    return joined(surfaces) if surfaces else None


def _thinned(path: Floats) -> Floats:
    kept: list[Floats] = []
    for point in path[::-1]:  # the newest stays
        if not kept or float(np.linalg.norm(point - kept[-1])) >= APART_M:
            kept.append(point)
    return np.array(kept[::-1]).reshape(-1, 3)


def _rounded(path: Floats) -> Floats:
    """Corners cut twice at quarters of their sides (Chaikin), ends kept: nothing is smoothed away, only round."""
    for _ in range(2 if len(path) > 2 else 0):
        quarters = [0.75 * path[:-1] + 0.25 * path[1:], 0.25 * path[:-1] + 0.75 * path[1:]]
        path = np.concatenate([path[:1], np.stack(quarters, axis=1).reshape(-1, 3), path[-1:]])
    return path


def _tube(path: Floats, shade: int) -> Surface:
    """A tube along a path (n, 3), from nothing to its full width."""
    along = np.gradient(path, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    helper = np.where(np.abs(along[:, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    side = np.cross(along, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    normals = side[:, None] * np.cos(turn)[None, :, None] + other[:, None] * np.sin(turn)[None, :, None]
    radius = THICK_M * np.linspace(0.0, 1.0, len(path)) ** 0.7
    points = path[:, None] + radius[:, None, None] * normals
    here = np.arange((len(path) - 1) * AROUND).reshape(-1, AROUND)
    after = np.roll(here, -1, axis=1)
    quads = [np.stack([here, after, here + AROUND], axis=-1), np.stack([after, after + AROUND, here + AROUND], axis=-1)]
    triangles = np.concatenate([quad.reshape(-1, 3) for quad in quads]).astype(np.int32)
    shades = np.full(points.shape[0] * AROUND, shade, dtype=np.uint8)
    return Surface(points.reshape(-1, 3), normals.reshape(-1, 3), triangles, shades)
