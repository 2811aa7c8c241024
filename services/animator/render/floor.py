"""Compiled floor: a plane with a grid that fades into the background, and shadows on it."""

import numpy as np

from zenocap.common.arrays import Floats32, Ints32
from zenocap.common.jit import kernel


@kernel
def draw_floor(out: Floats32, camera: Floats32, floor: Floats32) -> None:
    """Draw floor and background into `out` (h, w, 3), linear light.

    camera: see `light_body`.  floor: (7, 3): colours of the floor, its fine and its bold lines, the background low and
    high; (x, z, radius) of the lit area, metres; (distance of bold lines, metres, unused).
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
            # Metres of floor that a pixel covers, along and across; lines are never thinner.
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
    return float(np.exp(-1.1 * away)) if away < 6.0 else 0.0


@kernel
def _line(place: float, apart: float, thick: float, pixel: float) -> float:
    """Share of a pixel (side `pixel`, metres) that a grid line covers, approximately; 0 where lines would merge."""
    off = abs(place - np.rint(place / apart) * apart)
    half = 0.5 * (thick + pixel)
    covered = min(max((half - off) / max(pixel, 1e-6), 0.0), min(1.0, thick / max(pixel, 1e-6)))
    return float(covered * min(max(2.0 - 4.0 * pixel / apart, 0.0), 1.0))
