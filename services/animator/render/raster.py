"""Compiled drawing: what lies nearest at every sample, and grey levels of light."""

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
def develop(light: Singles, table: Bytes, out: Bytes) -> None:
    """out (h, w, 3) of linear light (h, w, 3): table (n,) has the grey level of k / (n - 1)."""
    top = table.size - 1
    flat, target = light.reshape(-1), out.reshape(-1)
    for k in range(flat.size):
        target[k] = table[int(min(max(flat[k], np.float32(0.0)), np.float32(1.0)) * top + np.float32(0.5))]
