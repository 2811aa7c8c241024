"""Contour rays as evidence: contacts, residuals, error D.  [Hybrid V-B]

A ray may slide along its surviving interval.  Its contact with a part is the point at which the part's tangent plane is
parallel to that of the ray (viewing line and contour tangent), near the closest approach of ray and axis.  Motion of the
contact along the axis does not count as distance.
"""

import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints, Ints32
from zenocap.common.jit import finite_leaf_kernel, inlined_kernel, kernel, leaf_kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of
from zenocap.services.tracker.evidence.residuals import Weights, robust_weight
from zenocap.services.tracker.parameters import CONTACT_SHIFT_M

# Paper (replaced): V-B takes the closest points of fixed scene points; here a ray slides along its surviving interval.
Contact = tuple[float, float, float, float, float, float, float, float, float]

CONTACT_LENGTH = 9


@finite_leaf_kernel
def nearest_parts(model: BodyModel, frames: Floats, rays: Floats32, distances: Floats32, parts: Ints32) -> None:
    """Write the part nearest to every ray, and its distance |p p'| in metres: (n,) each.

    Branch-free and in single precision, for SIMD of eight rays; round parts need no square root.
    """
    n = rays.shape[1]
    for i in range(n):
        distances[i] = np.float32(1e18)
        parts[i] = 0
    zero, half, tiny = np.float32(0.0), np.float32(0.5), np.float32(1e-9)
    one, reach = np.float32(1.0), np.float32(CONTACT_SHIFT_M)
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


@kernel
def nearest_of(model: BodyModel, frames: Floats, rays: Floats32) -> tuple[Floats32, Ints32]:
    """Distance of every ray from the nearest part, metres, and that part: (n,) each, see `nearest_parts`."""
    distances, parts = np.empty(rays.shape[1], dtype=np.float32), np.empty(rays.shape[1], dtype=np.int32)
    nearest_parts(model, frames, rays, distances, parts)
    return distances, parts


@leaf_kernel
def contact_on_part(model: BodyModel, f: Floats, part: int, rays: Floats32, i: int, found: Floats) -> None:
    """Contact of ray i with a part whose frame is f (3, 4).

    Writes found (9,): distance |p p'| in metres, signed gap along the normal from surface to ray, contact point on the
    surface (3,), its fraction of the part's axis in [0, 1], and the derivative of the gap to the part's position (3,): the
    normal less its component along the axis, for a contact between the ends stays beside the ray while its part slides.
    """
    meeting = ray_contact(model, f, part, rays, i)
    for k in range(CONTACT_LENGTH):
        found[k] = meeting[k]


@inlined_kernel
def ray_contact(model: BodyModel, f: Floats, part: int, rays: Floats32, i: int) -> Contact:
    """Contact of `contact_on_part` as a tuple, which stays in registers."""
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
    s = min(max(met + CONTACT_SHIFT_M * n1, 0.0), length)
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


@kernel
def add_rays(
    model: BodyModel, frames: Floats, rays: Floats32, weights: Weights, matrices: Floats, gradients: Floats
) -> None:
    """Write the wrench matrix (p, 6, 6) and gradient (p, 6) of the rays of every part that has some."""
    count = frames.shape[0]
    _, parts = nearest_of(model, frames, rays)
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
        _add_part(model, frames, part, rays, order[first[part] : first[part + 1]], weights, matrices[part], gradients[part])


@finite_leaf_kernel
def _add_part(
    model: BodyModel, frames: Floats, part: int, rays: Floats32, own: Ints,
    weights: Weights, matrix: Floats, gradient: Floats,
) -> None:  # fmt: skip
    """Write the wrench matrix (6, 6) and gradient (6,) of the rays of one part, indices `own` (n,), summed in registers."""
    f = frames[part]
    ox, oy, oz = frames[0, 0, 3], frames[0, 1, 3], frames[0, 2, 3]
    spread, limit, ray_weight = weights.spread, weights.limit, weights.ray_weight
    p0 = p1 = p2 = p3 = p4 = p5 = 0.0
    m00 = m10 = m11 = m20 = m21 = m22 = m30 = m31 = m32 = m33 = 0.0
    m40 = m41 = m42 = m43 = m44 = m50 = m51 = m52 = m53 = m54 = m55 = 0.0
    for k in range(own.shape[0]):
        distance, gap, x, y, z, _, a, b, c = ray_contact(model, f, part, rays, own[k])
        weight = ray_weight * robust_weight(distance, gap, spread, limit)
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
    gradient[0], gradient[1], gradient[2], gradient[3], gradient[4], gradient[5] = p0, p1, p2, p3, p4, p5
    matrix[0, 0], matrix[1, 0], matrix[1, 1] = m00, m10, m11
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = m20, m21, m22
    matrix[3, 0], matrix[3, 1], matrix[3, 2], matrix[3, 3] = m30, m31, m32, m33
    matrix[4, 0], matrix[4, 1], matrix[4, 2], matrix[4, 3], matrix[4, 4] = m40, m41, m42, m43, m44
    matrix[5, 0], matrix[5, 1], matrix[5, 2], matrix[5, 3], matrix[5, 4], matrix[5, 5] = m50, m51, m52, m53, m54, m55


@finite_leaf_kernel
def mean_truncated_square(distances: Floats32, limit: float) -> float:
    """D, the mean of rho(d)^2 over the scene in m^2, rho a distance truncated at `limit` metres.  [Hybrid Eq. 30, 31]"""
    # Paper (replaced): Eq. 31 modulates by md; here normals of ray and contact are equal, so md is constant.
    # Paper (open): Eq. 31 squares the argument of a truncated quadratic rho; here one square, truncated.
    total, cut = np.float32(0.0), np.float32(limit)
    for i in range(distances.shape[0]):
        distance = min(distances[i], cut)
        total += distance * distance
    return float(total / np.float32(max(distances.shape[0], 1)))


@kernel
def distances_of(model: BodyModel, rays: Floats32, pose: RootedPose) -> Floats32:
    """(n,) distance of every ray from the body in a pose, metres."""
    distances, _ = nearest_of(model, frames_of(model, pose), rays)
    return distances
