"""Compiled rasterizer: the nearest surface at every sample, its light, and conversion to sRGB.

The lights are a sun with shadows, the sky, the ground, a rim light and gloss."""

import numpy as np

from zenocap.common.arrays import Bytes, Floats32, Ints32
from zenocap.common.jit import kernel

# All chosen by hand.
NEAR_M = 0.05  # points nearer to the camera are not drawn

OFF_M = 0.035  # offset from a surface at which its shadow is evaluated, so that it does not shadow itself
SMOOTH = 1.01  # largest ratio of the depths in a pixel that is lit once
DULL = 0.7  # cosine below which no gloss is seen: at sharpness 34 less than 1e-5 of it
BENT = 0.98  # smallest squared length of the mean of its normals


@kernel
def fill(
    pixels: Floats32, nearness: Floats32, normals: Floats32, shades: Bytes, triangles: Ints32, out: Floats32, row: Bytes
) -> None:
    """Draw triangles into `out` (h, w, 4): nearness, 0 for none, and normal; and `row` (h, w): shade.

    pixels: (n, 2) column and row, samples at integers.  nearness: (n,) linear in the image and larger when nearer, such as
    1 / depth; triangles with a point of 0 or less are left out.  normals: (n, 3).  shades: (n,) of the points.
    """
    height, width = row.shape
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        near_a, near_b, near_c = float(nearness[a]), float(nearness[b]), float(nearness[c])
        if not (near_a > 0.0 and near_b > 0.0 and near_c > 0.0):
            continue
        ax, ay, bx, by = float(pixels[a, 0]), float(pixels[a, 1]), float(pixels[b, 0]), float(pixels[b, 1])
        cx, cy = float(pixels[c, 0]), float(pixels[c, 1])
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if not (abs(area) > 1e-9):
            continue
        left = int(np.ceil(max(min(ax, bx, cx), 0.0)))
        right = int(np.floor(min(max(ax, bx, cx), width - 1.0)))
        top = int(np.ceil(max(min(ay, by, cy), 0.0)))
        bottom = int(np.floor(min(max(ay, by, cy), height - 1.0)))
        scale = 1.0 / area
        across_u, across_v = (by - cy) * scale, (cy - ay) * scale  # change of the coordinates from column to column
        nearest = max(near_a, near_b, near_c)
        for y in range(top, bottom + 1):
            u = ((bx - left) * (cy - y) - (cx - left) * (by - y)) * scale
            v = ((cx - left) * (ay - y) - (ax - left) * (cy - y)) * scale
            for x in range(left, right + 1):
                w = 1.0 - u - v
                if u >= 0.0 and v >= 0.0 and w >= 0.0 and nearest > out[y, x, 0]:
                    near = u * near_a + v * near_b + w * near_c
                    if near > out[y, x, 0]:
                        out[y, x, 0] = near
                        for k in range(3):
                            out[y, x, 1 + k] = u * normals[a, k] + v * normals[b, k] + w * normals[c, k]
                        row[y, x] = shades[a]
                u += across_u
                v += across_v


@kernel
def develop(light: Floats32, table: Bytes, region: Ints32, out: Bytes) -> None:
    """Convert linear light (h, w, 3) to `out` (h, w, 3) in a region (left, top, right, bottom, inclusive).

    table: (n,) has the value for k / (n - 1).
    """
    top = np.float32(table.size - 1)
    for row in range(region[1], region[3] + 1):
        for col in range(region[0], region[2] + 1):
            for k in range(3):
                bright = min(max(light[row, col, k], np.float32(0.0)), np.float32(1.0))
                out[row, col, k] = table[int(bright * top + np.float32(0.5))]


@kernel
def shadow_at(depths: Floats32, sun: Floats32, x: float, y: float, z: float, bias: float) -> float:
    """Share of sunlight in [0, 1] that reaches a world point: the mean of nine samples of the shadow map.

    sun: (3, 4) world to column, row and height towards the sun, of the map `depths` (h, w), 0 for none.
    """
    u = sun[0, 0] * x + sun[0, 1] * y + sun[0, 2] * z + sun[0, 3]
    v = sun[1, 0] * x + sun[1, 1] * y + sun[1, 2] * z + sun[1, 3]
    own = sun[2, 0] * x + sun[2, 1] * y + sun[2, 2] * z + sun[2, 3] + bias
    height, width = depths.shape
    lit = 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            i, j = int(np.rint(u + 1.3 * dx)), int(np.rint(v + 1.3 * dy))
            if i < 0 or j < 0 or i >= width or j >= height or depths[j, i] <= own:
                lit += 1
    return lit / 9.0


