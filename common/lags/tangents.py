"""Tangent planes of silhouettes about the baseline of two cameras, and the lag of best agreement.

The two planes through the centres of two cameras that touch the person touch the silhouettes of both views: at equal times
their angles about the baseline are equal (frontier points).  [Sinha & Pollefeys 2010, Camera network calibration and
synchronization from silhouettes in archived video.]  Here the cameras are calibrated, so that the angles are known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter

from zenocap.common.arrays import Bools, Floats, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import Curve, Lag, Limits, jackknife_error

# Chosen on simulated people (`python -m benchmarks sync`) unless another source is given.
NOISE_PX = 1.0  # of a tangent in each view
PAIR_PX = 2**0.5 * NOISE_PX  # of a difference of two views
BIAS_NOISES = 1.5  # standard deviation of the constant difference of a pair's angles, in `noise` of the pair
SMOOTHING_S = 0.03  # standard deviation of the kernel over time
STEP_S = 1 / 120  # of the resampled angles; a quarter of a frame period at 30 frames/s
COARSE_STEPS = 3  # steps between lags of the search
LEAST_COMMON_S = 0.8  # seen by both cameras at a lag, below which it has no evidence; chosen by hand
PER_S = 4.0  # independent samples of the motion per second
SAMPLES = 40  # of each view, for the expected disagreement of unrelated times
WIDEST_RAD = 1.5  # of a silhouette about the baseline; wider ones contain the epipole or are no person
LEAST_DISTANCE_M = 1.0  # of the person from the baseline; nearer, the angles are undefined
SLOW_S = 0.5  # standard deviation of the moving mean that is taken off for the refinement; of 0.25, 0.5, 1 the best
BLOCK_S, ITERATIONS = 0.5, 12  # of the refinement: blocks of the jackknife, and Gauss-Newton steps
PIXEL_EDGES = 0.5 * np.array([(-1, 0), (1, 0), (0, -1), (0, 1)])  # px, from a pixel's centre
ERROR_FACTOR = 1.5  # of the jackknife's standard error; errors of simulated people are that much larger
# Unrelated videos of 92 pairs of simulated people had margins up to 3.0, wrong lags of gait up to 4.6;
# lags with errors above 0.01 s were up to half a frame period off.
SILHOUETTE_LIMITS = Limits(margin=7.0, ratio=1.2, apart_s=0.25, error_s=0.01)


@dataclass(frozen=True)
class Outline:
    """Convex hull of a silhouette.  rays: (n, 3) unit vectors, world.  cut: (n,) whether it is at the image's border."""

    time_s: float
    rays: Floats
    cut: Bools


