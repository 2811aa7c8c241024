"""Background models: mean and noise of every pixel of the empty scene.

A model is immutable.  `learn`, `learn_median` and `from_image` create one; `update` adapts it to slow changes of the light;
`gains` measures fast ones, such as flicker or automatic exposure, in a single frame.
Frames are (height, width, 3) uint8 BGR.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import erf, exp, pi, sqrt
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from zenocap.common.arrays import Floats32, Image, Mask
from zenocap.common.jit import finite_kernel, kernel

LARGEST_SCALING = 0.02  # relative size difference of a background image and the frames; chosen by hand
SIGMA_FLOOR = 0.5  # grey levels, smallest noise: rounding is 0.29, the rest for short learning times; chosen by hand
SIGMA_SHARE = 0.7  # of the median noise, smallest noise of a pixel: short samples and codecs hide noise; chosen by hand
UNEVEN_LIGHT = 0.01  # of the brightness, variation of light and exposure that the gain does not explain; chosen by hand
SHAKE_PX = 0.1  # px, shake of the image of a fixed camera; chosen by hand
TRIM, TRIMMED_Z = 0.6, 0.8416212  # share of the smallest deviations that is kept; z with P(|Z| < z) = TRIM
GAIN_SAMPLES = 1500  # pixels on which the gain is measured; chosen by hand
GAIN_RANGE = (0.5, 2.0)  # of the gain; chosen by hand
LIMIT_GAIN = 0.005  # change of the gain for which limits hold, of no effect on results; measured on rendered and real video
LIMIT_SLACK = 1e-3  # share of the squared distance for rounding in the exact test, whose float32 sums are good to 1e-4


class LevelLimits(NamedTuple):
    """Grey levels between which all channels of a pixel are less than `sigmas` from the model in all.

    low, high: (height, width, 3) uint8, inclusive.  gain: (3,) at which they hold, within LIMIT_GAIN.
    """

    low: Image
    high: Image
    gain: Floats32
    sigmas: float


@dataclass(frozen=True)
class Background:
    """Background model.

    mean: (height, width, 3) grey levels.  weight: (height, width, 3) 1 / sigma², sigma: noise in grey levels.
    halo: noise around the person in units of the model's, which compression makes larger than 1.
    Who changes the mean in place goes on with a copy of this object, `replace(background)`, which has no limits yet.
    """

    mean: Floats32
    weight: Floats32
    halo: float = 1.0
    _limits: list[LevelLimits] = field(default_factory=list, init=False, repr=False, compare=False)

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) px."""
        return self.mean.shape[1], self.mean.shape[0]

    def limits(self, gain: Floats32, sigmas: float) -> LevelLimits:
        """Limits that hold at this gain (3,) and distance; the last ones are kept."""
        kept = self._limits
        if not kept or kept[0].sigmas != sigmas or np.abs(gain - kept[0].gain).max() >= LIMIT_GAIN:
            share = np.float32(sigmas**2 / 3 * (1 - LIMIT_SLACK))
            kept[:] = [LevelLimits(*_limits(self.mean, self.weight, gain, share), gain, sigmas)]
        return kept[0]

    @property
    def room(self) -> "Background":
        """Mean and noise of the empty room: the model itself."""
        return self

    @cached_property
    def noise(self) -> float:
        """Median noise of a channel, grey levels; of every eighth pixel."""
        return float(np.median(1 / np.sqrt(self.weight[::8, ::8])))

    def sigma(self) -> Floats32:
        """Noise of every pixel and channel, (height, width, 3) grey levels."""
        return np.asarray(1 / np.sqrt(self.weight), dtype=np.float32)


