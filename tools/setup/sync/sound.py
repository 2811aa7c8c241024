"""Lags of videos from their sound: generalized cross-correlation with phase transform (GCC-PHAT).

[Knapp & Carter 1976, The generalized correlation method for estimation of time delay.]  The phases alone are compared, so
gain and frequency response of the microphones hardly matter.  Sound takes 3 ms per metre: lags are wrong by that for each
metre by which one camera is farther from the source than the other.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import chain, takewhile
from pathlib import Path

import av
import numpy as np
from av.error import FFmpegError

from zenocap.common.arrays import Floats
from zenocap.common.errors import OpenError
from zenocap.common.lags.pairs import Curve, Lag, Limits
from zenocap.common.video.reader import VideoReader, until_cut

RATE = 8000  # samples/s
BAND_HZ = (150.0, 3600.0)  # without hum of the mains and what 8000 samples/s cut off; chosen by hand
BIN_S = 0.004  # step of the coarse curve
NEAR_S = 0.012  # half the width in which the exact peak is looked for
WINDOWS, WINDOW_S = 6, 4.0  # windows in which the lag is found again, and their least length
SILENT = 1e-5  # RMS of full scale, below which a track is silent
GAP_S = 0.02  # difference of a time stamp from the samples so far, from which it is obeyed
WINDOW_Z = 6.0  # standard deviations of a window's peak, from which it counts
LEAST_ERROR_S = 0.001  # of a lag: paths of sound differ; chosen by hand
# Margin and ratio of peaks in standard deviations of the curve; the next peak of noise is about 5.  Chosen on synthetic
# sound, `python -m benchmarks sync-sound`.
SOUND_LIMITS = Limits(margin=6.0, ratio=1.6, apart_s=0.06, error_s=0.008)


def read_sound(path: Path, seconds: float) -> Floats | None:
    """Sound of a video, mono, RATE samples/s, (n,) from time 0 of its pictures on; None without sound.

    Sound and pictures of a file may begin at different times: the time stamps of both streams count.  seconds: length of
    the part to read.  Raises OpenError.
    """
    try:
        with av.open(str(path), metadata_errors="replace") as container:
            if not container.streams.audio or not container.streams.video:
                return None
            samples = _mono(container, _begin_s(path), seconds)
    except (FFmpegError, ValueError) as error:
        raise OpenError(f"{path}: the sound cannot be decoded: {error}") from error
    return samples if len(samples) and float(np.sqrt(np.mean(samples**2))) > SILENT else None


def _begin_s(path: Path) -> float:
    """Time stamp from which the times of a video's frames count, also where the first ones cannot be decoded."""
    with VideoReader(path) as reader:
        next(until_cut(iter(reader.next, None)), None)
        return reader.begin_s


def _mono(container: av.container.InputContainer, start_s: float, seconds: float) -> Floats:
    """Samples from the time `start_s` of the container on; gaps are silent."""
    resampler = av.AudioResampler(format="flt", layout="mono", rate=RATE)
    pieces: list[tuple[int, Floats]] = []
    place: int | None = None
    within = takewhile(lambda one: one.time is None or one.time <= start_s + seconds, container.decode(audio=0))
    for decoded in chain(within, [None]):  # with None the resampler gives what it has kept
        stamp = place if decoded is None or decoded.time is None else round((decoded.time - start_s) * RATE)
        if place is None or (stamp is not None and abs(stamp - place) > GAP_S * RATE):
            place = stamp or 0
        for frame in resampler.resample(decoded):
            block = np.asarray(frame.to_ndarray(), dtype=np.float64).ravel()
            pieces.append((place, block))
            place += len(block)
    length = max((first + len(block) for first, block in pieces), default=0)
    samples = np.zeros(max(0, min(length, round(seconds * RATE))))
    for first, block in pieces:
        low, high = max(0, first), min(len(samples), first + len(block))
        if low < high:
            samples[low:high] = block[low - first : high - first]
    return samples