@kernel
def lit(
    near: float, nx: float, ny: float, nz: float, shade: int, u: float, v: float, camera: Floats32, light: Floats32,
    palette: Floats32, depths: Floats32, sun: Floats32,
) -> tuple[float, float, float]:  # fmt: skip
    """Blue, green, red of one sample.  near: 1 / depth.  nx, ny, nz: normal of any length.  u, v: slopes of its ray."""
    size = 1.0 / max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-9)
    nx, ny, nz = nx * size, ny * size, nz * size
    dx = camera[0, 0] * u + camera[1, 0] * v + camera[2, 0]
    dy = camera[0, 1] * u + camera[1, 1] * v + camera[2, 1]
    dz = camera[0, 2] * u + camera[1, 2] * v + camera[2, 2]
    wx, wy, wz = camera[3, 0] + dx / near, camera[3, 1] + dy / near, camera[3, 2] + dz / near
    size = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz)
    dx, dy, dz = -dx * size, -dy * size, -dz * size  # to the camera
    facing = nx * dx + ny * dy + nz * dz
    if facing < 0.0:
        nx, ny, nz, facing = -nx, -ny, -nz, -facing
    direct = max(nx * light[0, 0] + ny * light[0, 1] + nz * light[0, 2], 0.0)
    gloss = 0.0
    if direct > 0.0:
        reach = shadow_at(depths, sun, wx + OFF_M * nx, wy + OFF_M * ny, wz + OFF_M * nz, OFF_M / 2)
        direct *= 1.0 - light[5, 2] * (1.0 - reach)
        hx, hy, hz = light[0, 0] + dx, light[0, 1] + dy, light[0, 2] + dz
        size = 1.0 / max(np.sqrt(hx * hx + hy * hy + hz * hz), 1e-9)
        along = (nx * hx + ny * hy + nz * hz) * size
        if along > DULL:
            gloss = along ** light[5, 1] * light[5, 0] * direct
    away = 1.0 - facing
    rim = away * away * away
    sky = 0.5 + 0.5 * ny
    low = 0.62 + 0.38 * min(max(wy / 0.5, 0.0), 1.0)  # less sky light near the floor
    b = palette[shade, 0] * (low * (light[2, 0] * sky + light[3, 0] * (1.0 - sky)) + light[1, 0] * direct)
    g = palette[shade, 1] * (low * (light[2, 1] * sky + light[3, 1] * (1.0 - sky)) + light[1, 1] * direct)
    r = palette[shade, 2] * (low * (light[2, 2] * sky + light[3, 2] * (1.0 - sky)) + light[1, 2] * direct)
    rim *= low
    return b + gloss + rim * light[4, 0], g + gloss + rim * light[4, 1], r + gloss + rim * light[4, 2]


@kernel
def light_body(
    samples: Floats32, row: Bytes, region: Ints32, step: int, camera: Floats32, light: Floats32, palette: Floats32,
    depths: Floats32, sun: Floats32, out: Floats32,
) -> None:  # fmt: skip
    """Draw the lit surface over the picture `out` (h, w, 3), linear light, every pixel the mean of step x step samples.

    samples, row: from `fill`.  region: its first two values are the column and row of the picture where they start.
    light: (6, 3): direction to the sun, its colour, the sky's, the ground's, the rim's, (gloss, sharpness, share of the
    shadow).  camera: (5, 3): rotation rows, centre in the world, (focal, centre x, centre y).  palette: (shades, 3).
    A pixel whose samples are all on one smooth area is lit once, at its centre.
    """
    rows, columns = row.shape[0] // step, row.shape[1] // step
    weight = 1.0 / (step * step)
    for py in range(rows):
        j = region[1] + py
        for px in range(columns):
            i = region[0] + px
            covered = 0
            shade = row[py * step, px * step]
            whole = True
            low, high, nx, ny, nz = np.inf, 0.0, 0.0, 0.0, 0.0
            for y in range(py * step, py * step + step):
                for x in range(px * step, px * step + step):
                    near = samples[y, x, 0]
                    if near > 0.0:
                        covered += 1
                        low, high = min(low, near), max(high, near)
                        nx, ny, nz = nx + samples[y, x, 1], ny + samples[y, x, 2], nz + samples[y, x, 3]
                        whole = whole and row[y, x] == shade
            if covered == 0:
                continue
            whole = whole and covered == step * step and high < low * SMOOTH
            if whole and nx * nx + ny * ny + nz * nz > BENT * covered * covered:
                u, v = (i - camera[4, 1]) / camera[4, 0], (j - camera[4, 2]) / camera[4, 0]
                b, g, r = lit(0.5 * (low + high), nx, ny, nz, shade, u, v, camera, light, palette, depths, sun)
                out[j, i, 0], out[j, i, 1], out[j, i, 2] = b, g, r
                continue
            b = g = r = 0.0
            for y in range(py * step, py * step + step):
                for x in range(px * step, px * step + step):
                    near = samples[y, x, 0]
                    if near > 0.0:
                        u = (region[0] + (x + 0.5) / step - 0.5 - camera[4, 1]) / camera[4, 0]
                        v = (region[1] + (y + 0.5) / step - 0.5 - camera[4, 2]) / camera[4, 0]
                        one = lit(
                            near, samples[y, x, 1], samples[y, x, 2], samples[y, x, 3], row[y, x], u, v, camera, light,
                            palette, depths, sun,
                        )  # fmt: skip
                        b, g, r = b + one[0], g + one[1], r + one[2]
            rest = 1.0 - covered * weight
            out[j, i, 0] = out[j, i, 0] * rest + b * weight
            out[j, i, 1] = out[j, i, 1] * rest + g * weight
            out[j, i, 2] = out[j, i, 2] * rest + r * weight