def learn(frames: Sequence[Image]) -> Background:
    """Model of the mean and noise of frames of the empty scene.  Raises ValueError for none or for differing shapes."""
    shape = _common_shape(frames)
    mean = np.zeros(shape, dtype=np.float32)
    for frame in frames:
        cv2.accumulate(frame, mean)
    mean /= len(frames)
    spread = np.zeros(shape, dtype=np.float32)
    deviation = np.empty(shape, dtype=np.float32)  # one array for all frames: new ones would be mapped page by page
    for frame in frames:
        np.subtract(frame, mean, out=deviation)
        np.abs(deviation, out=deviation)
        spread += deviation
    spread *= sqrt(pi / 2) / len(frames)  # mean absolute deviation of a normal distribution to its sigma
    if len(frames) > 1:
        spread *= sqrt(len(frames) / (len(frames) - 1))
    return _background(mean, spread, SHAKE_PX)


def learn_median(frames: Sequence[Image]) -> Background:
    """Model of the median and trimmed noise of frames in which people pass; each pixel must be empty most of the time."""
    shape = _common_shape(frames)
    mean = np.empty(shape, dtype=np.float32)
    spread = np.empty(shape, dtype=np.float32)
    for row in range(shape[0]):  # row by row to limit memory
        values = np.stack([frame[row] for frame in frames]).astype(np.float32)
        middle = np.median(values, axis=0)
        spread[row] = _trimmed_sigma(np.abs(values - middle), axis=0)
        near = np.abs(values - middle) <= 2 * spread[row] + 1  # the median alone is an integer grey level
        mean[row] = np.sum(values * near, axis=0) / np.maximum(np.sum(near, axis=0), 1)
    return _background(mean, spread, SHAKE_PX)


