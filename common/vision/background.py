"""Background models: what a camera sees when nobody is there, and how much each pixel of it varies.

A model is a value.  `learn`, `learn_median` and `from_image` make one; `update` follows slow changes of the light and
`gains` measures a quick one, such as flicker or automatic exposure, from one frame.
Frames are (height, width, 3) uint8 BGR.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import erf, exp, pi, sqrt

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Mask = NDArray[np.uint8]
Levels = NDArray[np.float32]

LARGEST_SCALING = 0.02  # by which a plate's size may differ from the frames'
SIGMA_FLOOR = 0.5  # grey levels: rounding to whole ones (0.29) and what a short learning time did not show
SHARED = 0.7  # of the typical sigma is the least any pixel gets: short samples and video codecs show some as noiseless
UNEVEN = 0.01  # share of a pixel's brightness by which light and exposure vary unevenly after the gain is measured
STEADY_PX = 0.1  # by how much a fixed camera's image is taken to shake
TRIM, TRIMMED_Z = 0.6, 0.8416212  # the share of the smallest deviations that is kept; the z with P(|Z| < z) = TRIM
GAIN_SAMPLES = 1500
GAIN_RANGE = (0.5, 2.0)


@dataclass(frozen=True)
class Background:
    """mean: (height, width, 3) grey levels.  weight: (height, width, 3) 1 / sigma², sigma the noise in grey levels."""

    mean: Levels
    weight: Levels

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) px."""
        return self.mean.shape[1], self.mean.shape[0]

    def sigma(self) -> Levels:
        """Noise of every pixel and channel, (height, width, 3) grey levels."""
        return np.asarray(1 / np.sqrt(self.weight), dtype=np.float32)


def learn(frames: Sequence[Image]) -> Background:
    """Mean and spread of frames of the empty scene; ValueError for none or for differing shapes."""
    shape = _common_shape(frames)
    mean = np.zeros(shape, dtype=np.float32)
    for frame in frames:
        cv2.accumulate(frame, mean)
    mean /= len(frames)
    spread = np.zeros(shape, dtype=np.float32)
    for frame in frames:
        spread += np.abs(frame - mean)
    spread *= sqrt(pi / 2) / len(frames)  # mean absolute deviation of a normal distribution to its sigma
    if len(frames) > 1:
        spread *= sqrt(len(frames) / (len(frames) - 1))
    return _background(mean, spread, STEADY_PX)


def learn_median(frames: Sequence[Image]) -> Background:
    """Median and trimmed spread of frames in which people may pass, as long as each pixel is mostly empty."""
    shape = _common_shape(frames)
    mean = np.empty(shape, dtype=np.float32)
    spread = np.empty(shape, dtype=np.float32)
    for row in range(shape[0]):  # row by row, to bound the memory
        values = np.stack([frame[row] for frame in frames]).astype(np.float32)
        middle = np.median(values, axis=0)
        spread[row] = _trimmed_sigma(np.abs(values - middle), axis=0)
        near = np.abs(values - middle) <= 2 * spread[row] + 1  # the median alone is a whole grey level
        mean[row] = np.sum(values * near, axis=0) / np.maximum(np.sum(near, axis=0), 1)
    return _background(mean, spread, STEADY_PX)


def from_image(image: Image, frames: Sequence[Image]) -> Background:
    """A plate photographed earlier; its noise and its misfit at edges are estimated from its residual to `frames`.

    The frames may have a person in them and decide the size.  The plate's global exposure is brought to theirs.
    Raises ValueError for no frames, or when the plate's size differs from theirs by more than 2 %.
    """
    height, width, _ = _common_shape(frames)
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        raise ValueError(f"background image: shape {image.shape} {image.dtype}; (height, width, 3) uint8 is needed")
    change = max(abs(image.shape[1] / width - 1), abs(image.shape[0] / height - 1))
    if change > LARGEST_SCALING:
        raise ValueError(
            f"background image: size {image.shape[1]}x{image.shape[0]} against frames of {width}x{height};"
            f" they may differ by at most {LARGEST_SCALING:.0%}"
        )
    if change > 0:
        image = np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
    plate = _background(image.astype(np.float32), np.ones(image.shape, dtype=np.float32), 0.0)
    gain = np.median([gains(plate, frame) for frame in frames], axis=0).astype(np.float32)
    mean = plate.mean * gain
    edges = _gradient(mean)
    residual = np.abs(np.stack(list(frames)) - mean)
    flat, steep = np.quantile(edges, (0.5, 0.9))
    on_flat = np.where(edges <= flat, residual, np.nan).reshape(-1)
    sigma = float(_trimmed_sigma(on_flat[np.isfinite(on_flat)], axis=0))
    steep_places = edges >= max(steep, 1.0)
    shift = np.where(steep_places, residual / np.maximum(edges, 1), np.nan).reshape(-1)
    shift = shift[np.isfinite(shift)]
    misfit_px = STEADY_PX
    if shift.size:  # what the noise alone does not explain
        by_noise = sigma**2 * float(np.median(1 / edges[steep_places] ** 2))
        misfit_px = max(STEADY_PX, sqrt(max(0.0, float(_trimmed_sigma(shift, axis=0)) ** 2 - by_noise)))
    return _background(mean, np.full(mean.shape, sigma, dtype=np.float32), misfit_px)


