"""Where somebody is in a scene, however cluttered: the upright column in which most heights are seen."""

from dataclasses import dataclass

import numpy as np

from common.body.anatomy import Floats
from services.tracker.closest import DIRECTION, FAR, NEAR, ORIGIN, Singles, points_of

RADIUS_M = 0.3  # of the column
LAYER_M = 0.1
ENOUGH = 2.0  # of a layer: more of it does not make the column a person
VAGUE_M = 0.1  # the length of an interval at which its middle is half as reliable as that of a short one
PLACES = 200  # that are compared
LEAST_RAYS = 40
BELOW_M = 0.05  # the ground: what is seen lower may be clutter
MARGIN_M = 0.15  # above and below the column


@dataclass(frozen=True)
class Column:
    """centre: (2,) x, z.  low, top: metres."""

    centre: Floats
    low: float
    top: float


def reliability(rays: Singles) -> Floats:
    """(n,) 1 for a short surviving interval, less for a long one, whose middle may be far from the surface."""
    weights: Floats = VAGUE_M / (VAGUE_M + (rays[FAR] - rays[NEAR]).astype(np.float64))
    return weights


def column_in(rays: Singles) -> Column | None:
    """The column of a scene of rays (11, n); None when there are too few."""
    if rays.shape[1] < LEAST_RAYS:
        return None
    points, weights = points_of(rays), reliability(rays)
    plan, layers = points[:, [0, 2]], np.floor(points[:, 1] / LAYER_M).astype(np.int64)
    layers -= layers.min()
    chosen = plan[:: max(1, len(plan) // PLACES)]
    near = ((chosen[:, None] - plan[None]) ** 2).sum(axis=2) < RADIUS_M**2
    filled = np.zeros((len(chosen), int(layers.max()) + 1))
    for layer in range(filled.shape[1]):
        filled[:, layer] = near[:, layers == layer] @ weights[layers == layer]
    centre: Floats = chosen[int(np.argmax(np.minimum(filled, ENOUGH * VAGUE_M / RADIUS_M).sum(axis=1)))]
    for _ in range(5):
        inside = ((plan - centre) ** 2).sum(axis=1) < RADIUS_M**2
        centre = weights[inside] @ plan[inside] / weights[inside].sum()
    inside = ((plan - centre) ** 2).sum(axis=1) < RADIUS_M**2
    low, top = np.percentile(points[inside, 1], [0.3, 99.7])
    return Column(centre, float(low), float(top))


def within(rays: Singles, column: Column, radius: float) -> Singles:
    """(11, m) the rays that pass the column widened to `radius` metres, their intervals cut down to what lies in it."""
    o, d = rays[ORIGIN : ORIGIN + 3].astype(np.float64), rays[DIRECTION : DIRECTION + 3].astype(np.float64)
    x, z = o[0] - column.centre[0], o[2] - column.centre[1]
    a = np.maximum(d[0] ** 2 + d[2] ** 2, 1e-12)
    b, c = x * d[0] + z * d[2], x**2 + z**2 - radius**2
    root = b**2 - a * c
    half = np.sqrt(np.maximum(root, 0.0))
    near, far = (-b - half) / a, (-b + half) / a
    rise = np.where(np.abs(d[1]) < 1e-9, 1e-9, d[1])
    ends = np.stack([(column.low - MARGIN_M - o[1]) / rise, (column.top + MARGIN_M - o[1]) / rise])
    near = np.maximum.reduce([near, ends.min(axis=0), rays[NEAR]])
    far = np.minimum.reduce([far, ends.max(axis=0), rays[FAR]])
    kept = (root > 0.0) & (near < far)
    cut = rays[:, kept].copy()
    cut[NEAR], cut[FAR] = near[kept], far[kept]
    return cut
