"""From viewing lines to the nearest surface of the body: the correspondences of [Hybrid V-B].

A viewing line may slide along its surviving interval.  Where it meets a part is where the part's tangent plane is
parallel to its own (viewing line and contour tangent), near the place at which line and axis come closest.  How far the
contact moved along the axis for that is no distance.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.tracker.model import Model
from services.tracker.scene import Scene

Singles = NDArray[np.float32]
Numbers = NDArray[np.int32]
Meeting = tuple[float, float, float, float, float, float, float, float, float]

REACH = 0.15  # m: how far the contact moves along an axis that points along the normal
ASIDE = 0.03  # m: a line that passes so far beside its contact counts half
ORIGIN, DIRECTION, NORMAL, NEAR, FAR = 0, 3, 6, 9, 10  # rows of rays
FOUND = 9


def rays_of(scene: Scene) -> Singles:
    """(11, n) a scene as compiled code has it, row by row: origin, direction, normal, near, far."""
    rows = np.concatenate([scene.origin.T, scene.direction.T, scene.normal.T, scene.near[None], scene.far[None]])
    return np.ascontiguousarray(rows, dtype=np.float32)


def points_of(rays: Singles) -> Floats:
    """(n, 3) the middle of every surviving interval, metres."""
    middle = 0.5 * (rays[NEAR].astype(np.float64) + rays[FAR])
    points: Floats = rays[:3].T.astype(np.float64) + middle[:, None] * rays[3:6].T
    return points


@njit(cache=True, error_model="numpy", fastmath=True)
def nearest_parts(model: Model, frames: Floats, rays: Singles, distances: Singles, parts: Numbers) -> None:
    """The part nearest to every ray, and its distance |p p'| in metres: (n,) each, overwritten.

    Without a branch and in single precision, so that eight rays are done at once; round parts need no root.
    """
    n = rays.shape[1]
    for i in range(n):
        distances[i] = np.float32(1e18)
        parts[i] = 0
    zero, half, tiny = np.float32(0.0), np.float32(0.5), np.float32(1e-9)
    one, reach = np.float32(1.0), np.float32(REACH)
    for part in range(frames.shape[0]):
        f = frames[part]
        b0, b1, b2 = model.bases[part, 0], model.bases[part, 1], model.bases[part, 2]
        cx = np.float32(f[0, 3] + f[0, 0] * b0 + f[0, 1] * b1 + f[0, 2] * b2)
        cy = np.float32(f[1, 3] + f[1, 0] * b0 + f[1, 1] * b1 + f[1, 2] * b2)
        cz = np.float32(f[2, 3] + f[2, 0] * b0 + f[2, 1] * b1 + f[2, 2] * b2)
        xx, xy, xz = np.float32(f[0, 0]), np.float32(f[1, 0]), np.float32(f[2, 0])
        yx, yy, yz = np.float32(f[0, 1]), np.float32(f[1, 1]), np.float32(f[2, 1])
        zx, zy, zz = np.float32(f[0, 2]), np.float32(f[1, 2]), np.float32(f[2, 2])
        length = np.float32(model.lengths[part])
        r0, r1 = np.float32(model.radii[part, 0]), np.float32(model.radii[part, 1])
        g0 = np.float32((model.radii[part, 2] - model.radii[part, 0]) / model.lengths[part])
        g1 = np.float32((model.radii[part, 3] - model.radii[part, 1]) / model.lengths[part])
        if r0 == r1 and g0 == g1:
            for i in range(n):
                dx, dy, dz = rays[3, i], rays[4, i], rays[5, i]
                nx, ny, nz = rays[6, i], rays[7, i], rays[8, i]
                near, far = rays[9, i], rays[10, i]
                ax, ay, az = cx - rays[0, i], cy - rays[1, i], cz - rays[2, i]
                slope = dx * yx + dy * yy + dz * yz
                along = dx * ax + dy * ay + dz * az
                back = yx * ax + yy * ay + yz * az
                s = (slope * along - back) / (one - slope * slope + tiny)
                s = min(max(s, zero), length)
                t = min(max(along + s * slope, near), far)
                n1 = nx * yx + ny * yy + nz * yz
                met = min(max(slope * t - back, zero), length)
                s = min(max(met + reach * n1, zero), length)
                moved = s - met
                rx = r0 + s * g0
                px = ax + yx * s + rx * nx
                py = ay + yy * s + rx * ny
                pz = az + yz * s + rx * nz
                t = min(max(px * dx + py * dy + pz * dz, near), far)
                vx, vy, vz = t * dx - px, t * dy - py, t * dz - pz
                gap = nx * vx + ny * vy + nz * vz
                whole = vx * vx + vy * vy + vz * vz
                distance = whole - min(whole - gap * gap, moved * moved * (one - n1 * n1))
                closer = distance < distances[i]
                distances[i] = distance if closer else distances[i]
                parts[i] = np.int32(part) if closer else parts[i]
        else:
            for i in range(n):
                dx, dy, dz = rays[3, i], rays[4, i], rays[5, i]
                nx, ny, nz = rays[6, i], rays[7, i], rays[8, i]
                near, far = rays[9, i], rays[10, i]
                ax, ay, az = cx - rays[0, i], cy - rays[1, i], cz - rays[2, i]
                slope = dx * yx + dy * yy + dz * yz
                along = dx * ax + dy * ay + dz * az
                back = yx * ax + yy * ay + yz * az
                s = (slope * along - back) / (one - slope * slope + tiny)
                s = min(max(s, zero), length)
                t = min(max(along + s * slope, near), far)
                n1 = nx * yx + ny * yy + nz * yz
                met = min(max(slope * t - back, zero), length)
                s = min(max(met + reach * n1, zero), length)
                moved = s - met
                rx, rz = r0 + s * g0, r1 + s * g1
                rm = half * (rx + rz)
                n0 = nx * xx + ny * xy + nz * xz
                n2 = nx * zx + ny * zy + nz * zz
                a0, a1, a2 = rx * n0, rm * n1, rz * n2
                scale = one / (np.sqrt(a0 * a0 + a1 * a1 + a2 * a2) + tiny)
                c0, c1, c2 = rx * a0 * scale, s + rm * a1 * scale, rz * a2 * scale
                px = ax + xx * c0 + yx * c1 + zx * c2
                py = ay + xy * c0 + yy * c1 + zy * c2
                pz = az + xz * c0 + yz * c1 + zz * c2
                t = min(max(px * dx + py * dy + pz * dz, near), far)
                vx, vy, vz = t * dx - px, t * dy - py, t * dz - pz
                gap = nx * vx + ny * vy + nz * vz
                whole = vx * vx + vy * vy + vz * vz
                distance = whole - min(whole - gap * gap, moved * moved * (one - n1 * n1))
                closer = distance < distances[i]
                distances[i] = distance if closer else distances[i]
                parts[i] = np.int32(part) if closer else parts[i]
    for i in range(n):
        distances[i] = np.sqrt(distances[i])


@njit(cache=True, error_model="numpy")
def contact(model: Model, f: Floats, part: int, rays: Singles, i: int, found: Floats) -> None:
    """Where ray i meets a part whose frame is f (3, 4).

    Writes found (9,): distance |p p'| in metres, signed gap along the normal from the surface to the line, contact point
    on the surface (3,), its place along the part's axis in [0, 1], and how the gap shrinks when the part moves (3,): the
    normal, less what is along the axis, for a contact between the ends stays beside the line while its part slides.
    """
    meeting = meet(model, f, part, rays, i)
    for k in range(FOUND):
        found[k] = meeting[k]


@njit(cache=True, error_model="numpy", inline="always")
def meet(model: Model, f: Floats, part: int, rays: Singles, i: int) -> Meeting:
    """What `contact` writes, as numbers: in a loop over the rays of one part nothing of it goes through memory."""
    dx, dy, dz = float(rays[3, i]), float(rays[4, i]), float(rays[5, i])
    nx, ny, nz = float(rays[6, i]), float(rays[7, i]), float(rays[8, i])
    near, far = float(rays[9, i]), float(rays[10, i])
    b0, b1, b2 = model.bases[part, 0], model.bases[part, 1], model.bases[part, 2]
    ax = f[0, 3] + f[0, 0] * b0 + f[0, 1] * b1 + f[0, 2] * b2 - rays[0, i]
    ay = f[1, 3] + f[1, 0] * b0 + f[1, 1] * b1 + f[1, 2] * b2 - rays[1, i]
    az = f[2, 3] + f[2, 0] * b0 + f[2, 1] * b1 + f[2, 2] * b2 - rays[2, i]
    yx, yy, yz = f[0, 1], f[1, 1], f[2, 1]
    length = model.lengths[part]
    slope = dx * yx + dy * yy + dz * yz
    along = dx * ax + dy * ay + dz * az
    back = yx * ax + yy * ay + yz * az
    s = min(max((slope * along - back) / (1.0 - slope * slope + 1e-9), 0.0), length)
    t = min(max(along + s * slope, near), far)
    n1 = nx * yx + ny * yy + nz * yz
    met = min(max(slope * t - back, 0.0), length)
    s = min(max(met + REACH * n1, 0.0), length)
    share = s / length
    wider0, wider1 = model.radii[part, 2] - model.radii[part, 0], model.radii[part, 3] - model.radii[part, 1]
    rx, rz = model.radii[part, 0] + share * wider0, model.radii[part, 1] + share * wider1
    rm = 0.5 * (rx + rz)
    n0 = nx * f[0, 0] + ny * f[1, 0] + nz * f[2, 0]
    n2 = nx * f[0, 2] + ny * f[1, 2] + nz * f[2, 2]
    support = np.sqrt(rx * rx * n0 * n0 + rm * rm * n1 * n1 + rz * rz * n2 * n2) + 1e-9
    c0, c1, c2 = rx * rx * n0 / support, s + rm * rm * n1 / support, rz * rz * n2 / support
    px = ax + f[0, 0] * c0 + yx * c1 + f[0, 2] * c2
    py = ay + f[1, 0] * c0 + yy * c1 + f[1, 2] * c2
    pz = az + f[2, 0] * c0 + yz * c1 + f[2, 2] * c2
    t = min(max(px * dx + py * dy + pz * dz, near), far)
    vx, vy, vz = t * dx - px, t * dy - py, t * dz - pz
    gap, whole = nx * vx + ny * vy + nz * vz, vx * vx + vy * vy + vz * vz
    distance = np.sqrt(max(whole - min(whole - gap * gap, (s - met) ** 2 * (1.0 - n1 * n1)), 0.0))
    slip = 0.0
    if 0.0 < s < length:
        slip = n1 + (rx * n0 * n0 * wider0 + rz * n2 * n2 * wider1) / (support * length)
    x, y, z = px + rays[0, i], py + rays[1, i], pz + rays[2, i]
    return distance, gap, x, y, z, share, nx - slip * yx, ny - slip * yy, nz - slip * yz


@njit(cache=True, error_model="numpy")
def influence(found: Floats, spread: float, limit: float) -> float:
    """Weight of a contact in 1 / m^2, see `weight_of`."""
    return float(weight_of(found[0], found[1], spread, limit))


@njit(cache=True, error_model="numpy", inline="always")
def weight_of(distance: float, gap: float, spread: float, limit: float) -> float:
    """Weight of a ray in 1 / m^2: the pull grows up to `spread` metres and then stays; none beyond `limit`.

    A line that passes beside its contact, rather than before or behind it, counts less.
    """
    aside = (distance * distance - gap * gap) / (ASIDE * ASIDE)
    weight = min(1.0, spread / max(abs(gap), 1e-9)) / (spread * spread * (1.0 + max(aside, 0.0)))
    return weight if distance < limit else 0.0


@njit(cache=True, error_model="numpy", fastmath=True)
def misfit(distances: Singles, limit: float) -> float:
    """D, the mean of rho(d)^2 over the scene in m^2, rho a distance truncated at `limit` metres.  [Hybrid Eq. 30, 31]"""
    total, cut = np.float32(0.0), np.float32(limit)
    for i in range(distances.shape[0]):
        distance = min(distances[i], cut)
        total += distance * distance
    return float(total / np.float32(max(distances.shape[0], 1)))
