"""Refinement of a pose: damped Gauss-Newton on the gaps between scene and body, from one wrench matrix a part."""

from typing import NamedTuple

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from services.tracker.closest import Numbers, Singles, meet, misfit, nearest_parts, weight_of
from services.tracker.linkage import ROOT, assemble, hold, move, screws_of
from services.tracker.model import Ints, Model, place
from services.tracker.room import ALONG, Room, outside, outside_at, place_on
from services.tracker.solving import solve

STILL = 0.01  # m and rad: a step so short is the last one
INSIDE = 1.0  # weight of a place of the body outside of a silhouette against that of a ray


class Weights(NamedTuple):
    """spread: of a good gap, metres; beyond it the pull stays the same.  limit: no pull beyond, metres.
    precision: (6 + d,) 1 / variance that holds the pose at its target: metres, then radians.  share: of one ray."""

    spread: float
    limit: float
    precision: Floats
    share: float


@njit(cache=True, error_model="numpy")
def gather(
    model: Model,
    frames: Floats,
    rays: Singles,
    room: Room,
    weights: Weights,
    matrices: Floats,
    pulls: Floats,
    distances: Singles,
    parts: Numbers,
) -> None:
    """Add up every part's wrench matrix (p, 6, 6), in its lower triangle, and pull (p, 6) about the root's origin.

    distances, parts: (n,) of the rays, overwritten.
    """
    count = frames.shape[0]
    matrices[:] = 0.0
    pulls[:] = 0.0
    nearest_parts(model, frames, rays, distances, parts)
    first, order = np.zeros(count + 1, dtype=np.int64), np.empty(rays.shape[1], dtype=np.int64)
    for i in range(rays.shape[1]):
        first[parts[i] + 1] += 1
    for part in range(count):
        first[part + 1] += first[part]
    filled = first[:count].copy()
    for i in range(rays.shape[1]):
        order[filled[parts[i]]] = i
        filled[parts[i]] += 1
    for part in range(count):
        _gather_part(model, frames, part, rays, order[first[part] : first[part + 1]], weights, matrices[part], pulls[part])
    found, wrench = np.empty(4), np.empty(6)
    for part in range(count):
        for n in range(len(ALONG)):
            x, y, z = place_on(model, frames[part], part, ALONG[n])
            for k in range(room.at.shape[0]):
                if outside_at(room, k, x, y, z, found) and found[0] < weights.limit:
                    weight = INSIDE * weights.share * min(1.0, weights.spread / found[0]) / weights.spread**2
                    x0, y0, z0 = x - frames[0, 0, 3], y - frames[0, 1, 3], z - frames[0, 2, 3]
                    _add(x0, y0, z0, found[1], found[2], found[3], found[0], weight, wrench, matrices[part], pulls[part])


@njit(cache=True, error_model="numpy", fastmath=True)
def _gather_part(
    model: Model, frames: Floats, part: int, rays: Singles, own: Ints, weights: Weights, matrix: Floats, pull: Floats
) -> None:
    """Add the rays of one part, (n,) indices `own`, to its wrench matrix (6, 6) and pull (6,): sums in registers."""
    f = frames[part]
    ox, oy, oz = frames[0, 0, 3], frames[0, 1, 3], frames[0, 2, 3]
    spread, limit, share = weights.spread, weights.limit, weights.share
    p0 = p1 = p2 = p3 = p4 = p5 = 0.0
    m00 = m10 = m11 = m20 = m21 = m22 = m30 = m31 = m32 = m33 = 0.0
    m40 = m41 = m42 = m43 = m44 = m50 = m51 = m52 = m53 = m54 = m55 = 0.0
    for k in range(own.shape[0]):
        distance, gap, x, y, z, _, a, b, c = meet(model, f, part, rays, own[k])
        weight = share * weight_of(distance, gap, spread, limit)
        x, y, z = x - ox, y - oy, z - oz
        d, e, g = y * c - z * b, z * a - x * c, x * b - y * a
        wa, wb, wc, wd, we, wg = weight * a, weight * b, weight * c, weight * d, weight * e, weight * g
        p0, p1, p2 = p0 + gap * wa, p1 + gap * wb, p2 + gap * wc
        p3, p4, p5 = p3 + gap * wd, p4 + gap * we, p5 + gap * wg
        m00, m10, m11 = m00 + wa * a, m10 + wb * a, m11 + wb * b
        m20, m21, m22 = m20 + wc * a, m21 + wc * b, m22 + wc * c
        m30, m31, m32, m33 = m30 + wd * a, m31 + wd * b, m32 + wd * c, m33 + wd * d
        m40, m41, m42, m43, m44 = m40 + we * a, m41 + we * b, m42 + we * c, m43 + we * d, m44 + we * e
        m50, m51, m52, m53 = m50 + wg * a, m51 + wg * b, m52 + wg * c, m53 + wg * d
        m54, m55 = m54 + wg * e, m55 + wg * g
    pull[0], pull[1], pull[2], pull[3], pull[4], pull[5] = p0, p1, p2, p3, p4, p5
    matrix[0, 0], matrix[1, 0], matrix[1, 1] = m00, m10, m11
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = m20, m21, m22
    matrix[3, 0], matrix[3, 1], matrix[3, 2], matrix[3, 3] = m30, m31, m32, m33
    matrix[4, 0], matrix[4, 1], matrix[4, 2], matrix[4, 3], matrix[4, 4] = m40, m41, m42, m43, m44
    matrix[5, 0], matrix[5, 1], matrix[5, 2], matrix[5, 3], matrix[5, 4], matrix[5, 5] = m50, m51, m52, m53, m54, m55


