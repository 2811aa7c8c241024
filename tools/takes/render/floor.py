"""Compiled floor: a plane with a grid that fades into the background, and shadows on it."""

import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints32
from zenocap.common.jit import finite_kernel, inlined_kernel, kernel

FADED = 6.0  # square of the distance from the lit area, relative to its radius, at which no floor is seen; chosen by hand


@kernel
def draw_floor(out: Floats32, camera: Floats32, floor: Floats32) -> None:
    """Draw floor and background into `out` (h, w, 3), linear light.

    camera: see `light_body`.  floor: (7, 3): colours of the floor, its fine and its bold lines, the background low and
    high; (x, z, radius) of the lit area, metres; (distance of bold lines, metres, unused).
    """
    height, width = out.shape[0], out.shape[1]
    ups, sights = np.empty(width), np.empty(width)
    fines, bolds = np.empty(width), np.empty(width)
    for row in range(height):
        _look_at_row(row, camera, floor, ups, sights, fines, bolds)
        for k in range(3):
            plain, fine, bold, low, high = floor[0, k], floor[1, k], floor[2, k], floor[3, k], floor[4, k]
            for col in range(width):
                behind = low + (high - low) * ups[col]
                colour = plain + (fine - plain) * fines[col]
                colour = colour + (bold - colour) * bolds[col]
                out[row, col, k] = behind + (colour - behind) * sights[col]


@finite_kernel
def _look_at_row(
    row: int, camera: Floats32, floor: Floats32, ups: Floats, sights: Floats, fines: Floats, bolds: Floats
) -> None:
    """Of the pixels of a row (w,): share of the high background, visibility of the floor, shares of fine and bold lines.

    Without branches, so that several pixels are computed at once.
    """
    per_focal, apart, above = 1.0 / float(camera[4, 0]), float(floor[6, 0]), float(camera[3, 1])
    middle, right_x, right_y, right_z = float(camera[4, 1]), camera[0, 0], camera[0, 1], camera[0, 2]
    eye_x, eye_z, lit_x, lit_z, per_radius = camera[3, 0], camera[3, 2], floor[5, 0], floor[5, 1], 1.0 / floor[5, 2]
    v = (row - float(camera[4, 2])) * per_focal
    begin_x, begin_y = camera[1, 0] * v + camera[2, 0], camera[1, 1] * v + camera[2, 1]
    begin_z = camera[1, 2] * v + camera[2, 2]
    for col in range(len(ups)):
        u = (col - middle) * per_focal
        dx, dy, dz = begin_x + right_x * u, begin_y + right_y * u, begin_z + right_z * u
        size = np.sqrt(dx * dx + dy * dy + dz * dz)
        ups[col] = min(max(dy / size * 1.6 + 0.35, 0.0), 1.0)
        per_fall = 1.0 / max(-dy, 1e-6)
        distance = above * per_fall
        x, z = eye_x + dx * distance, eye_z + dz * distance
        away_x, away_z = (x - lit_x) * per_radius, (z - lit_z) * per_radius
        away = min(away_x * away_x + away_z * away_z, FADED)
        seen = _fading(away)
        seen = seen if away < FADED else 0.0
        seen = seen if dy < 0.0 else 0.0
        seen = seen if distance > 0.0 else 0.0
        sights[col] = seen if seen > 0.002 else 0.0
        # Metres of floor that a pixel covers, along and across; lines are never thinner.
        footprint = max(distance, 1e-6) * size * per_focal
        along = footprint * size * per_fall - footprint
        per_level = 1.0 / max(np.sqrt(dx * dx + dz * dz), 1e-6)
        wide_x, wide_z = footprint + along * abs(dx) * per_level, footprint + along * abs(dz) * per_level
        per_wide_x, per_wide_z = 1.0 / max(wide_x, 1e-6), 1.0 / max(wide_z, 1e-6)
        fine, bold = 4.0 / apart, 1.0 / apart
        fines[col] = max(_line(x, fine, 0.004, wide_x, per_wide_x), _line(z, fine, 0.004, wide_z, per_wide_z))
        bolds[col] = max(_line(x, bold, 0.010, wide_x, per_wide_x), _line(z, bold, 0.010, wide_z, per_wide_z))


@kernel
def darken_floor(
    out: Floats32, region: Ints32, camera: Floats32, floor: Floats32, dark: Floats32, place: Floats32, share: float
) -> None:
    """Darken the floor in a region (left, top, right, bottom, inclusive) of the picture `out` (h, w, 3).

    dark: (h, w) shadow map in [0, 1], 0 along its border; place: (3, 4) from the world to its column and row.  share: of
    the light that is removed at 1.
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


@kernel
def between(image: Floats32, x: float, y: float) -> float:
    """Value of an image (h, w) by bilinear interpolation; outside, that of the border."""
    height, width = image.shape
    x = min(max(x, 0.0), width - 1.001)
    y = min(max(y, 0.0), height - 1.001)
    i, j = int(x), int(y)
    s, t = x - i, y - j
    low = image[j, i] * (1.0 - s) + image[j, i + 1] * s
    high = image[j + 1, i] * (1.0 - s) + image[j + 1, i + 1] * s
    return float(low * (1.0 - t) + high * t)


@kernel
def _seen(floor: Floats32, x: float, z: float) -> float:
    """Visibility of the floor at a point; it fades into the background with the distance from the lit area."""
    away_x, away_z = (x - floor[5, 0]) / floor[5, 2], (z - floor[5, 1]) / floor[5, 2]
    away = away_x * away_x + away_z * away_z
    return float(_fading(away)) if away < FADED else 0.0


@inlined_kernel
def _fading(away: float) -> float:
    """exp(-1.1 away) within 0.6 % up to FADED, as a power that needs multiplications only."""
    power = 1.0 - 1.1 / 4096 * away
    for _ in range(12):
        power = power * power
    return power


@inlined_kernel
def _line(place: float, density: float, thick: float, pixel: float, per_pixel: float) -> float:
    """Share of a pixel that a grid line covers, approximately; 0 where lines would merge.

    density: lines per metre.  pixel: its side, metres; per_pixel: 1 / pixel.
    """
    lines = place * density
    off = abs(lines - np.rint(lines)) / density
    covered = min(max((0.5 * (thick + pixel) - off) * per_pixel, 0.0), min(1.0, thick * per_pixel))
    return float(covered * min(max(2.0 - 4.0 * pixel * density, 0.0), 1.0))