def phase_correlation(one: Floats, other: Floats, reach: int) -> Floats:
    """GCC-PHAT, (2 reach + 1,), in standard deviations: value k for one[i] = other[i - (k - reach)].

    reach: largest lag, samples.
    """
    size = 1 << int(np.ceil(np.log2(max(len(one) + len(other), 2 * reach + 2))))
    cross = np.fft.rfft(one, size) * np.conj(np.fft.rfft(other, size))
    cross /= np.maximum(np.abs(cross), 1e-30)
    frequencies = np.fft.rfftfreq(size, 1 / RATE)
    cross[(frequencies < BAND_HZ[0]) | (frequencies > BAND_HZ[1])] = 0
    curve = np.fft.irfft(cross, size)
    curve = np.concatenate([curve[-reach:], curve[: reach + 1]]) if reach else curve[:1]
    return np.asarray(curve / max(1e-30, 1.4826 * float(np.median(np.abs(curve)))))


@dataclass(frozen=True)
class SoundPair:
    """Two tracks (n,), RATE samples/s.  max_lag_s: range of the search."""

    one: Floats
    other: Floats
    max_lag_s: float

    @cached_property
    def _exact(self) -> Floats:
        return phase_correlation(self.one, self.other, round(self.max_lag_s * RATE))

    @cached_property
    def curve(self) -> Curve:
        """Largest value in bins of BIN_S, standard deviations."""
        per_bin, half = round(BIN_S * RATE), round(self.max_lag_s / BIN_S)
        middle, spare = len(self._exact) // 2, per_bin // 2
        padded = np.pad(self._exact, spare + per_bin)
        first = middle + per_bin - half * per_bin  # of the bin of lag -half, in `padded`
        bins = padded[first : first + (2 * half + 1) * per_bin].reshape(2 * half + 1, per_bin)
        return Curve(BIN_S, bins.max(axis=1))

    def refined(self, lag_s: float) -> Lag | None:
        """Lag of the whole tracks, and its error from the lags of windows, which a drift of the clocks spreads."""
        exact = _peak_near(self._exact, lag_s)
        if exact is None:
            return None
        begin, end = max(0.0, exact), min(len(self.one) / RATE, len(self.other) / RATE + exact)
        count = int(np.clip((end - begin) / WINDOW_S, 1, WINDOWS))
        lags = []
        for k in range(count):
            first, last = (begin + (end - begin) * part / count for part in (k, k + 1))
            one = self.one[round(first * RATE) : round(last * RATE)]
            other = self.other[round((first - exact) * RATE) : round((last - exact) * RATE)]
            if min(len(one), len(other)) < RATE // 4:
                continue
            near = phase_correlation(one, other, round(0.25 * RATE))
            best = int(np.argmax(near))
            if near[best] >= WINDOW_Z:
                lags.append((best - len(near) // 2) / RATE)
        if not lags:
            return Lag(exact, 2 * LEAST_ERROR_S, 0.0)
        spread = float(np.sqrt(np.mean(np.square(lags))))
        return Lag(exact, LEAST_ERROR_S + spread / np.sqrt(len(lags)), 1e3 * spread)


def _peak_near(curve: Floats, lag_s: float) -> float | None:
    """Lag in seconds of the largest value within NEAR_S, between samples by a parabola."""
    middle, near = len(curve) // 2, round(NEAR_S * RATE)
    centre = middle + round(lag_s * RATE)
    low, high = max(1, centre - near), min(len(curve) - 1, centre + near + 1)
    if low >= high:
        return None
    best = low + int(np.argmax(curve[low:high]))
    before, at, after = curve[best - 1 : best + 2] if best + 1 < len(curve) else (0.0, curve[best], 0.0)
    bend = before - 2 * at + after
    shift = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float((best - middle + np.clip(shift, -0.5, 0.5)) / RATE)
