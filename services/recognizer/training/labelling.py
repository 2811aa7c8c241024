"""Candidates of postures in a motion, to be labelled by a user, and labels that a model suggests.

No posture is known yet: a candidate starts where the features begin to change and ends where they rest.  A rest away from
the start, such as a raised arm, belongs to the candidate.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.services.recognizer.features import NAMES
from zenocap.services.recognizer.model import PostureModel, classify
from zenocap.services.recognizer.motion_rows import ANGLES
from zenocap.services.recognizer.training import parameters as p
from zenocap.services.recognizer.training.example_files import Features, span
from zenocap.services.recognizer.training.examples import resample
from zenocap.services.recognizer.training.manifest import ManifestRow

LEAST_ROWS = 3  # frames with a pose
LIMBS = {name: name.split("_")[0] + (" leg" if "hip" in name else " arm") for name in NAMES}


@dataclass(frozen=True)
class Candidate:
    """Time span that may show a posture.

    start_s, end_s: seconds of the motion.  reach: largest distance from the start, radians.  limbs: that move.
    """

    start_s: float
    end_s: float
    reach: float
    limbs: tuple[str, ...]


def candidates_of(times_s: Floats, features: Floats, rate: float) -> list[Candidate]:
    """Candidates of a motion in order of time, without overlaps.

    times_s: (T,) seconds, rising.  features: (T, d) rows, NaN in frames without a pose, which end a
    candidate.  rate: frames per second.
    """
    speeds = speeds_of(features, rate)
    features = features[:, ANGLES]
    known: Bools = np.asarray(np.isfinite(features).all(axis=1))
    if known.sum() < LEAST_ROWS:
        return []
    sorted_speeds = np.sort(speeds[np.isfinite(speeds)])
    still = sorted_speeds[: max(1, len(sorted_speeds) // 3)]
    begins = float(np.clip(p.NOISE_FACTOR * np.median(still), p.LEAST_SPEED, p.MOST_SPEED)) if len(still) else p.MOST_SPEED
    found: list[Candidate] = []
    movements = _active(speeds, begins)
    for first, last in _joined(movements, features, _rest(movements, features, known), known, rate):
        rows = slice(first, last + 1)
        changes = np.abs(features[rows] - features[first]).max(axis=0)
        reach = float(np.linalg.norm(features[rows] - features[first], axis=1).max())
        if (last - first) / rate < p.LEAST_CANDIDATE_S or reach < p.LEAST_REACH:
            continue
        margin = round(p.MARGIN_S * rate)
        first, last = _widened(first, last, margin, known)
        while found and first < last and float(times_s[first]) <= found[-1].end_s:
            first += 1
        found.append(Candidate(float(times_s[first]), float(times_s[last]), reach, _limbs(changes)))
    return found


def speeds_of(features: Floats, rate: float) -> Floats:
    """(T,) rad/s of the smoothed angles of features (T, d); NaN near frames without a pose."""
    features = features[:, ANGLES]
    known = np.isfinite(features).all(axis=1)
    if len(features) < LEAST_ROWS:
        return np.full(len(features), np.nan)
    width = max(1, round(p.SPEED_SMOOTHING_S * rate) // 2 * 2 + 1)
    padded = np.pad(features, ((width // 2, width // 2), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, width, axis=0)
    smooth = windows.mean(axis=-1)
    speeds: Floats = np.linalg.norm(np.gradient(smooth, axis=0), axis=1) * rate
    speeds[~known] = np.nan
    return speeds


def _active(speeds: Floats, begins: float) -> list[tuple[int, int]]:
    """First and last rows of every movement: from a speed above `begins` to one below END_SPEED of that."""
    movements, first = [], -1
    for row, speed in enumerate(speeds):
        if first < 0 and speed > begins:
            first = row
        elif first >= 0 and not speed > p.END_SPEED * begins:
            movements.append((first, row))
            first = -1
    if first >= 0:
        movements.append((first, len(speeds) - 1))
    return movements


def _rest(movements: list[tuple[int, int]], features: Floats, known: Bools) -> Floats:
    """(d,) features of the pause that is most like the others: a T-pose at the start, or a raised arm, is one of many."""
    edges = [0, *(row for movement in movements for row in movement), len(features) - 1]
    pauses = [
        features[first : last + 1][known[first : last + 1]] for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]
    middles = np.array([np.median(pause, axis=0) for pause in pauses if len(pause)])
    if not len(middles):
        middles = features[known][:1]
    distances = np.linalg.norm(middles[:, None] - middles[None], axis=2)
    usual: Floats = middles[np.argmin(np.median(distances, axis=1))]
    return usual


def _joined(
    movements: list[tuple[int, int]], features: Floats, rest: Floats, known: Bools, rate: float
) -> list[tuple[int, int]]:
    """Join movements across pauses that do not end a candidate: short ones, and longer ones away from begin and rest.

    rest: (d,) features of the usual pause.
    """
    joined: list[tuple[int, int]] = []
    for first, last in movements:
        if joined:
            begin, end = joined[-1]
            pause_s, length_s = (first - end) / rate, (last - begin) / rate
            away = np.linalg.norm(features[begin : end + 1] - features[begin], axis=1)
            held = min(away[-1], np.linalg.norm(features[end] - rest)) > p.HELD_SHARE * away.max()
            continues = pause_s < p.SHORT_PAUSE_S or (held and pause_s < p.HOLD_S)
            if continues and length_s < p.LONGEST_CANDIDATE_S and known[begin : last + 1].all():
                joined[-1] = (begin, last)
                continue
        joined.append((first, last))
    return joined


def _widened(first: int, last: int, margin: int, known: Bools) -> tuple[int, int]:
    """First and last row, extended by up to `margin` rows with a pose."""
    for _ in range(margin):
        first -= first > 0 and bool(known[first - 1])
        last += last + 1 < len(known) and bool(known[last + 1])
    return first, last


def _limbs(changes: Floats) -> tuple[str, ...]:
    by_limb: dict[str, float] = {}
    for name, change in zip(NAMES, changes, strict=True):
        by_limb[LIMBS[name]] = max(by_limb.get(LIMBS[name], 0.0), float(change))
    most = max(by_limb.values())
    by_change = sorted(by_limb.items(), key=lambda pair: -pair[1])
    return tuple(limb for limb, change in by_change if change >= p.LIMB_SHARE * most)


@dataclass(frozen=True)
class Suggestion:
    """Label suggested by a model.

    label: of the likeliest posture.  known: the model accepts it.  margin: log-likelihood minus the second largest.
    """

    label: str
    known: bool
    margin: float

    def __str__(self) -> str:
        return self.label if self.known else f"{self.label}?"


def suggestions_in(model: PostureModel, motion: Features, candidates: Sequence[Candidate]) -> list[Suggestion | None]:
    """Label of each candidate of a motion by a model; None for candidates with too few frames."""
    suggestions: list[Suggestion | None] = []
    for one in candidates:
        try:
            features = span(motion, one.start_s, one.end_s)
        except ValueError:
            suggestions.append(None)
            continue
        found = classify(model, resample(features, motion.rate, model.rate))
        suggestions.append(Suggestion(model.labels[found.best], found.accepted, found.margin))
    return suggestions


def is_labelled(rows: Sequence[ManifestRow], source: Path, one: Candidate) -> bool:
    """True when a row of the same source covers more than half of a candidate."""
    for row in rows:
        if row.source.resolve() == source.resolve():
            end = one.end_s if row.end is None else row.end
            if min(one.end_s, end) - max(one.start_s, row.start or 0.0) > 0.5 * (one.end_s - one.start_s):
                return True
    return False


def add_rows(
    rows: Sequence[ManifestRow], source: Path, person: str, labelled: Sequence[tuple[Candidate, str]]
) -> list[ManifestRow]:
    """Append a row per labelled candidate; repetitions of a posture by a person are numbered consecutively."""
    made = list(rows)
    for one, posture in labelled:
        done = sum(row.posture == posture and row.person == person for row in made)
        made.append(ManifestRow(0, source, round(one.start_s, 3), round(one.end_s, 3), posture, person, str(done + 1)))
    return made
