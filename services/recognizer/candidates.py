"""Stretches of a motion that may be postures, for a person to name: where somebody moves, until they are back or still.

Nothing is known of any posture yet, so that only movement counts: a stretch begins where the features begin to change and
ends where they rest; a rest away from where it began, such as an arm held up, belongs to it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.recognizer.features import NAMES

SMOOTH_S = 0.2  # of the running mean before speeds
TREMBLING = 3.0  # times the speed of the stillest third: then somebody moves
LEAST_SPEED, MOST_SPEED = 0.6, 6.0  # rad/s, if they stand very still, or never
LEAST_ROWS = 3
GO_ON = 0.5  # of the speed at which it begins: below, it rests
SHORT_PAUSE_S, HOLD_S = 0.35, 2.0  # a rest that never ends a stretch; one that does not as long as the pose is held
HELD = 0.5  # of how far it came: as far from its beginning, a pose is held
LEAST_S, LEAST_REACH = 0.3, 0.35  # seconds, rad
LONGEST_S = 20.0
MARGIN_S = 0.1
SHARE = 0.5  # of the limb that moves most: limbs that move as far are named as well
LIMBS = {name: name.split("_")[0] + (" leg" if "hip" in name else " arm") for name in NAMES}


@dataclass(frozen=True)
class Candidate:
    """start_s, end_s: seconds as the motion counts them.  reach: radians, how far it comes.  limbs: what moves."""

    start_s: float
    end_s: float
    reach: float
    limbs: tuple[str, ...]


def candidates_of(times_s: Floats, features: Floats, rate: float) -> list[Candidate]:
    """The candidates of a motion in order of time, none over another.

    times_s: (T,) seconds, rising.  features: (T, 10) radians, NaN where there is no pose, which ends a stretch.
    rate: frames per second.
    """
    known: NDArray[np.bool_] = np.asarray(np.isfinite(features).all(axis=1))
    if known.sum() < LEAST_ROWS:
        return []
    speeds = _speeds(features, known, rate)
    sorted_speeds = np.sort(speeds[np.isfinite(speeds)])
    still = sorted_speeds[: max(1, len(sorted_speeds) // 3)]
    begins = float(np.clip(TREMBLING * np.median(still), LEAST_SPEED, MOST_SPEED)) if len(still) else MOST_SPEED
    found: list[Candidate] = []
    for first, last in _joined(_active(speeds, begins), features, known, rate):
        rows = slice(first, last + 1)
        changes = np.abs(features[rows] - features[first]).max(axis=0)
        reach = float(np.linalg.norm(features[rows] - features[first], axis=1).max())
        if (last - first) / rate < LEAST_S or reach < LEAST_REACH:
            continue
        margin = round(MARGIN_S * rate)
        first, last = _widened(first, last, margin, known)
        while found and first < last and float(times_s[first]) <= found[-1].end_s:
            first += 1
        found.append(Candidate(float(times_s[first]), float(times_s[last]), reach, _limbs(changes)))
    return found


def _speeds(features: Floats, known: NDArray[np.bool_], rate: float) -> Floats:
    """(T,) rad/s of the smoothed features; NaN where nothing is known nearby."""
    width = max(1, round(SMOOTH_S * rate) // 2 * 2 + 1)
    padded = np.pad(features, ((width // 2, width // 2), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, width, axis=0)
    smooth = windows.mean(axis=-1)
    speeds: Floats = np.linalg.norm(np.gradient(smooth, axis=0), axis=1) * rate
    speeds[~known] = np.nan
    return speeds


def _active(speeds: Floats, begins: float) -> list[tuple[int, int]]:
    """First and last rows of every stretch of movement: from `begins` on, until it falls below a share of that."""
    stretches, first = [], -1
    for row, speed in enumerate(speeds):
        if first < 0 and speed > begins:
            first = row
        elif first >= 0 and not speed > GO_ON * begins:
            stretches.append((first, row))
            first = -1
    if first >= 0:
        stretches.append((first, len(speeds) - 1))
    return stretches


def _joined(
    stretches: list[tuple[int, int]], features: Floats, known: NDArray[np.bool_], rate: float
) -> list[tuple[int, int]]:
    """Stretches with the rests between them that do not end a movement."""
    joined: list[tuple[int, int]] = []
    for first, last in stretches:
        if joined:
            begin, end = joined[-1]
            pause_s, length_s = (first - end) / rate, (last - begin) / rate
            away = np.linalg.norm(features[begin : end + 1] - features[begin], axis=1)
            held = away[-1] > HELD * away.max()
            goes_on = pause_s < SHORT_PAUSE_S or (held and pause_s < HOLD_S)
            if goes_on and length_s < LONGEST_S and known[begin : last + 1].all():
                joined[-1] = (begin, last)
                continue
        joined.append((first, last))
    return joined


def _widened(first: int, last: int, margin: int, known: NDArray[np.bool_]) -> tuple[int, int]:
    """By `margin` rows at either end, as far as they are known."""
    for _ in range(margin):
        first -= first > 0 and bool(known[first - 1])
        last += last + 1 < len(known) and bool(known[last + 1])
    return first, last


def _limbs(changes: Floats) -> tuple[str, ...]:
    by_limb: dict[str, float] = {}
    for name, change in zip(NAMES, changes, strict=True):
        by_limb[LIMBS[name]] = max(by_limb.get(LIMBS[name], 0.0), float(change))
    most = max(by_limb.values())
    return tuple(limb for limb, change in sorted(by_limb.items(), key=lambda pair: -pair[1]) if change >= SHARE * most)
