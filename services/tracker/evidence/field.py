"""Silhouettes as evidence: distance from points of the body to them, and the direction towards them.

Contour rays pull the body's surface to the contours, but a limb outside a silhouette without a contour near it has no
residual; this term adds one.  It is not in the paper.
"""

from typing import NamedTuple

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints, Mask
from zenocap.common.jit import kernel, leaf_kernel
from zenocap.services.tracker.body.body_model import BodyModel
from zenocap.services.tracker.evidence.residuals import Weights, add_residual
from zenocap.services.tracker.hull.views import REACH, Silhouettes, distort
from zenocap.services.tracker.parameters import (
    AXIS_SAMPLES,
    DISTANCE_MAP_MARGIN_PX,
    DISTANCE_MAP_PX,
    MIN_DEPTH_M,
    OUTSIDE_WEIGHT,
)


# Paper (added): [Hybrid V-B] has no term for parts of the body outside of the silhouettes.
class DistanceField(NamedTuple):
    """Distance maps of v views.

    maps: all of them, row by row, px of the image.  at: (v,) start of each.  shape: (v, 2) rows, columns; 0 for an absent
    view.  corner: (v, 2) column and row of the image at the map's first pixel.  scale: (v,) image px per map px.
    lens, rotation, centre, size: as in `Silhouettes`.
    """

    maps: Floats32
    at: Ints
    shape: Ints
    corner: Floats
    scale: Floats
    lens: Floats
    rotation: Floats
    centre: Floats
    size: Ints


def distance_field(silhouettes: Silhouettes) -> DistanceField:
    """Distance field of silhouettes, dilated as they are there."""
    views = len(silhouettes.lens)
    maps: list[Floats32] = []
    at, shape = np.zeros(views, dtype=np.int64), np.zeros((views, 2), dtype=np.int64)
    corner, scale = np.zeros((views, 2)), np.ones(views)
    length = 0
    for k in range(views):
        left, top, across, down = (int(value) for value in silhouettes.box[k])
        at[k] = length
        if across == 0:
            continue
        crop = silhouettes.pixels[silhouettes.at[k] : silhouettes.at[k] + across * down].reshape(down, across)
        one = _distances(crop)
        scale[k] = max(1.0, max(across, down) / DISTANCE_MAP_PX)
        corner[k] = np.array([left, top]) - DISTANCE_MAP_MARGIN_PX * scale[k] + 0.5 * scale[k] - 0.5
        shape[k] = one.shape
        maps.append((one * scale[k]).reshape(-1))
        length += one.size
    joined = np.concatenate(maps).astype(np.float32) if maps else np.empty(0, np.float32)
    lens, rotation, centre, size = silhouettes.lens, silhouettes.rotation, silhouettes.centre, silhouettes.size
    return DistanceField(joined, at, shape, corner, scale, lens, rotation, centre, size)


def no_distance_field() -> DistanceField:
    """Distance field without views, in which no point is outside."""
    none, nowhere = np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64)
    lens, centre = np.zeros((0, REACH + 1)), np.zeros((0, 3))
    return DistanceField(
        np.zeros(0, np.float32), none, nowhere, np.zeros((0, 2)), np.zeros(0), lens, np.zeros((0, 3, 3)), centre, nowhere
    )


