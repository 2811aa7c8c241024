"""Compiled drawing: what lies nearest at every sample, the floor, and light on both."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Singles = NDArray[np.float32]
Bytes = NDArray[np.uint8]
Ints = NDArray[np.int32]

NEAR_M = 0.05


@njit(cache=True, error_model="numpy")
def fill(
    pixels: Singles, nearness: Singles, normals: Singles, shades: Bytes, triangles: Ints, out: Singles, row: Bytes
) -> None:
    """Draw triangles into `out` (h, w, 4): nearness, 0 where nothing is, and the normal; and `row` (h, w): the shade.

    pixels: (n, 2) column and row, samples at whole ones.  nearness: (n,) linear over the image and larger when nearer,
    such as 1 / depth; triangles with a point of 0 or less are left out.  normals: (n, 3).  shades: (n,) of the points.
    """
    height, width = row.shape
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if not (nearness[a] > 0.0 and nearness[b] > 0.0 and nearness[c] > 0.0):
            continue
        ax, ay, bx, by, cx, cy = pixels[a, 0], pixels[a, 1], pixels[b, 0], pixels[b, 1], pixels[c, 0], pixels[c, 1]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if not (abs(area) > np.float32(1e-9)):
            continue
        left = int(np.ceil(max(min(ax, bx, cx), np.float32(0.0))))
        right = int(np.floor(min(max(ax, bx, cx), np.float32(width - 1))))
        top = int(np.ceil(max(min(ay, by, cy), np.float32(0.0))))
        bottom = int(np.floor(min(max(ay, by, cy), np.float32(height - 1))))
        scale = np.float32(1.0) / area
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                u = ((bx - x) * (cy - y) - (cx - x) * (by - y)) * scale
                v = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) * scale
                w = np.float32(1.0) - u - v
                if u < 0.0 or v < 0.0 or w < 0.0:
                    continue
                near = u * nearness[a] + v * nearness[b] + w * nearness[c]
                if near > out[y, x, 0]:
                    out[y, x, 0] = near
                    for k in range(3):
                        out[y, x, 1 + k] = u * normals[a, k] + v * normals[b, k] + w * normals[c, k]
                    row[y, x] = shades[a]


@njit(cache=True, error_model="numpy")
def between(image: Singles, x: float, y: float) -> float:
    """The value of an image (h, w) between its samples; that of the border outside."""
    height, width = image.shape
    x = min(max(x, 0.0), width - 1.001)
    y = min(max(y, 0.0), height - 1.001)
    i, j = int(x), int(y)
    s, t = x - i, y - j
    low = image[j, i] * (1.0 - s) + image[j, i + 1] * s
    high = image[j + 1, i] * (1.0 - s) + image[j + 1, i + 1] * s
    return float(low * (1.0 - t) + high * t)


@njit(cache=True, error_model="numpy")
def shadow_at(depths: Singles, sun: Singles, x: float, y: float, z: float, bias: float) -> float:
    """Share of light in [0, 1] that reaches a point of the world; the mean of nine looks at the sun's map of depths.

    sun: (3, 4) world to column, row and height towards the sun, of the map depths (h, w), 0 where nothing is.
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


