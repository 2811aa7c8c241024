"""Localization of a person in a cluttered scene: upright column, and T-pose within it."""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.hull.contour_rays import DIRECTION, FAR, NEAR, ORIGIN, midpoints


@dataclass(frozen=True)
class Column:
    """Upright column that may be a person.  centre: (2,) x, z.  low, top: heights.  Metres."""

    centre: Floats
    low: float
    top: float


def reliability(rays: Floats32) -> Floats:
    """(n,) weight of each ray's midpoint: 1 for a short surviving interval, less for a long one."""
    weights: Floats = p.INTERVAL_SCALE_M / (p.INTERVAL_SCALE_M + (rays[FAR] - rays[NEAR]).astype(np.float64))
    return weights


def find_column(rays: Floats32) -> Column | None:
    """Upright column of COLUMN_RADIUS_M with most layers occupied, in rays (11, n); None with too few rays."""
    if rays.shape[1] < p.MIN_COLUMN_RAYS:
        return None
    points, weights = midpoints(rays), reliability(rays)
    plan, layers = points[:, [0, 2]], np.floor(points[:, 1] / p.COLUMN_LAYER_M).astype(np.int64)
    layers -= layers.min()
    chosen = plan[:: max(1, len(plan) // p.COLUMN_CANDIDATES)]
    near = ((chosen[:, None] - plan[None]) ** 2).sum(axis=2) < p.COLUMN_RADIUS_M**2
    filled = np.zeros((len(chosen), int(layers.max()) + 1))
    for layer in range(filled.shape[1]):
        filled[:, layer] = near[:, layers == layer] @ weights[layers == layer]
    occupied = np.minimum(filled, p.COLUMN_LAYER_SATURATION * p.INTERVAL_SCALE_M / p.COLUMN_RADIUS_M).sum(axis=1)
    centre = _middle(plan, weights, chosen[int(np.argmax(occupied))], p.COLUMN_RADIUS_M)
    inside = ((plan - centre) ** 2).sum(axis=1) < p.COLUMN_RADIUS_M**2
    low, top = np.percentile(points[inside, 1], [0.3, 99.7])
    return Column(centre, float(low), float(top))


def middle_and_span(rays: Floats32, column: Column) -> tuple[Floats, float]:
    """(2,) x and z of the middle of what is within FLOOR_RADIUS_M of a column, and its greatest extent, metres."""
    points = midpoints(rays)
    plan = points[:, [0, 2]]
    middle = _middle(plan, reliability(rays), column.centre, p.FLOOR_RADIUS_M)
    inside = ((plan - middle) ** 2).sum(axis=1) < p.FLOOR_RADIUS_M**2
    return middle, float(np.ptp(np.percentile(points[inside], [1, 99], axis=0), axis=0).max())


def _middle(plan: Floats, weights: Floats, centre: Floats, radius: float) -> Floats:
    """(2,) mean of the points (n, 2) within a radius of it, from a centre (2,) on."""
    for _ in range(5):
        inside = ((plan - centre) ** 2).sum(axis=1) < radius**2
        centre = weights[inside] @ plan[inside] / weights[inside].sum()
    return centre


def rays_in_column(rays: Floats32, column: Column, radius: float) -> Floats32:
    """(11, m) rays that pass the column widened to `radius` metres, intervals cut to it."""
    o, d = rays[ORIGIN : ORIGIN + 3].astype(np.float64), rays[DIRECTION : DIRECTION + 3].astype(np.float64)
    x, z = o[0] - column.centre[0], o[2] - column.centre[1]
    a = np.maximum(d[0] ** 2 + d[2] ** 2, 1e-12)
    b, c = x * d[0] + z * d[2], x**2 + z**2 - radius**2
    root = b**2 - a * c
    half = np.sqrt(np.maximum(root, 0.0))
    near, far = (-b - half) / a, (-b + half) / a
    rise = np.where(np.abs(d[1]) < 1e-9, 1e-9, d[1])
    ends = np.stack([(column.low - p.COLUMN_MARGIN_M - o[1]) / rise, (column.top + p.COLUMN_MARGIN_M - o[1]) / rise])
    near = np.maximum.reduce([near, ends.min(axis=0), rays[NEAR]])
    far = np.minimum.reduce([far, ends.max(axis=0), rays[FAR]])
    kept = (root > 0.0) & (near < far)
    cut = rays[:, kept].copy()
    cut[NEAR], cut[FAR] = near[kept], far[kept]
    return cut


@dataclass(frozen=True)
class TPose:
    """T-pose in a scene.

    centre: (2,) x, z.  across: (2,) unit, along the arms.  low, stature: metres.
    """

    centre: Floats
    across: Floats
    low: float
    stature: float


def detect_t_pose(rays: Floats32) -> TPose | str:
    """T-pose in a scene of rays (11, n), or a text with the reason why there is none."""
    column = find_column(rays)
    if column is None:
        return "waiting for a person"
    stature = column.top - max(column.low, -p.GROUND_TOLERANCE_M)
    if not p.MIN_STATURE_M <= stature <= p.MAX_STATURE_M:
        allowed = f"{p.MIN_STATURE_M:g} to {p.MAX_STATURE_M:g} m"
        return f"an object {stature:.2f} m tall in view; waiting for a person of {allowed}"
    return _arms(rays, column, stature)


def _arms(rays: Floats32, column: Column, stature: float) -> TPose | str:
    """T-pose in the direction in which arms reach out to both sides at the height of the shoulders."""
    points, weights, low = midpoints(rays), reliability(rays), column.top - stature
    height = (points[:, 1] - low) / stature
    around = (points[:, [0, 2]] - column.centre) / stature
    high = (height > p.ARM_HEIGHT[0]) & (height < p.ARM_HEIGHT[1]) & (np.linalg.norm(around, axis=1) < p.PERSON_RADIUS)
    if np.count_nonzero(high & (np.linalg.norm(around, axis=1) > p.ARM_START)) < 10:
        return "no T-pose: hold both arms out sideways"
    around, weights = around[high], weights[high]
    best: tuple[float, Floats, float, float] | None = None
    for turn in np.pi * np.arange(p.ARM_DIRECTIONS) / p.ARM_DIRECTIONS:
        across = np.array([np.cos(turn), np.sin(turn)])
        beside = np.abs(around @ np.array([-across[1], across[0]])) < p.ARM_HALF_WIDTH
        along = around[beside] @ across
        reaches = _arm_reach(along), _arm_reach(-along)
        reach = min(reaches)
        score = min(reach, 0.5) * float(weights[beside][np.abs(along) > p.ARM_START].sum())
        if best is None or score > best[0]:
            best = score, across, reach, _extent(along, reaches[0]) + _extent(-along, reaches[1])
    assert best is not None
    _, across, reach, span = best
    if reach < 0.5 * p.MIN_ARM_SPAN:
        return "no T-pose: hold both arms out sideways, at the height of the shoulders"
    if span > p.MAX_ARM_SPAN:
        return "no T-pose: stand upright with both arms out sideways"
    return TPose(column.centre, _arm_direction(around, weights, across), low, stature)


def _arm_reach(along: Floats) -> float:
    """Distance, in statures, to which points along a line continue from the trunk without a gap."""
    slots = np.bincount(np.floor(along[(along > 0) & (along < p.PERSON_RADIUS)] / p.ARM_SLOT).astype(np.int64), minlength=1)
    end = int(p.ARM_START / p.ARM_SLOT)
    for slot in range(end, len(slots)):
        if slots[slot]:
            if slot - end > p.ARM_MAX_GAPS:
                break
            end = slot
    return (end + 1) * p.ARM_SLOT


def _extent(along: Floats, reach: float) -> float:
    """Farthest point along a line within the reach of an arm; -inf without one."""
    return float(along[along <= reach].max(initial=-np.inf))


def _arm_direction(around: Floats, weights: Floats, across: Floats) -> Floats:
    """(2,) principal axis of the arms around the line `across`."""
    aside = around @ np.array([-across[1], across[0]])
    arms = (np.abs(aside) < p.ARM_HALF_WIDTH) & (np.abs(around @ across) > p.ARM_START)
    _, axes = np.linalg.eigh((around[arms] * weights[arms, None]).T @ around[arms])
    line: Floats = axes[:, 1]
    return line
