"""Foreground labels of a frame by background subtraction, with shadow detection.

A pixel differs when its distance from the model exceeds a number of sigmas of the learnt noise.  A pixel that is darker
with the same colour may be in shadow (Horprasert, Harwood and Davis 1999; Cucchiara et al. 2003), or show dark clothes
before a grey wall.  The texture decides: a shadow shows the dimmed texture of the background.  Without texture a pixel
stays UNSURE, and `zenocap.common.vision.silhouette` decides by its position.
"""

# Paper (replaced): 1 subtracts and thresholds; here the threshold is in sigmas of each pixel, and shadows are excluded.

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image, Ints32, Labels
from zenocap.common.jit import NO_BITS, finite_kernel, finite_leaf_kernel, kernel, leaf_kernel
from zenocap.common.vision.background import Background, gain_and_limits

BACKGROUND: Final = 0
SHADOW: Final = 1  # darker, same colour, the background's texture
UNSURE: Final = 2  # darker, same colour, without texture that would identify a shadow
WEAK: Final = 3  # differs
STRONG: Final = 4  # differs strongly

TEXTURE_REACH = 2  # px on each side, window in which texture is compared; chosen by hand
CONTRAST_REACH = 0.01  # of the image height, radius in which a high contrast hides a low one; chosen by hand
HALO_PX = 8  # px around strong differences in which the noise of the compression is expected: a block of JPEG and H.264
HALO_MATTERS = 1.1  # chosen by hand
LEVELS_PER_SIGMA = 4.0  # resolution of distances stored as bytes; the largest is 64 sigmas


@dataclass(frozen=True)
class ForegroundOptions:
    """Thresholds in sigmas of the noise, and ratios; all chosen by hand.

    weak, strong: distance from the model of a pixel that may belong to the person, and of one that does.
    shadow: brightness ratios (darkest, lightest) of a shadow; an empty range (1, 1) disables shadow detection.
    colour: largest change of a shadow's colour, in sigmas and as a share of its brightness; the larger bound applies.
    texture: standard errors by which the texture must indicate a shadow or its absence.
    faint: a pixel that differs by less than this share of its neighbours is their blur or coding noise.
    flicker: correct the global gain of each frame.
    """

    weak: float = 5.0
    strong: float = 10.0
    shadow: tuple[float, float] = (0.4, 0.97)
    colour: tuple[float, float] = (3.0, 0.04)
    texture: float = 3.0
    faint: float = 0.15
    flicker: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.weak <= self.strong:
            raise ValueError(f"weak, strong: {self.weak}, {self.strong}; allowed 0 < weak <= strong")
        if not 0 < self.shadow[0] <= self.shadow[1] <= 1:
            raise ValueError(f"shadow: {self.shadow}; allowed 0 < darkest <= lightest <= 1")