@njit(cache=True, error_model="numpy")
def light_body(
    samples: Singles, row: Bytes, region: Ints, step: int, camera: Singles, light: Singles, palette: Singles,
    depths: Singles, sun: Singles, out: Singles,
) -> None:  # fmt: skip
    """Lay the lit body over the picture `out` (h, w, 3), linear light, each pixel the mean of step x step samples.

    samples, row: of `fill`.  region: (2,) column and row of the picture where they begin.  light: (6, 3): direction to
    the sun, its colour, the sky's, the ground's, the rim's, (gloss, sharpness, share of the shadow).
    camera: (5, 3): rotation rows, centre in the world, (focal, centre x, centre y).  palette: (shades, 3).
    """
    rows, columns = row.shape[0] // step, row.shape[1] // step
    weight = 1.0 / (step * step)
    for py in range(rows):
        for px in range(columns):
            b = g = r = share = 0.0
            for y in range(py * step, py * step + step):
                for x in range(px * step, px * step + step):
                    near = samples[y, x, 0]
                    if near <= 0.0:
                        continue
                    nx, ny, nz = samples[y, x, 1], samples[y, x, 2], samples[y, x, 3]
                    size = 1.0 / max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-9)
                    nx, ny, nz = nx * size, ny * size, nz * size
                    u = (region[0] + (x + 0.5) / step - 0.5 - camera[4, 1]) / camera[4, 0]
                    v = (region[1] + (y + 0.5) / step - 0.5 - camera[4, 2]) / camera[4, 0]
                    dx = camera[0, 0] * u + camera[1, 0] * v + camera[2, 0]
                    dy = camera[0, 1] * u + camera[1, 1] * v + camera[2, 1]
                    dz = camera[0, 2] * u + camera[1, 2] * v + camera[2, 2]
                    wx, wy, wz = camera[3, 0] + dx / near, camera[3, 1] + dy / near, camera[3, 2] + dz / near
                    size = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz)
                    dx, dy, dz = -dx * size, -dy * size, -dz * size  # to the eye
                    facing = nx * dx + ny * dy + nz * dz
                    if facing < 0.0:
                        nx, ny, nz, facing = -nx, -ny, -nz, -facing
                    towards = nx * light[0, 0] + ny * light[0, 1] + nz * light[0, 2]
                    direct = max(towards, 0.0)
                    if direct > 0.0:
                        reach = shadow_at(depths, sun, wx + 0.02 * nx, wy + 0.02 * ny, wz + 0.02 * nz, 0.01)
                        direct *= 1.0 - light[5, 2] * (1.0 - reach)
                    hx, hy, hz = light[0, 0] + dx, light[0, 1] + dy, light[0, 2] + dz
                    size = 1.0 / max(np.sqrt(hx * hx + hy * hy + hz * hz), 1e-9)
                    gloss = max((nx * hx + ny * hy + nz * hz) * size, 0.0) ** light[5, 1] * light[5, 0] * direct
                    rim = (1.0 - facing) ** 3
                    sky = 0.5 + 0.5 * ny
                    low = 0.62 + 0.38 * min(max(wy / 0.5, 0.0), 1.0)  # less of the sky is seen near the floor
                    s = row[y, x]
                    ambient_b = low * (light[2, 0] * sky + light[3, 0] * (1.0 - sky))
                    ambient_g = low * (light[2, 1] * sky + light[3, 1] * (1.0 - sky))
                    ambient_r = low * (light[2, 2] * sky + light[3, 2] * (1.0 - sky))
                    b += palette[s, 0] * (ambient_b + light[1, 0] * direct) + gloss + rim * light[4, 0] * low
                    g += palette[s, 1] * (ambient_g + light[1, 1] * direct) + gloss + rim * light[4, 1] * low
                    r += palette[s, 2] * (ambient_r + light[1, 2] * direct) + gloss + rim * light[4, 2] * low
                    share += 1.0
            if share > 0.0:
                rest = 1.0 - share * weight
                i, j = region[1] + py, region[0] + px
                out[i, j, 0] = out[i, j, 0] * rest + b * weight
                out[i, j, 1] = out[i, j, 1] * rest + g * weight
                out[i, j, 2] = out[i, j, 2] * rest + r * weight