def _distances(crop: Mask) -> Floats32:
    """(rows, columns) px of the map to the nearest pixel of a crop, reduced in size, with a margin."""
    down, across = crop.shape
    factor = max(1.0, max(across, down) / DISTANCE_MAP_PX)
    if factor > 1.0:
        small = (max(1, round(across / factor)), max(1, round(down / factor)))
        crop = np.asarray(cv2.resize(crop, small, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    free = np.pad((crop == 0).astype(np.uint8), DISTANCE_MAP_MARGIN_PX, constant_values=1)
    return np.asarray(cv2.distanceTransform(free, cv2.DIST_L2, 5), dtype=np.float32)


@leaf_kernel
def outside_at(field: DistanceField, k: int, x: float, y: float, z: float, found: Floats) -> bool:
    """True when a world point is outside the silhouette of view k.

    Writes found (4,): distance in metres, and the unit direction towards the silhouette (3,) in the world.
    """
    if field.shape[k, 0] == 0:
        return False
    dx, dy, dz = x - field.centre[k, 0], y - field.centre[k, 1], z - field.centre[k, 2]
    r = field.rotation[k]
    cx = r[0, 0] * dx + r[0, 1] * dy + r[0, 2] * dz
    cy = r[1, 0] * dx + r[1, 1] * dy + r[1, 2] * dz
    cz = r[2, 0] * dx + r[2, 1] * dy + r[2, 2] * dz
    if cz < MIN_DEPTH_M:
        return False
    px, py = cx / cz, cy / cz
    bx, by = px, py
    if field.lens[k, REACH] > 0.0:
        bx, by = distort(field.lens, k, px, py)
    u = field.lens[k, 0] * bx + field.lens[k, 1] * by + field.lens[k, 2]
    v = field.lens[k, 3] * by + field.lens[k, 4]
    if u < 0.0 or v < 0.0 or u > field.size[k, 0] - 1 or v > field.size[k, 1] - 1:
        return False
    rows, columns = field.shape[k, 0], field.shape[k, 1]
    a, b = (u - field.corner[k, 0]) / field.scale[k], (v - field.corner[k, 1]) / field.scale[k]
    ca, cb = min(max(a, 0.0), columns - 1.001), min(max(b, 0.0), rows - 1.001)
    i, j = int(cb), int(ca)
    fb, fa = cb - i, ca - j
    base = field.at[k] + i * columns + j
    m00, m01 = field.maps[base], field.maps[base + 1]
    m10, m11 = field.maps[base + columns], field.maps[base + columns + 1]
    far = (1 - fb) * ((1 - fa) * m00 + fa * m01) + fb * ((1 - fa) * m10 + fa * m11)
    if far <= 0.0:
        return False
    gu = (1 - fb) * (m01 - m00) + fb * (m11 - m10)
    gv = (1 - fa) * (m10 - m00) + fa * (m11 - m01)
    norm = np.sqrt(gu * gu + gv * gv)
    if norm < 1e-9:
        return False
    # Off the map: vector to the map's edge plus the vector stored there.
    gu, gv = far * gu / norm + (a - ca) * field.scale[k], far * gv / norm + (b - cb) * field.scale[k]
    far = np.sqrt(gu * gu + gv * gv)
    gu, gv = gu / far, gv / far
    found[0] = far * cz / field.lens[k, 0]
    wz = -(gu * px + gv * py)  # the distance does not change along the ray
    length = np.sqrt(gu * gu + gv * gv + wz * wz)
    for row in range(3):
        found[1 + row] = -(r[0, row] * gu + r[1, row] * gv + r[2, row] * wz) / length
    return True


@kernel
def add_field(
    model: BodyModel, frames: Floats, field: DistanceField, weights: Weights, matrices: Floats, gradients: Floats
) -> None:
    """Add the samples of every part outside of the silhouettes to its wrench matrix (p, 6, 6) and gradient (p, 6)."""
    found, wrench = np.empty(4), np.empty(6)
    for part in range(frames.shape[0]):
        for n in range(len(AXIS_SAMPLES)):
            x, y, z = axis_point(model, frames[part], part, AXIS_SAMPLES[n])
            for k in range(field.at.shape[0]):
                if outside_at(field, k, x, y, z, found) and found[0] < weights.limit:
                    weight = OUTSIDE_WEIGHT * weights.ray_weight * min(1.0, weights.spread / found[0]) / weights.spread**2
                    x0, y0, z0 = x - frames[0, 0, 3], y - frames[0, 1, 3], z - frames[0, 2, 3]
                    add_residual(x0, y0, z0, found, weight, wrench, matrices[part], gradients[part])


@kernel
def square_outside(model: BodyModel, frames: Floats, field: DistanceField, limit: float) -> float:
    """Sum over samples of the parts and views of the squared distance outside, truncated at `limit` metres; m^2."""
    found, total = np.empty(4), 0.0
    for part in range(frames.shape[0]):
        for n in range(len(AXIS_SAMPLES)):
            x, y, z = axis_point(model, frames[part], part, AXIS_SAMPLES[n])
            for k in range(field.at.shape[0]):
                if outside_at(field, k, x, y, z, found):
                    total += min(found[0], limit) ** 2
    return total


@kernel
def mean_square_outside(model: BodyModel, frames: Floats, field: DistanceField, limit: float) -> float:
    """Mean of the terms of `square_outside`; m^2."""
    count = frames.shape[0] * len(AXIS_SAMPLES) * field.at.shape[0]
    return float(square_outside(model, frames, field, limit) / max(count, 1))


@leaf_kernel
def axis_point(model: BodyModel, f: Floats, part: int, share: float) -> tuple[float, float, float]:
    """Point of the world at a fraction of a part's axis."""
    b0, b1, b2 = model.bases[part, 0], model.bases[part, 1] + share * model.lengths[part], model.bases[part, 2]
    return (
        f[0, 3] + f[0, 0] * b0 + f[0, 1] * b1 + f[0, 2] * b2,
        f[1, 3] + f[1, 0] * b0 + f[1, 1] * b1 + f[1, 2] * b2,
        f[2, 3] + f[2, 0] * b0 + f[2, 1] * b1 + f[2, 2] * b2,
    )