def foreground(
    background: Background, frame: Image, options: ForegroundOptions, halo: float = 1.0
) -> tuple[Labels, Floats32]:
    """Labels BACKGROUND, SHADOW, UNSURE, WEAK or STRONG, (height, width), and the gain (3,) of the frame over the model.

    halo: noise around a person in units of that of the model; larger than 1 for compressed images.
    Raises ValueError for another shape.
    """
    if frame.dtype != np.uint8:
        raise ValueError(f"frame: {frame.dtype}; the background needs uint8")
    gain, limits = gain_and_limits(background, frame, options.weak, flicker=options.flicker)
    labels, levels = _differ(
        np.ascontiguousarray(frame),
        limits.low,
        limits.high,
        background.mean,
        background.weight,
        gain,
        np.float32(options.weak**2),
        np.float32(options.strong**2),
        np.array([*options.shadow, *options.colour], dtype=np.float32),
    )
    reach = max(1, round(CONTRAST_REACH * frame.shape[0]))
    nearby = cv2.dilate(levels, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    _drop_faint(levels, np.asarray(nearby, dtype=np.uint8), np.float32(options.faint), labels)
    if halo > HALO_MATTERS:
        strong = np.where(labels == STRONG, 255, 0).astype(np.uint8)
        around = cv2.dilate(strong, np.ones((2 * HALO_PX + 1, 2 * HALO_PX + 1), np.uint8))
        _drop_faint(
            levels, np.asarray(around, dtype=np.uint8), np.float32(halo * options.weak * LEVELS_PER_SIGMA / 255), labels
        )
    _detect_shadows(frame, background.mean, background.weight, gain, options.texture, labels)
    return labels, gain


@finite_kernel
def _differ(
    frame: Image,
    low: Image,
    high: Image,
    mean: Floats32,
    weight: Floats32,
    gain: Floats32,
    weak2: np.float32,
    strong2: np.float32,
    shadow: Floats32,
) -> tuple[Labels, Image]:
    """Labels, and distances in quarter sigmas where they are WEAK at least, both (height, width).

    low, high: `Limits` at distance weak; pixels within them need no exact distance, and most are.
    shadow: darkest and lightest ratio, colour change in sigmas and as a share of the brightness.
    """
    height, width = frame.shape[:2]
    labels = np.zeros((height, width), dtype=np.uint8)
    levels = np.zeros((height, width), dtype=np.uint8)
    outside = np.zeros(24 * ((width + 7) // 8), dtype=np.uint8)  # of each channel of a row; 3 words are 8 pixels
    words = outside.view(np.uint64)
    places = np.empty(width + 8, dtype=np.int64)
    for y in range(height):
        _outside(frame[y].reshape(-1), low[y].reshape(-1), high[y].reshape(-1), outside)
        count = 0
        for k in range(0, len(words), 3):
            if words[k] | words[k + 1] | words[k + 2] != NO_BITS:
                for x in range(8 * k // 3, 8 * k // 3 + 8):
                    places[count] = x
                    count += outside[3 * x] | outside[3 * x + 1] | outside[3 * x + 2]
        for n in range(count):
            x = places[n]
            distance = np.float32(0)
            for c in range(3):
                off = np.float32(frame[y, x, c]) - gain[c] * mean[y, x, c]
                distance += off * off * weight[y, x, c]
            if distance < weak2:
                continue
            levels[y, x] = np.uint8(min(np.float32(255), np.float32(LEVELS_PER_SIGMA) * np.sqrt(distance)))
            labels[y, x] = STRONG if distance >= strong2 else WEAK
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
    return labels, levels


@leaf_kernel
def _outside(values: Image, low: Image, high: Image, outside: Image) -> None:
    """Write 1 for values (n,) outside of their limits, else 0."""
    for k in range(len(values)):
        outside[k] = (values[k] < low[k]) | (values[k] > high[k])


@leaf_kernel
def _drop_faint(levels: Image, nearby: Image, faint: np.float32, labels: Labels) -> None:
    for y in range(levels.shape[0]):
        for x in range(levels.shape[1]):
            if levels[y, x] != 0 and np.float32(levels[y, x]) < faint * np.float32(nearby[y, x]):
                labels[y, x] = BACKGROUND


@finite_kernel
def _detect_shadows(frame: Image, mean: Floats32, weight: Floats32, gain: Floats32, sure: float, labels: Labels) -> None:
    """Classify UNSURE pixels in place: SHADOW where the texture of the background is visible, WEAK where it is covered.

    Texture is the second difference along rows and columns, which the soft edge of a shadow does not change.  Let q be that
    of frame / model and b that of the model, both relative.  Where an object covers the background q follows -b; in a
    shadow it does not.  `cover` is the regression of q on -b in the window: 1 for an object, 0 for a shadow.  The error of
    the model makes it 1 as well, so the texture must exceed that error for WEAK.
    """
    places = _unsure_places(labels)
    if len(places) == 1:
        return
    top, left = places[1, 0] - TEXTURE_REACH, places[1:, 1].min() - TEXTURE_REACH
    bottom, right = places[-1, 0] + TEXTURE_REACH, places[1:, 1].max() + TEXTURE_REACH
    number = np.zeros((bottom - top + 1, right - left + 1), dtype=np.int32)  # of the UNSURE pixels, from 1
    for k in range(1, len(places)):
        number[places[k, 0] - top, places[k, 1] - left] = k
    sums = _texture(frame, mean, gain, labels, places)
    for k in range(1, len(places)):
        y, x = places[k, 0], places[k, 1]
        qq, qb, bb, n = np.float32(0), np.float32(0), np.float32(1e-9), np.float32(0)
        for v in range(y - TEXTURE_REACH, y + TEXTURE_REACH + 1):
            for u in range(x - TEXTURE_REACH, x + TEXTURE_REACH + 1):
                j = number[v - top, u - left]
                qq += sums[j, 0]
                qb += sums[j, 1]
                bb += sums[j, 2]
                n += sums[j, 3]
        if n < 4:
            continue
        cover = qb / bb
        error = np.sqrt(max(qq - qb * cover, np.float32(0)) / (bb * (n - 1)))
        if cover + sure * error < 0.5:
            labels[y, x] = SHADOW
        elif cover - sure * error > 0.5 and bb > n * _model_error(mean, weight, y, x):
            labels[y, x] = WEAK


@finite_kernel
def _texture(frame: Image, mean: Floats32, gain: Floats32, labels: Labels, places: Ints32) -> Floats32:
    """(n + 1, 4) sums of q q, -q b, b b and their number at each UNSURE pixel; row 0 is for all other pixels."""
    height, width = labels.shape
    sums = np.zeros((len(places), 4), dtype=np.float32)
    for k in range(1, len(places)):
        y, x = places[k, 0], places[k, 1]
        if not (0 < y < height - 1 and 0 < x < width - 1):
            continue
        seen1, known1 = _brightness(frame, mean, gain, y, x)
        q1 = seen1 / known1
        for dy, dx in ((0, 1), (1, 0)):
            if labels[y - dy, x - dx] != UNSURE or labels[y + dy, x + dx] != UNSURE:
                continue
            seen0, known0 = _brightness(frame, mean, gain, y - dy, x - dx)
            seen2, known2 = _brightness(frame, mean, gain, y + dy, x + dx)
            q = (seen0 / known0 - 2 * q1 + seen2 / known2) / max(np.float32(q1), np.float32(1e-3))
            b = (known0 - 2 * known1 + known2) / known1
            sums[k, 0] += q * q
            sums[k, 1] -= q * b
            sums[k, 2] += b * b
            sums[k, 3] += 1
    return sums


@kernel
def _unsure_places(labels: Labels) -> Ints32:
    """(n + 1, 2) row and column of the n UNSURE pixels, row by row, after an unused first row."""
    width = labels.shape[1]
    values = labels.reshape(-1)
    words = values[: len(values) // 8 * 8].view(np.uint64)  # most of them are BACKGROUND, 0, as a whole
    others = 0
    for k in range(len(words)):
        others += words[k] != NO_BITS
    found = np.empty(8 * (others + 1), dtype=np.int32)
    count = 0
    for k in range(len(words) + 1):
        if k == len(words) or words[k] != NO_BITS:
            for i in range(8 * k, min(8 * k + 8, len(values))):
                if values[i] == UNSURE:
                    found[count] = i
                    count += 1
    places = np.zeros((count + 1, 2), dtype=np.int32)
    for k in range(count):
        places[k + 1, 0], places[k + 1, 1] = found[k] // width, found[k] % width
    return places


@finite_leaf_kernel
def _brightness(frame: Image, mean: Floats32, gain: Floats32, y: int, x: int) -> tuple[np.float32, np.float32]:
    """Sums of the channels of the frame and of the model, the latter at least 1."""
    total, model_total = np.float32(0), np.float32(0)
    for c in range(3):
        total += np.float32(frame[y, x, c])
        model_total += gain[c] * mean[y, x, c]
    return total, max(model_total, np.float32(1))


@finite_leaf_kernel
def _model_error(mean: Floats32, weight: Floats32, y: int, x: int) -> np.float32:
    """Contribution of the error of the model, half a sigma, to b * b."""
    variance, known = np.float32(0), np.float32(1)
    for c in range(3):
        variance += 1 / weight[y, x, c]
        known += mean[y, x, c]
    return np.float32(0.25 * 6) * variance / (known * known)