@njit(cache=True, error_model="numpy")
def draw_floor(out: Singles, camera: Singles, floor: Singles) -> None:
    """Paint floor and backdrop into `out` (h, w, 3), linear light.

    camera: see `light_body`.  floor: (7, 3): colours of the floor, of its fine and its bold lines, of the backdrop low and
    high, (x, z of the lit middle, its radius in metres), (metres between bold lines, unused).
    """
    height, width = out.shape[0], out.shape[1]
    focal, apart = float(camera[4, 0]), float(floor[6, 0])
    for row in range(height):
        v = (row - camera[4, 2]) / focal
        for col in range(width):
            u = (col - camera[4, 1]) / focal
            dx = camera[0, 0] * u + camera[1, 0] * v + camera[2, 0]
            dy = camera[0, 1] * u + camera[1, 1] * v + camera[2, 1]
            dz = camera[0, 2] * u + camera[1, 2] * v + camera[2, 2]
            size = np.sqrt(dx * dx + dy * dy + dz * dz)
            up = min(max(dy / size * 1.6 + 0.35, 0.0), 1.0)
            for k in range(3):
                out[row, col, k] = floor[3, k] + (floor[4, k] - floor[3, k]) * up
            distance = -camera[3, 1] / min(dy, -1e-6)
            if dy >= 0.0 or distance <= 0.0:
                continue
            x, z = camera[3, 0] + dx * distance, camera[3, 2] + dz * distance
            seen = _seen(floor, x, z)
            if seen < 0.002:
                continue
            # How many metres of floor a pixel covers, along and across; lines are never thinner than that.
            footprint = distance * size / focal
            along = footprint * size / -dy
            level = max(np.sqrt(dx * dx + dz * dz), 1e-6)
            wide_x = footprint + (along - footprint) * abs(dx) / level
            wide_z = footprint + (along - footprint) * abs(dz) / level
            fine = max(_line(x, apart / 4, 0.004, wide_x), _line(z, apart / 4, 0.004, wide_z))
            bold = max(_line(x, apart, 0.010, wide_x), _line(z, apart, 0.010, wide_z))
            for k in range(3):
                colour = floor[0, k] + (floor[1, k] - floor[0, k]) * fine
                colour = colour + (floor[2, k] - colour) * bold
                out[row, col, k] += (colour - out[row, col, k]) * seen


@njit(cache=True, error_model="numpy")
def darken_floor(
    out: Singles, region: Ints, camera: Singles, floor: Singles, dark: Singles, place: Singles, share: float
) -> None:
    """Take light off the floor in a region (left, top, right, bottom, all included) of the picture `out` (h, w, 3).

    dark: (h, w) how much of it is hidden, in [0, 1], 0 along its border; place: (3, 4) from the world to its column and
    row.  share: of the light that is taken where all is hidden.
    """
    focal = camera[4, 0]
    for row in range(region[1], region[3] + 1):
        v = (row - camera[4, 2]) / focal
        for col in range(region[0], region[2] + 1):
            u = (col - camera[4, 1]) / focal
            dy = camera[0, 1] * u + camera[1, 1] * v + camera[2, 1]
            distance = -camera[3, 1] / min(dy, -1e-6)
            if dy >= 0.0 or distance <= 0.0:
                continue
            x = camera[3, 0] + (camera[0, 0] * u + camera[1, 0] * v + camera[2, 0]) * distance
            z = camera[3, 2] + (camera[0, 2] * u + camera[1, 2] * v + camera[2, 2]) * distance
            hidden = between(
                dark,
                place[0, 0] * x + place[0, 2] * z + place[0, 3],
                place[1, 0] * x + place[1, 2] * z + place[1, 3],
            )
            if hidden > 0.0:
                light = 1.0 - share * hidden * _seen(floor, x, z)
                for k in range(3):
                    out[row, col, k] *= light


@njit(cache=True, error_model="numpy")
def develop(light: Singles, table: Bytes, out: Bytes) -> None:
    """out (h, w, 3) of linear light (h, w, 3): table (n,) has the grey level of k / (n - 1)."""
    top = table.size - 1
    flat, target = light.reshape(-1), out.reshape(-1)
    for k in range(flat.size):
        target[k] = table[int(min(max(flat[k], np.float32(0.0)), np.float32(1.0)) * top + np.float32(0.5))]


@njit(cache=True, error_model="numpy")
def _seen(floor: Singles, x: float, z: float) -> float:
    """How much of the floor is seen there; it fades into the backdrop with the distance from its lit middle."""
    away_x, away_z = (x - floor[5, 0]) / floor[5, 2], (z - floor[5, 1]) / floor[5, 2]
    away = away_x * away_x + away_z * away_z
    return float(np.exp(-1.1 * away)) if away < 6.0 else 0.0


@njit(cache=True, error_model="numpy")
def _line(place: float, apart: float, thick: float, pixel: float) -> float:
    """How much of a pixel of so many metres a grid's line covers, about; nothing of lines that would run together."""
    off = abs(place - np.rint(place / apart) * apart)
    half = 0.5 * (thick + pixel)
    covered = min(max((half - off) / max(pixel, 1e-6), 0.0), min(1.0, thick / max(pixel, 1e-6)))
    return float(covered * min(max(2.0 - 4.0 * pixel / apart, 0.0), 1.0))
