"""Compiled rasterization: triangles with a depth buffer, shadows, compositing, and sensor noise."""

import numpy as np

from zenocap.common.arrays import Bytes, Floats32, Ints32
from zenocap.common.jit import kernel

NEAR_M = 0.05


@kernel
def fill_triangles(
    pixels: Floats32, depth: Floats32, bgr: Floats32, triangles: Ints32, nearness: Floats32, colour: Floats32
) -> None:
    """Draw triangles into `nearness` (h, w), inverse depth in 1 / metres, 0 for empty, and `colour` (h, w, 3).

    pixels: (n, 2) column and row.  depth: (n,) metres along the optical axis; triangles nearer than 5 cm are omitted.
    bgr: (n, 3) colour at every point, interpolated.  Sample points are at integer columns and rows.
    """
    height, width = nearness.shape
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if not (depth[a] > NEAR_M and depth[b] > NEAR_M and depth[c] > NEAR_M):
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
        near_a, near_b, near_c = np.float32(1.0) / depth[a], np.float32(1.0) / depth[b], np.float32(1.0) / depth[c]
        for row in range(top, bottom + 1):
            for col in range(left, right + 1):
                u = ((bx - col) * (cy - row) - (cx - col) * (by - row)) * scale
                v = ((cx - col) * (ay - row) - (ax - col) * (cy - row)) * scale
                w = np.float32(1.0) - u - v
                if u < 0.0 or v < 0.0 or w < 0.0:
                    continue
                near = u * near_a + v * near_b + w * near_c
                if near > nearness[row, col]:
                    nearness[row, col] = near
                    for k in range(3):
                        colour[row, col, k] = u * bgr[a, k] + v * bgr[b, k] + w * bgr[c, k]


@kernel
def downsample(nearness: Floats32, colour: Floats32, step: int, out: Floats32) -> None:
    """Average step x step samples: out (h, w, 4) is BGR times coverage, and the coverage in [0, 1]."""
    weight = np.float32(1.0 / (step * step))
    for row in range(out.shape[0]):
        for col in range(out.shape[1]):
            b = g = r = share = np.float32(0.0)
            for y in range(row * step, row * step + step):
                for x in range(col * step, col * step + step):
                    if nearness[y, x] > 0.0:
                        b += colour[y, x, 0]
                        g += colour[y, x, 1]
                        r += colour[y, x, 2]
                        share += np.float32(1.0)
            out[row, col, 0] = b * weight
            out[row, col, 1] = g * weight
            out[row, col, 2] = r * weight
            out[row, col, 3] = share * weight


@kernel
def apply_shadow(background: Floats32, light: Floats32, left: int, top: int) -> None:
    """Multiply the region of background (h, w, 3) at (left, top) by light (h', w'), the same for all colours."""
    for row in range(light.shape[0]):
        for col in range(light.shape[1]):
            for k in range(3):
                background[top + row, left + col, k] *= light[row, col]


@kernel
def composite(background: Floats32, layer: Floats32, left: int, top: int) -> None:
    """Composite a layer (h', w', 4) with premultiplied colour over background (h, w, 3) at (left, top)."""
    for row in range(layer.shape[0]):
        for col in range(layer.shape[1]):
            rest = np.float32(1.0) - layer[row, col, 3]
            for k in range(3):
                background[top + row, left + col, k] = background[top + row, left + col, k] * rest + layer[row, col, k]


@kernel
def sensor_image(scene: Floats32, gain: float, sigma: float, key: int, out: Bytes) -> None:
    """Sensor model: out (h, w, 3) is gain * scene with noise of standard deviation `sigma` at mid-grey, in grey levels.

    Noise is a hash of `key` and the position, so that a frame is the same on every machine; its variance increases with
    brightness, as in a sensor.  The sum of four bytes approximates the normal distribution.
    """
    flat, target = scene.reshape(-1), out.reshape(-1)
    unit = np.float32(sigma / 147.80)  # standard deviation of the sum of four even bytes
    lift = np.float32(gain)
    seed = np.uint32(key)
    for k in range(flat.size):
        # The compiler widens products to 64 bits; every step is truncated to 32.
        h = np.uint32(np.uint32(k) * np.uint32(0x9E3779B1) + seed)
        h = np.uint32((h ^ (h >> 16)) * np.uint32(0x85EBCA6B))
        h = np.uint32((h ^ (h >> 13)) * np.uint32(0xC2B2AE35))
        h = np.uint32(h ^ (h >> 16))
        four = np.int32((h & 255) + ((h >> 8) & 255) + ((h >> 16) & 255) + (h >> 24))
        light = flat[k] * lift
        value = light + np.float32(four - 510) * unit * (np.float32(0.7) + light * np.float32(0.0023))
        target[k] = np.uint8(min(max(value + np.float32(0.5), np.float32(0.0)), np.float32(255.0)))
