"""From viewing lines to the nearest surface of the body: the correspondences of [Hybrid V-B]."""

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from services.tracker.model import Model
from services.tracker.scene import Scene

REACH = 0.15  # m: how far the contact moves along an axis that points along the normal
ORIGIN, DIRECTION, NORMAL, NEAR, FAR = 0, 3, 6, 9, 10  # columns of a ray
RAY = 11
FOUND = 9
ASIDE = 0.03  # m: a line that passes so far beside its contact counts half


def rays_of(scene: Scene) -> Floats:
    """(n, 11) a scene as compiled code has it: origin, direction, normal, near, far."""
    rays: Floats = np.column_stack([scene.origin, scene.direction, scene.normal, scene.near, scene.far])
    return np.ascontiguousarray(rays)


@njit(cache=True, error_model="numpy")
def nearest(model: Model, frames: Floats, ray: Floats, found: Floats) -> int:
    """The part whose surface is nearest to a viewing line (11,), which may slide along its surviving interval.

    The contact on a part is where its tangent plane is parallel to the line's, near where line and axis meet.
    Writes found (9,): distance |p p'| in metres, signed gap along the normal from the surface to the line, contact point
    on the surface (3,), its place along the part's axis in [0, 1], and how the gap shrinks when the part moves (3,): the
    normal, less what is along the axis, for a contact between the ends stays beside the line while its part slides.
    """
    best, best_part = np.inf, -1
    ox, oy, oz, dx, dy, dz = ray[0], ray[1], ray[2], ray[3], ray[4], ray[5]
    nx, ny, nz, near, far = ray[6], ray[7], ray[8], ray[9], ray[10]
    for part in range(frames.shape[0]):
        f = frames[part]
        bx, by, bz = model.bases[part, 0], model.bases[part, 1], model.bases[part, 2]
        ax = f[0, 3] + f[0, 0] * bx + f[0, 1] * by + f[0, 2] * bz - ox
        ay = f[1, 3] + f[1, 0] * bx + f[1, 1] * by + f[1, 2] * bz - oy
        az = f[2, 3] + f[2, 0] * bx + f[2, 1] * by + f[2, 2] * bz - oz
        yx, yy, yz = f[0, 1], f[1, 1], f[2, 1]
        length = model.lengths[part]
        slope = dx * yx + dy * yy + dz * yz
        along = dx * ax + dy * ay + dz * az
        back = yx * ax + yy * ay + yz * az
        s = (slope * along - back) / max(1.0 - slope * slope, 1e-9)
        s = min(max(s, 0.0), length)
        t = min(max(along + s * slope, near), far)
        n1 = nx * yx + ny * yy + nz * yz
        s = min(max(slope * t - back + REACH * n1, 0.0), length)
        share = s / length
        rx = model.radii[part, 0] + share * (model.radii[part, 2] - model.radii[part, 0])
        rz = model.radii[part, 1] + share * (model.radii[part, 3] - model.radii[part, 1])
        rm = 0.5 * (rx + rz)
        n0 = nx * f[0, 0] + ny * f[1, 0] + nz * f[2, 0]
        n2 = nx * f[0, 2] + ny * f[1, 2] + nz * f[2, 2]
        support = np.sqrt(rx * rx * n0 * n0 + rm * rm * n1 * n1 + rz * rz * n2 * n2) + 1e-12
        c0, c1, c2 = rx * rx * n0 / support, s + rm * rm * n1 / support, rz * rz * n2 / support
        px = ax + f[0, 0] * c0 + yx * c1 + f[0, 2] * c2
        py = ay + f[1, 0] * c0 + yy * c1 + f[1, 2] * c2
        pz = az + f[2, 0] * c0 + yz * c1 + f[2, 2] * c2
        t = min(max(px * dx + py * dy + pz * dz, near), far)
        vx, vy, vz = t * dx - px, t * dy - py, t * dz - pz
        distance = np.sqrt(vx * vx + vy * vy + vz * vz)
        if distance < best:
            best, best_part = distance, part
            found[0], found[1] = distance, nx * vx + ny * vy + nz * vz
            found[2], found[3], found[4], found[5] = px + ox, py + oy, pz + oz, share
            slip = 0.0
            if 0.0 < s < length:
                wider = (
                    rx * n0 * n0 * (model.radii[part, 2] - model.radii[part, 0])
                    + rz * n2 * n2 * (model.radii[part, 3] - model.radii[part, 1])
                ) / (support * length)
                slip = n1 + wider
            found[6], found[7], found[8] = nx - slip * yx, ny - slip * yy, nz - slip * yz
    return best_part


@njit(cache=True, error_model="numpy")
def influence(found: Floats, spread: float, limit: float) -> float:
    """Weight of a ray in 1 / m^2: the pull grows up to `spread` metres and then stays; none beyond `limit`.

    A line that passes beside its contact, rather than before or behind it, counts less.
    """
    if not found[0] < limit:
        return 0.0
    aside = (found[0] * found[0] - found[1] * found[1]) / (ASIDE * ASIDE)
    return float(min(1.0, spread / max(np.abs(found[1]), 1e-9)) / (spread * spread * (1.0 + aside)))


@njit(cache=True, error_model="numpy")
def misfit(model: Model, frames: Floats, rays: Floats, limit: float) -> float:
    """D, the mean of rho(d)^2 over the scene in m^2, rho a distance truncated at `limit` metres.  [Hybrid Eq. 30, 31]"""
    found = np.empty(FOUND)
    total = 0.0
    for i in range(rays.shape[0]):
        nearest(model, frames, rays[i], found)
        total += min(found[0], limit) ** 2
    return float(total / max(rays.shape[0], 1))