def gains(background: Background, frame: Image, person: Mask | None = None) -> Levels:
    """How much brighter the frame is than the model, (3,) per channel: the median ratio of a grid of pixels.

    Pixels in `person` and those too dark or too bright for a ratio are left out; 1 when fewer than a tenth remain.
    """
    _require_size(background, frame)
    step = max(1, int(sqrt(background.mean.shape[0] * background.mean.shape[1] / GAIN_SAMPLES)))
    nobody = np.zeros((0, 0), dtype=np.uint8)
    ratios, sampled = _ratios(background.mean, frame, nobody if person is None else person, step)
    if len(ratios) < sampled // 10 or len(ratios) == 0:
        return np.ones(3, dtype=np.float32)
    middle = len(ratios) // 2
    median = np.partition(ratios, middle, axis=0)[middle]
    return np.asarray(np.clip(median, *GAIN_RANGE), dtype=np.float32)


@njit(cache=True, error_model="numpy")
def _ratios(mean: Levels, frame: Image, person: Mask, step: int) -> tuple[Levels, int]:
    """frame / mean, (n, 3), of every `step`-th row and column where it can be told, and how many there are."""
    height, width = frame.shape[:2]
    ratios = np.empty(((height // step + 1) * (width // step + 1), 3), dtype=np.float32)
    count, sampled = 0, 0
    for y in range(step // 2, height, step):
        for x in range(step // 2, width, step):
            sampled += 1
            usable = person.size == 0 or person[y, x] == 0
            for c in range(3):
                usable = usable and 20 < mean[y, x, c] < 240 and 8 < frame[y, x, c] < 250
                ratios[count, c] = np.float32(frame[y, x, c]) / mean[y, x, c]
            count += usable
    return ratios[:count], sampled


def update(background: Background, frame: Image, person: Mask | None, rate: float = 0.02, margin_px: int = 0) -> Background:
    """The model moved towards the frame by `rate` in [0, 1] everywhere but on the person.

    person: (height, width) uint8, not 0 on the person; it is widened by margin_px, or 3 % of the image's height if
    that is 0, so that missed limbs and shadows do not burn in.  None updates everywhere.
    """
    _require_size(background, frame)
    if not 0 <= rate <= 1:
        raise ValueError(f"rate: {rate}; allowed 0 to 1")
    held = np.zeros(frame.shape[:2], dtype=np.uint8)
    if person is not None:
        margin = margin_px if margin_px > 0 else max(2, round(0.03 * frame.shape[0]))
        held = np.asarray(cv2.dilate(person, np.ones((2 * margin + 1, 2 * margin + 1), np.uint8)), dtype=np.uint8)
    return replace(background, mean=_moved(background.mean, frame, held, np.float32(rate)))


@njit(cache=True, error_model="numpy")
def _moved(mean: Levels, frame: Image, held: Mask, rate: np.float32) -> Levels:
    out = np.empty_like(mean)
    for y in range(mean.shape[0]):
        for x in range(mean.shape[1]):
            step = rate if held[y, x] == 0 else np.float32(0)
            for c in range(3):
                out[y, x, c] = mean[y, x, c] + step * (np.float32(frame[y, x, c]) - mean[y, x, c])
    return out


def _background(mean: Levels, spread: Levels, shake_px: float) -> Background:
    """The variance is the pixel's own, bounded below, and that of an image shaken by `shake_px`."""
    typical = np.maximum(SIGMA_FLOOR, SHARED * np.median(spread, axis=(0, 1)))
    variance = np.maximum(spread, typical) ** 2 + (shake_px * _gradient(mean)) ** 2 + (UNEVEN * mean) ** 2
    return Background(np.ascontiguousarray(mean, dtype=np.float32), np.asarray(1 / variance, dtype=np.float32))


def _gradient(mean: Levels) -> Levels:
    """Steepest change over one pixel, (height, width, 3) grey levels."""
    kernel = np.ones((3, 3), np.uint8)
    change = cv2.morphologyEx(mean, cv2.MORPH_GRADIENT, kernel)
    return np.asarray(change / 2, dtype=np.float32)


def _trimmed_sigma(deviations: NDArray[np.floating], axis: int) -> Levels:
    """Sigma from the smallest absolute deviations, blind to the largest 40 %."""
    keep = max(1, round(TRIM * deviations.shape[axis]))
    smallest = np.partition(deviations, keep - 1, axis=axis)[:keep]
    density = (1 - exp(-(TRIMMED_Z**2) / 2)) * 2 / sqrt(2 * pi)
    return np.asarray(smallest.mean(axis=axis) * erf(TRIMMED_Z / sqrt(2)) / density, dtype=np.float32)


def _common_shape(frames: Sequence[Image]) -> tuple[int, int, int]:
    if len(frames) == 0:
        raise ValueError("background: 0 frames; at least 1 is needed")
    shapes = {frame.shape for frame in frames}
    if len(shapes) > 1 or frames[0].ndim != 3 or frames[0].shape[2] != 3:
        raise ValueError(f"background: frames of shapes {sorted(shapes)}; one (height, width, 3) is needed")
    height, width, _ = frames[0].shape
    return height, width, 3


def _require_size(background: Background, frame: Image) -> None:
    if frame.shape != background.mean.shape:
        raise ValueError(f"frame: shape {frame.shape}; the background's is {background.mean.shape}")