def from_image(image: Image, frames: Sequence[Image]) -> Background:
    """Model of an image of the empty scene taken earlier.

    Noise and misalignment at edges are estimated from its residual to `frames`, which may show a person; the image is
    brought to their size and global exposure.  Raises ValueError for no frames or a size that differs by more than 2 %.
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
    misfit_px = SHAKE_PX
    if shift.size:  # beyond the noise
        by_noise = sigma**2 * float(np.median(1 / edges[steep_places] ** 2))
        misfit_px = max(SHAKE_PX, sqrt(max(0.0, float(_trimmed_sigma(shift, axis=0)) ** 2 - by_noise)))
    return _background(mean, np.full(mean.shape, sigma, dtype=np.float32), misfit_px)


def gains(background: Background, frame: Image, person: Mask | None = None) -> Floats32:
    """Gain (3,) per channel of the frame relative to the model: median ratio on a grid of pixels.

    Without the pixels in `person` and those too dark or too bright for a ratio; 1 when fewer than a tenth remain.
    """
    _require_size(background, frame)
    step = max(1, int(sqrt(background.mean.shape[0] * background.mean.shape[1] / GAIN_SAMPLES)))
    empty = np.zeros((0, 0), dtype=np.uint8)
    ratios, sampled = _ratios(background.mean, frame, empty if person is None else person, step)
    if len(ratios) < sampled // 10 or len(ratios) == 0:
        return np.ones(3, dtype=np.float32)
    middle = len(ratios) // 2
    median = np.partition(ratios, middle, axis=0)[middle]
    return np.asarray(np.clip(median, *GAIN_RANGE), dtype=np.float32)


@kernel
def _ratios(mean: Floats32, frame: Image, person: Mask, step: int) -> tuple[Floats32, int]:
    """frame / mean (n, 3) of every `step`-th row and column where it is defined, and the number of sampled pixels."""
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


def gain_and_limits(background: Background, frame: Image, sigmas: float, *, flicker: bool) -> tuple[Floats32, LevelLimits]:
    """Gain (3,) by which the model is multiplied for the comparison with a frame, and the limits at it.

    flicker: whether the gain is measured; else it is 1.  Raises ValueError for another shape.
    """
    _require_size(background, frame)
    gain = gains(background, frame) if flicker else np.ones(3, dtype=np.float32)
    return gain, background.limits(gain, sigmas)


def update(background: Background, frame: Image, person: Mask | None, rate: float = 0.02, margin_px: int = 0) -> Background:
    """Model moved towards the frame by `rate` in [0, 1] except on the person.

    person: (height, width), not 0 on the person, or None; widened by margin_px, 3 % of the image height if that is 0, so
    that missed limbs and shadows are not learnt.
    """
    _require_size(background, frame)
    if not 0 <= rate <= 1:
        raise ValueError(f"rate: {rate}; allowed 0 to 1")
    held = np.zeros(frame.shape[:2], dtype=np.uint8)
    if person is not None:
        margin = margin_px if margin_px > 0 else max(2, round(0.03 * frame.shape[0]))
        held = np.asarray(cv2.dilate(person, np.ones((2 * margin + 1, 2 * margin + 1), np.uint8)), dtype=np.uint8)
    return replace(background, mean=_moved(background.mean, frame, held, np.float32(rate)))


@kernel
def _moved(mean: Floats32, frame: Image, held: Mask, rate: np.float32) -> Floats32:
    out = np.empty_like(mean)
    for y in range(mean.shape[0]):
        for x in range(mean.shape[1]):
            step = rate if held[y, x] == 0 else np.float32(0)
            for c in range(3):
                out[y, x, c] = mean[y, x, c] + step * (np.float32(frame[y, x, c]) - mean[y, x, c])
    return out


@finite_kernel
def _limits(mean: Floats32, weight: Floats32, gain: Floats32, share: np.float32) -> tuple[Image, Image]:
    """low, high of `LevelLimits`; share: of the squared distance for each channel.  low > high where no level is near."""
    height, width = mean.shape[:2]
    low, high = np.empty(mean.shape, dtype=np.uint8), np.empty(mean.shape, dtype=np.uint8)
    least, most = np.empty(3 * width, dtype=np.float32), np.empty(3 * width, dtype=np.float32)
    for k in range(3 * width):
        least[k], most[k] = gain[k % 3] - np.float32(LIMIT_GAIN), gain[k % 3] + np.float32(LIMIT_GAIN)
    for y in range(height):
        middle, precision = mean[y].reshape(-1), weight[y].reshape(-1)
        low_row, high_row = low[y].reshape(-1), high[y].reshape(-1)
        for k in range(3 * width):
            reach = np.sqrt(share / precision[k])
            lowest, highest = np.ceil(most[k] * middle[k] - reach), np.floor(least[k] * middle[k] + reach)
            none = (lowest > np.float32(255)) | (highest < np.float32(0))
            lowest = np.float32(255) if none else max(lowest, np.float32(0))
            highest = np.float32(0) if none else min(highest, np.float32(255))
            low_row[k], high_row[k] = np.uint8(np.int32(lowest)), np.uint8(np.int32(highest))
    return low, high


def _background(mean: Floats32, spread: Floats32, shake_px: float) -> Background:
    """Model with the variance of each pixel, bounded below, plus that of an image shaken by `shake_px`."""
    typical = np.maximum(SIGMA_FLOOR, SIGMA_SHARE * np.median(spread, axis=(0, 1)))
    variance = np.maximum(spread, typical) ** 2 + (shake_px * _gradient(mean)) ** 2 + (UNEVEN_LIGHT * mean) ** 2
    return Background(np.ascontiguousarray(mean, dtype=np.float32), np.asarray(1 / variance, dtype=np.float32))


def _gradient(mean: Floats32) -> Floats32:
    """Largest change over one pixel, (height, width, 3) grey levels."""
    kernel = np.ones((3, 3), np.uint8)
    change = cv2.morphologyEx(mean, cv2.MORPH_GRADIENT, kernel)
    return np.asarray(change / 2, dtype=np.float32)


def _trimmed_sigma(deviations: NDArray[np.floating], axis: int) -> Floats32:
    """Standard deviation from the smallest absolute deviations, without the largest 40 %."""
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
