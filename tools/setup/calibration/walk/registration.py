"""2-D registration of floor paths."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from zenocap.tools.setup.calibration.walk.parameters import (
    LEAST_AGREEING,
    LEAST_APART_M,
    LEAST_INSTANTS,
    LEAST_WIDTH_M,
    MIRRORED,
    NEAR_M,
    TRIALS,
)
from zenocap.tools.setup.calibration.walk.single_view import Track


@dataclass(frozen=True)
class PlanarMotion:
    """q = turn p + shift of two tracks.  turn: of absolute value 1.  agreeing, common: numbers of instants.

    error_m: median distance.  mirrored: whether the mirrored track agrees, and the track itself does not.
    """

    turn: complex
    shift: complex
    agreeing: int
    common: int
    error_m: float
    mirrored: bool

    def inverse(self) -> "PlanarMotion":
        turn = self.turn.conjugate()
        return PlanarMotion(turn, -turn * self.shift, self.agreeing, self.common, self.error_m, self.mirrored)


def registered(one: Track, other: Track) -> PlanarMotion | None:
    """Motion of `one` onto `other`; None without enough common instants, or where the person hardly moved."""
    found, mirrored = _best(one, other), _best(one.conjugate(), other)
    if found is None:
        return None
    common = int(np.isfinite(one * other).sum())
    contradicts = found[2] < LEAST_AGREEING * common and min(_width(one), _width(other)) > LEAST_WIDTH_M
    is_mirrored = contradicts and mirrored is not None and mirrored[2] > MIRRORED * common
    return PlanarMotion(found[0], found[1], found[2], common, found[3], is_mirrored)


def _width(track: Track) -> float:
    """Width of a track across its longest direction, m: the mirror image of a straight one is the straight one, turned."""
    known = track[np.isfinite(track)]
    return float(4.0 * np.sqrt(np.linalg.eigvalsh(np.cov(known.real, known.imag))[0]))


def _best(one: Track, other: Track) -> tuple[complex, complex, int, float] | None:
    both = np.isfinite(one) & np.isfinite(other)
    p, q = one[both], other[both]
    if len(p) < LEAST_INSTANTS:
        return None
    rng = np.random.default_rng(0)
    best: tuple[int, complex, complex] | None = None
    for _ in range(TRIALS):
        i, j = rng.integers(len(p), size=2)
        if abs(p[i] - p[j]) < LEAST_APART_M or abs(q[i] - q[j]) < LEAST_APART_M:
            continue
        turn = (q[j] - q[i]) / (p[j] - p[i])
        turn = turn / abs(turn)
        shift = 0.5 * (q[i] + q[j] - turn * (p[i] + p[j]))
        near = int((np.abs(turn * p + shift - q) < NEAR_M).sum())
        if best is None or near > best[0]:
            best = near, complex(turn), complex(shift)
    if best is None:
        return None
    _, turn, shift = best
    for _ in range(5):
        near_ones = np.abs(turn * p + shift - q) < NEAR_M
        a, b = p[near_ones], q[near_ones]
        if len(a) < 3:
            break
        product = complex(np.sum((b - b.mean()) * (a - a.mean()).conjugate()))
        if abs(product) < 1e-9:
            break
        turn = product / abs(product)
        shift = complex(b.mean() - turn * a.mean())
    distances = np.abs(turn * p + shift - q)
    return turn, shift, int((distances < NEAR_M).sum()), float(np.median(distances))


def pairs_of(tracks: Mapping[str, Track]) -> dict[tuple[str, str], PlanarMotion]:
    """Motions of all pairs of cameras that see the person together often enough."""
    found = {}
    for one, other in combinations(tracks, 2):
        motion = registered(tracks[one], tracks[other])
        if motion is not None:
            found[one, other] = motion
    return found


def joined(names: list[str], pairs: Mapping[tuple[str, str], PlanarMotion]) -> dict[str, PlanarMotion]:
    """Motion of the track of each joined camera into the frame of the first one, along the best pairs."""
    good = {pair: one for pair, one in pairs.items() if one.agreeing >= LEAST_AGREEING * one.common and not one.mirrored}
    both = good | {(other, one): motion.inverse() for (one, other), motion in good.items()}
    if not both:
        return {}
    first = max(names, key=lambda name: sum(motion.agreeing for pair, motion in both.items() if pair[1] == name))
    placed = {first: PlanarMotion(1.0 + 0j, 0j, 0, 0, 0.0, False)}
    while True:
        open_pairs = [pair for pair in both if pair[0] not in placed and pair[1] in placed]
        if not open_pairs:
            return placed
        one, other = max(open_pairs, key=lambda pair: both[pair].agreeing)
        motion, base = both[one, other], placed[other]
        turn, shift = base.turn * motion.turn, base.turn * motion.shift + base.shift
        placed[one] = PlanarMotion(turn, shift, motion.agreeing, motion.common, motion.error_m, False)
