"""Foreground: the frame against the background model, with shadows told from the person.

A pixel differs when its distance from the model exceeds so many sigmas of the learnt noise.  Of those that differ, one that
is only darker, with its colour kept, may lie in shadow (Horprasert, Harwood and Davis 1999; Cucchiara et al. 2003).  Dark
clothes before a grey wall pass that test too, so the texture decides: a shadow shows the background's own texture, dimmed.
Where there is no texture to see, the pixel stays UNSURE, and `common.vision.silhouette` decides by where it lies.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.vision.background import Background, Image, Levels, gains

Labels = NDArray[np.uint8]

BACKGROUND: Final = 0
SHADOW: Final = 1  # darker, same colour, the background's texture
UNSURE: Final = 2  # darker, same colour, no texture to tell a shadow by
WEAK: Final = 3  # differs
STRONG: Final = 4  # differs beyond doubt

TEXTURE_REACH = 2  # px either side; a window of 5x5


@dataclass(frozen=True)
class ForegroundOptions:
    """Thresholds in sigmas of the noise, and ratios.

    weak, strong: distance from the model of a pixel that may belong to the person, and of one that does.
    shadow: brightness ratios (darkest, lightest) of a shadow; an empty range (1, 1) turns the test off.
    colour: how far a shadow's colour may turn, in sigmas and as a share of its brightness; the larger bound holds.
    texture: how far a shadow's texture may differ from the dimmed background's, likewise.
    flicker: measure the frame's gain against the model.
    """

    weak: float = 5.0
    strong: float = 10.0
    shadow: tuple[float, float] = (0.4, 0.97)
    colour: tuple[float, float] = (3.0, 0.04)
    texture: tuple[float, float] = (2.0, 0.04)
    flicker: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.weak <= self.strong:
            raise ValueError(f"weak, strong: {self.weak}, {self.strong}; allowed 0 < weak <= strong")
        if not 0 < self.shadow[0] <= self.shadow[1] <= 1:
            raise ValueError(f"shadow: {self.shadow}; allowed 0 < darkest <= lightest <= 1")


def expected(background: Background, frame: Image, options: ForegroundOptions) -> Levels:
    """Gain (3,) by which the model is multiplied before it is compared with this frame."""
    return gains(background, frame) if options.flicker else np.ones(3, dtype=np.float32)


def foreground(background: Background, frame: Image, gain: Levels, options: ForegroundOptions) -> Labels:
    """Label of every pixel, (height, width) uint8: BACKGROUND, SHADOW, UNSURE, WEAK or STRONG."""
    if frame.shape != background.mean.shape or frame.dtype != np.uint8:
        raise ValueError(f"frame: {frame.shape} {frame.dtype}; the background needs {background.mean.shape} uint8")
    labels = _differ(
        np.ascontiguousarray(frame),
        background.mean,
        background.weight,
        gain,
        np.float32(options.weak**2),
        np.float32(options.strong**2),
        np.array([*options.shadow, *options.colour], dtype=np.float32),
    )
    _tell_by_texture(frame, background.mean, background.weight, gain, np.array(options.texture, np.float32), labels)
    return labels


@njit(cache=True, error_model="numpy", fastmath=True)
def _differ(
    frame: Image,
    mean: Levels,
    weight: Levels,
    gain: Levels,
    weak2: np.float32,
    strong2: np.float32,
    shadow: Levels,
) -> Labels:
    """shadow: darkest and lightest ratio, colour in sigmas and as a share of the brightness."""
    height, width = frame.shape[:2]
    labels = np.zeros((height, width), dtype=np.uint8)
    distance = np.empty(width, dtype=np.float32)
    g0, g1, g2 = gain[0], gain[1], gain[2]
    for y in range(height):
        for x in range(width):
            d0 = np.float32(frame[y, x, 0]) - g0 * mean[y, x, 0]
            d1 = np.float32(frame[y, x, 1]) - g1 * mean[y, x, 1]
            d2 = np.float32(frame[y, x, 2]) - g2 * mean[y, x, 2]
            distance[x] = d0 * d0 * weight[y, x, 0] + d1 * d1 * weight[y, x, 1] + d2 * d2 * weight[y, x, 2]
        for x in range(width):
            if distance[x] < weak2:
                continue
            across, along, seen2 = np.float32(0), np.float32(0), np.float32(0)
            for c in range(3):
                known = gain[c] * mean[y, x, c]
                across += weight[y, x, c] * known * np.float32(frame[y, x, c])
                along += weight[y, x, c] * known * known
                seen2 += np.float32(frame[y, x, c]) ** 2
            ratio = across / max(along, np.float32(1e-6))
            if shadow[0] <= ratio < shadow[1]:
                turned, turned2 = np.float32(0), np.float32(0)
                for c in range(3):
                    off = np.float32(frame[y, x, c]) - ratio * gain[c] * mean[y, x, c]
                    turned += weight[y, x, c] * off * off
                    turned2 += off * off
                if turned < shadow[2] ** 2 or turned2 < shadow[3] ** 2 * seen2:
                    labels[y, x] = UNSURE
                    continue
            labels[y, x] = STRONG if distance[x] >= strong2 else WEAK
    return labels


@njit(cache=True, error_model="numpy", fastmath=True)
def _tell_by_texture(
    frame: Image, mean: Levels, weight: Levels, gain: Levels, tolerance: Levels, labels: Labels
) -> None:
    """Settle UNSURE pixels in place: SHADOW where the background's texture shows dimmed, WEAK where another one does."""
    height, width = labels.shape
    before = labels.copy()
    for y in range(height):
        for x in range(width):
            if before[y, x] != UNSURE:
                continue
            n, s, k, ss, kk, sk = 0, np.float32(0), np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for v in range(max(0, y - TEXTURE_REACH), min(height, y + TEXTURE_REACH + 1)):
                for u in range(max(0, x - TEXTURE_REACH), min(width, x + TEXTURE_REACH + 1)):
                    if before[v, u] != UNSURE:
                        continue
                    seen, known = np.float32(0), np.float32(0)
                    for c in range(3):
                        seen += np.float32(frame[v, u, c])
                        known += gain[c] * mean[v, u, c]
                    n, s, k = n + 1, s + seen, k + known
                    ss, kk, sk = ss + seen * seen, kk + known * known, sk + seen * known
            if n < 6:
                continue
            ratio = sk / max(kk, np.float32(1))
            noise = 1 / weight[y, x, 0] + 1 / weight[y, x, 1] + 1 / weight[y, x, 2]
            noise *= 1 + ratio * ratio
            misfit = max(ss - ratio * sk, np.float32(0)) / (n - 1)
            contrast = max(ss - s * s / n, np.float32(0)) / (n - 1)
            if misfit > tolerance[0] ** 2 * noise and misfit > (tolerance[1] * s / n) ** 2:
                labels[y, x] = WEAK
            elif contrast > 4 * noise and misfit < np.float32(0.4) * contrast:
                labels[y, x] = SHADOW
