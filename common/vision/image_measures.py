"""Focus, exposure, noise and constancy of light, from the images of one camera.

All are of images (height, width, 3) uint8 and in levels of 255, unless they are relative.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image

LEAST_BRIGHTNESS_S = 3.0  # of images, for drift and flicker; by hand
FLICKER_S = 1.0  # changes of brightness slower than this are drift; by hand
BRIGHTNESS_GRID = (16, 12)  # cells across and down whose brightness is followed; by hand
SATURATED_LEVEL, BLACK_LEVEL = 250, 5  # of 255, from which a pixel has no detail left: at the ends of the range
NOISE_CELL_PX = 16  # side of the squares in which noise is measured; by hand
RANGE = (10.0, 245.0)  # mean level of a square whose noise is not cut off at the ends of the range; by hand
OFFSET = 2.0  # levels added before ratios, so that black does not divide; by hand
STEP = 2  # every second pixel in both directions suffices for a histogram
SMOOTHING = np.outer([1.0, 2.0, 1.0], [1.0, 2.0, 1.0]) / 16.0
LAPLACIAN = np.array([[0.0, 1.0, 0.0], [1.0, -4.0, 1.0], [0.0, 1.0, 0.0]])


def _noise_gain() -> float:
    """Variance of the smoothed Laplacian of white noise of variance 1: the sum of squares of the joint kernel."""
    kernel = np.zeros((5, 5))
    for (row, column), value in np.ndenumerate(LAPLACIAN):
        kernel[row : row + 3, column : column + 3] += value * SMOOTHING
    return float((kernel**2).sum())


NOISE_GAIN = _noise_gain()


@dataclass(frozen=True)
class Exposure:
    """mean: of the grey levels.  saturated, black: share of pixels with a colour at, or all colours near, an end."""

    mean: float
    saturated: float
    black: float


@dataclass(frozen=True)
class Light:
    """Changes of the brightness of the whole image.

    drift: from the first to the last third of the time, relative; flicker: standard deviation of changes faster than
    FLICKER_S, relative, the root mean square over the rows of cells.
    """

    drift: float
    flicker: float


def grey_of(image: Image) -> Image:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def focus(grey: Image, noise: float) -> float:
    """Variance of the smoothed Laplacian by the square of the mean level, without the share of noise; at least 0.

    noise: standard deviation.  Independent of the exposure, dependent on the scene: values compare only for one scene.
    Pertuz, Puig, Garcia 2013, Analysis of focus measure operators, LAPV; the noise is taken off here.
    """
    filtered = cv2.Laplacian(cv2.GaussianBlur(grey.astype(np.float32), (3, 3), 0), cv2.CV_32F, ksize=1)
    energy = float(filtered.var()) - NOISE_GAIN * noise**2
    return max(0.0, energy) / max(1.0, float(grey.mean())) ** 2


def exposure(image: Image) -> Exposure:
    sample = image[::STEP, ::STEP]
    highest = sample.max(axis=2)
    return Exposure(
        float(sample.mean()), float((highest >= SATURATED_LEVEL).mean()), float((highest <= BLACK_LEVEL).mean())
    )


def noise(earlier: Image, later: Image) -> float:
    """Standard deviation of the noise of one grey image, from two successive ones; NaN where all is dark or saturated.

    The difference of both has sqrt(2) times the noise.  Motion raises it in some squares of the image: the median of their
    standard deviations counts, so that less than half of the image may move.
    """
    side = NOISE_CELL_PX
    rows, columns = earlier.shape[0] // side * side, earlier.shape[1] // side * side
    if not rows or not columns or earlier.shape != later.shape:
        return float("nan")

    def squares(grey: Image) -> Floats:
        cut = grey[:rows, :columns].astype(np.float32).reshape(rows // side, side, columns // side, side)
        return np.asarray(cut.transpose(0, 2, 1, 3).reshape(-1, side * side))

    first, second = squares(earlier), squares(later)
    level = second.mean(axis=1)
    inside = (level > RANGE[0]) & (level < RANGE[1])
    if not inside.any():
        return float("nan")
    return float(np.median((second - first)[inside].std(axis=1)) / np.sqrt(2.0))


def cells_of(values: Image, grid: tuple[int, int]) -> Floats:
    """Mean levels (down, across) or (down, across, 3) of the cells of an image or of one of its channels."""
    small = cv2.resize(np.ascontiguousarray(values), grid, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float64)


def brightness(image: Image) -> Floats:
    """Mean levels (down, across) of the cells of an image, from every STEPth pixel."""
    return np.asarray(cells_of(image[::STEP, ::STEP], BRIGHTNESS_GRID).mean(axis=2))


def light(times_s: Sequence[float], cells: Sequence[Floats]) -> Light | None:
    """Drift and flicker of images by their times and cells; None for less than LEAST_BRIGHTNESS_S.

    In each row of cells the median over the columns counts, so that a person in a part of the image changes nothing; rows
    are kept apart because a rolling shutter turns the flicker of lamps into stripes.
    """
    if len(times_s) < 6 or times_s[-1] - times_s[0] < LEAST_BRIGHTNESS_S:
        return None
    times, levels = np.asarray(times_s), np.log(np.stack(cells) + OFFSET)
    rows = np.median(levels - np.median(levels, axis=0), axis=2)  # (images, rows), relative
    third = (times[-1] - times[0]) / 3.0
    whole = np.median(rows, axis=1)
    early, late = whole[times <= times[0] + third], whole[times >= times[-1] - third]
    begins = np.searchsorted(times, times - FLICKER_S / 2.0)
    ends = np.searchsorted(times, times + FLICKER_S / 2.0, side="right")
    sums = np.concatenate([np.zeros((1, rows.shape[1])), rows.cumsum(axis=0)])
    fast = rows - (sums[ends] - sums[begins]) / (ends - begins)[:, None]
    return Light(float(np.median(late) - np.median(early)), float(np.sqrt((fast**2).mean())))