def outline_of(camera: Camera, mask: Mask, time_s: float) -> Outline | None:
    """Outline of a silhouette (height, width); None of an empty one.  time_s: from the beginning of the video."""
    contours, _ = cv2.findContours((mask != 0).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    centres = cv2.convexHull(np.concatenate(contours)).reshape(-1, 1, 2)
    hull = cv2.convexHull((centres + PIXEL_EDGES).reshape(-1, 1, 2).astype(np.float32)).reshape(-1, 2).astype(np.float64)
    local = cv2.undistortPoints(hull[:, None], camera.matrix, camera.distortions).reshape(-1, 2)
    rays = np.column_stack([local, np.ones(len(local))]) @ camera.rotation
    width, height = camera.size
    cut = (hull.min(axis=1) < 1) | (hull[:, 0] > width - 2) | (hull[:, 1] > height - 2)
    return Outline(time_s, rays / np.linalg.norm(rays, axis=1, keepdims=True), cut)


@dataclass(frozen=True)
class Baseline:
    """Line through two cameras.  axis: along it; ahead: to the scene; side: across both; unit vectors (3,)."""

    axis: Floats
    ahead: Floats
    side: Floats

    def angles(self, rays: Floats) -> Floats:
        """Angle of each ray's (n, 3) plane about the baseline, radians, 0 at the scene."""
        return np.arctan2(rays @ self.side, rays @ self.ahead)


def baseline_of(one: Camera, other: Camera, scene: Floats) -> Baseline | None:
    """Baseline of two cameras; None where the scene (3,), metres, is on it."""
    axis = other.centre - one.centre
    length = float(np.linalg.norm(axis))
    if length < LEAST_DISTANCE_M:
        return None
    axis = axis / length
    across = scene - one.centre
    across = across - (across @ axis) * axis
    if float(np.linalg.norm(across)) < LEAST_DISTANCE_M:
        return None
    ahead = across / np.linalg.norm(across)
    return Baseline(axis, ahead, np.cross(axis, ahead))


def scene_centre(cameras: Sequence[Camera], outlines: Sequence[Sequence[Outline]]) -> Floats:
    """Point (3,), metres, nearest to the median viewing ray of the person of every camera."""
    normal, target = 1e-9 * np.eye(3), np.zeros(3)
    for camera, seen in zip(cameras, outlines, strict=True):
        if seen:
            ray = np.median([one.rays.mean(axis=0) for one in seen], axis=0)
            ray /= np.linalg.norm(ray)
            across = np.eye(3) - np.outer(ray, ray)
            normal += across
            target += across @ camera.centre
    return np.asarray(np.linalg.solve(normal, target))


@dataclass(frozen=True)
class Tangents:
    """Tangent planes of n silhouettes.  times: (n,) s.  angles: (n, 2) rad, NaN where the silhouette is cut there.

    rays: (n, 2, 3) that touch.  sines: (n,) of the angle of the first of them to the baseline.
    """

    times: Floats
    angles: Floats
    rays: Floats
    sines: Floats

    def noise(self, pixel_rad: float) -> float:
        """Standard deviation of an angle, rad.  pixel_rad: angle of a pixel."""
        return NOISE_PX * pixel_rad / max(0.05, float(np.median(self.sines))) if len(self.sines) else np.nan


def tangents(outlines: Sequence[Outline], baseline: Baseline) -> Tangents:
    """Both tangent planes of each silhouette; those that are too wide are left out."""
    times, angles, rays, sines = [], [], [], []
    for outline in outlines:
        values = baseline.angles(outline.rays)
        ends = int(np.argmin(values)), int(np.argmax(values))
        if values[ends[1]] - values[ends[0]] > WIDEST_RAD:
            continue
        times.append(outline.time_s)
        angles.append([np.nan if outline.cut[k] else values[k] for k in ends])
        rays.append(outline.rays[list(ends)])
        sines.append(float(np.linalg.norm(np.cross(outline.rays[ends[0]], baseline.axis))))
    return Tangents(np.array(times), np.array(angles).reshape(-1, 2), np.array(rays).reshape(-1, 2, 3), np.array(sines))


def resampled(times: Floats, values: Floats, gap_s: float) -> Floats:
    """Smoothed values (n,) on a grid of STEP_S from time 0 on; NaN farther than `gap_s` from the next sample."""
    good = np.isfinite(values)
    times, values = times[good], values[good]
    if len(times) < 3:
        return np.full(1, np.nan)
    values = median_filter(values, 3, mode="nearest")
    grid = np.arange(int(times[-1] / STEP_S) + 1) * STEP_S
    after = np.clip(np.searchsorted(times, grid), 1, len(times) - 1)
    known = (grid >= times[0]) & (np.minimum(grid - times[after - 1], times[after] - grid) <= gap_s)
    known &= times[after] - times[after - 1] <= 2.5 * gap_s
    weight = gaussian_filter1d(known.astype(np.float64), SMOOTHING_S / STEP_S, mode="constant")
    smooth = gaussian_filter1d(np.where(known, np.interp(grid, times, values), 0.0), SMOOTHING_S / STEP_S, mode="constant")
    return np.where(known & (weight > 0.5), smooth / np.maximum(weight, 1e-9), np.nan)


@dataclass(frozen=True)
class Refinement:
    """Least squares of a lag.  steps: done.  lag: once it has ended; None where the two have too little in common."""

    lag_s: float
    steps: int = 0
    ended: bool = False
    lag: Lag | None = None


@dataclass(frozen=True)
class SilhouettePair:
    """Tangent angles of two cameras about their baseline, each (2, n) on a grid of STEP_S from its video's beginning.

    noise: of a difference of two angles, rad.  max_lag_s: range of the search.
    """

    one: Floats
    other: Floats
    noise: float
    max_lag_s: float

    @cached_property
    def curve(self) -> Curve:
        """Evidence of each lag: likelihood ratio (nats) of equal angles to angles of unrelated times."""
        return Curve(STEP_S * COARSE_STEPS, np.array(self.evidence(0, self.lags)))

    @property
    def lags(self) -> int:
        """Number of lags of the curve."""
        return 2 * int(self.max_lag_s / (STEP_S * COARSE_STEPS)) + 1

    def evidence(self, first: int, last: int) -> list[float]:
        """Values of the curve from index `first` to before `last`."""
        half = self.lags // 2
        return [self._evidence((k - half) * COARSE_STEPS) for k in range(first, min(last, self.lags))]

    def _evidence(self, steps: int) -> float:
        total = 0.0
        for one, other in zip(self.one, self.other, strict=True):
            a, b = _overlap(one, other, steps)
            a, b = a[::COARSE_STEPS], b[::COARSE_STEPS]
            both = np.isfinite(a) & np.isfinite(b)
            common_s = np.count_nonzero(both) * STEP_S * COARSE_STEPS
            if common_s < LEAST_COMMON_S:
                continue
            a, b = a[both], b[both]
            agreement = self._loss(a - b)
            few = np.linspace(0, len(a) - 1, min(len(a), SAMPLES)).astype(int)
            unrelated = self._loss((a[few][:, None] - b[few][None]).ravel())
            total += 0.5 * common_s * PER_S * (unrelated - agreement)
        return total

    def _loss(self, differences: Floats) -> float:
        """Mean of log(1 + r^2) of differences without their median, as far as that may be a constant error."""
        bias = float(np.clip(np.median(differences), -2 * BIAS_NOISES * self.noise, 2 * BIAS_NOISES * self.noise))
        return float(np.mean(np.log1p(((differences - bias) / self.noise) ** 2)))

    def refined(self, lag_s: float) -> Lag | None:
        """Lag by robust least squares with a constant difference of each angle; its error by a jackknife over blocks."""
        return self.refine(Refinement(lag_s), ITERATIONS).lag

    def refine(self, refinement: "Refinement", steps: int) -> "Refinement":
        """So many steps more of the least squares."""
        lag_s, terms, last = refinement.lag_s, None, min(ITERATIONS, refinement.steps + steps)
        for _ in range(refinement.steps, last):
            terms = self._normal_equations(lag_s)
            if terms is None:
                return Refinement(lag_s, last, ended=True)
            step = _solved(terms.sum(axis=0))
            lag_s += float(np.clip(step, -0.1, 0.1))
            if abs(step) < 1e-5:
                last = ITERATIONS
                break
        if terms is None or last < ITERATIONS:
            return Refinement(lag_s, last)
        return Refinement(lag_s, last, ended=True, lag=self._with_error(lag_s, terms))

    def _with_error(self, lag_s: float, terms: Floats) -> Lag | None:
        whole = terms.sum(axis=0)
        if len(terms) < 3:
            return None
        left_out = np.array([_solved(whole - block) for block in terms])
        error_s = float(jackknife_error(left_out - left_out.mean()))
        return Lag(lag_s, max(ERROR_FACTOR * error_s, 1e-4), self._residual(lag_s))

    def _normal_equations(self, lag_s: float) -> Floats | None:
        """(blocks, 3, 4): normal matrix and right side of lag and both constants, by block of time."""
        steps, rest = int(np.floor(lag_s / STEP_S)), lag_s / STEP_S - np.floor(lag_s / STEP_S)
        blocks: dict[int, Floats] = {}
        per_block = round(BLOCK_S / STEP_S)
        for k, (one, other) in enumerate(zip(self.one, self.other, strict=True)):
            a, b = _overlap(one, _moved(other, rest), steps)
            slope = (np.gradient(a) + np.gradient(b)) / (2 * STEP_S) if len(a) > 2 else np.zeros(len(a))
            residual = a - b
            slope, residual = _without_slow(slope), _without_slow(residual)
            good = np.flatnonzero(np.isfinite(residual) & np.isfinite(slope))
            if len(good) * STEP_S < LEAST_COMMON_S:
                continue
            bias = np.clip(np.median(residual[good]), -2 * BIAS_NOISES * self.noise, 2 * BIAS_NOISES * self.noise)
            weight = 1.0 / (1.0 + ((residual[good] - bias) / (2 * self.noise)) ** 2)
            rows = np.zeros((len(good), 4))
            # b(t - lag): a later lag takes earlier angles.
            rows[:, 0], rows[:, 1 + k], rows[:, 3] = -slope[good], 1.0, residual[good]
            for block in np.unique(good // per_block):
                part = good // per_block == block
                normal = rows[part, :3].T @ (weight[part, None] * rows[part])
                blocks[block] = blocks.get(block, np.zeros((3, 4))) + normal * STEP_S * PER_S / self.noise**2
        if not blocks:
            return None
        prior = np.diag([0.0, 1.0, 1.0]) / (BIAS_NOISES * self.noise) ** 2 / len(blocks)
        return np.stack([one + np.column_stack([prior, np.zeros(3)]) for one in blocks.values()])

    def _residual(self, lag_s: float) -> float:
        """Median distance of the angles, px."""
        found = []
        for one, other in zip(self.one, self.other, strict=True):
            a, b = _overlap(one, other, round(lag_s / STEP_S))
            difference = (a - b)[np.isfinite(a - b)]
            if len(difference):
                found.append(float(np.median(np.abs(difference - np.median(difference)))) / self.noise * PAIR_PX)
        return float(np.mean(found)) if found else float("nan")


def _overlap(one: Floats, other: Floats, steps: int) -> tuple[Floats, Floats]:
    """Parts of two signals that overlap when one[i] = other[i - steps]."""
    first, last = max(0, steps), min(len(one), len(other) + steps)
    return (one[first:last], other[first - steps : last - steps]) if last > first else (one[:0], other[:0])


def _without_slow(values: Floats) -> Floats:
    """Signal (n,) less its mean over about SLOW_S: shadows and the edges of silhouettes are errors that vary slowly."""
    known = np.isfinite(values)
    weight = gaussian_filter1d(known.astype(np.float64), SLOW_S / STEP_S, mode="constant")
    slow = gaussian_filter1d(np.where(known, values, 0.0), SLOW_S / STEP_S, mode="constant") / np.maximum(weight, 1e-9)
    return np.asarray(values - slow)


def _moved(values: Floats, part: float) -> Floats:
    """Signal at part of a step earlier: values[i - part], linear; smoothing makes that exact enough."""
    return values if part == 0 else np.concatenate([values[:1], (1 - part) * values[1:] + part * values[:-1]])


def _solved(terms: Floats) -> float:
    """First unknown of normal equations (3, 4)."""
    return float(np.linalg.lstsq(terms[:, :3] + 1e-12 * np.eye(3), terms[:, 3], rcond=None)[0][0])


def silhouette_pairs(
    cameras: Mapping[str, Camera], outlines: Mapping[str, Sequence[Outline]], max_lag_s: float
) -> dict[tuple[str, str], SilhouettePair]:
    """Comparison of all pairs of cameras that see a person and whose baseline does not meet them."""
    names = [name for name in cameras if len(outlines[name]) > 2]
    if len(names) < 2:
        return {}
    scene = scene_centre([cameras[name] for name in names], [outlines[name] for name in names])
    pairs = {}
    for k, a in enumerate(names):
        for b in names[k + 1 :]:
            baseline = baseline_of(cameras[a], cameras[b], scene)
            if baseline is None:
                continue
            found = [tangents(outlines[name], baseline) for name in (a, b)]
            pair = pair_of((cameras[a], cameras[b]), found, max_lag_s)
            if pair is not None:
                pairs[a, b] = pair
    return pairs


def pair_of(cameras: Sequence[Camera], found: Sequence[Tangents], max_lag_s: float) -> SilhouettePair | None:
    """Pair of two cameras from the tangents of each; None where one has too few."""
    signals, noises = [], []
    for camera, one in zip(cameras, found, strict=True):
        if len(one.times) < 3:
            return None
        gap_s = 1.6 * float(np.median(np.diff(one.times)))
        both = [resampled(one.times, one.angles[:, side], gap_s) for side in (0, 1)]
        length = max(map(len, both))
        padded = [np.pad(signal, (0, length - len(signal)), constant_values=np.nan) for signal in both]
        signals.append(np.stack(padded))
        noises.append(one.noise(2.0 / float(camera.matrix[0, 0] + camera.matrix[1, 1])))
    return SilhouettePair(signals[0], signals[1], float(np.linalg.norm(noises)), max_lag_s)