@njit(cache=True, error_model="numpy")
def _add(
    x: float,
    y: float,
    z: float,
    n0: float,
    n1: float,
    n2: float,
    gap: float,
    weight: float,
    wrench: Floats,
    matrix: Floats,
    pull: Floats,
) -> None:
    """One gap along a direction, at a place about the root's origin, to a part's wrench matrix and pull."""
    wrench[0], wrench[1], wrench[2] = n0, n1, n2
    wrench[3], wrench[4], wrench[5] = y * n2 - z * n1, z * n0 - x * n2, x * n1 - y * n0
    for row in range(6):
        pull[row] += weight * gap * wrench[row]
        for column in range(row + 1):
            matrix[row, column] += weight * wrench[row] * wrench[column]


@njit(cache=True, error_model="numpy")
def refine(
    model: Model,
    rays: Singles,
    room: Room,
    weights: Weights,
    iterations: int,
    position: Floats,
    rotation: Floats,
    values: Floats,
    target_position: Floats,
    target_rotation: Floats,
    target_values: Floats,
) -> None:
    """Move a pose in place: position (3,), rotation (3, 3) and values (d,), held near its target.

    At most `iterations` steps; it ends with the first short one.
    """
    count, dof = model.parent.shape[0], ROOT + values.shape[0]
    frames = np.empty((count, 3, 4))
    matrices, pulls = np.empty((count, 6, 6)), np.empty((count, 6))
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    a, b = np.empty((dof, dof)), np.empty(dof)
    distances, parts = np.empty(rays.shape[1], dtype=np.float32), np.empty(rays.shape[1], dtype=np.int32)
    for _ in range(iterations):
        place(model, position, rotation, values, frames)
        gather(model, frames, rays, room, weights, matrices, pulls, distances, parts)
        screws_of(model, frames, screws, owner)
        assemble(model, screws, owner, matrices, pulls, a, b)
        for k in range(dof):
            a[k, k] += weights.precision[k] + 1e-6
        hold(
            model, frames, position, rotation, values,
            target_position, target_rotation, target_values, weights.precision, b,
        )  # fmt: skip
        if not solve(a, b):
            return
        move(model, frames, b, position, rotation, values)
        if np.abs(b).max() < STILL:
            return


@njit(cache=True, error_model="numpy")
def distances_of(model: Model, rays: Singles, position: Floats, rotation: Floats, values: Floats) -> Singles:
    """(n,) how far every ray is from the body in a pose, metres."""
    frames = np.empty((model.parent.shape[0], 3, 4))
    distances, parts = np.empty(rays.shape[1], dtype=np.float32), np.empty(rays.shape[1], dtype=np.int32)
    place(model, position, rotation, values, frames)
    nearest_parts(model, frames, rays, distances, parts)
    return distances


@njit(cache=True, error_model="numpy")
def misfit_of(
    model: Model, rays: Singles, room: Room, limit: float, position: Floats, rotation: Floats, values: Floats
) -> float:
    """D of a pose in m^2 [Hybrid Eq. 30], and what of the body is outside of the silhouettes."""
    frames = np.empty((model.parent.shape[0], 3, 4))
    distances, parts = np.empty(rays.shape[1], dtype=np.float32), np.empty(rays.shape[1], dtype=np.int32)
    place(model, position, rotation, values, frames)
    nearest_parts(model, frames, rays, distances, parts)
    return float(misfit(distances, limit) + INSIDE * outside(model, frames, room, limit))
