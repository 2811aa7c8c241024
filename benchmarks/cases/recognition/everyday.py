"""Everyday movement without postures: sessions of simulated people, for backgrounds and for counting false postures."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.cases.recognition.examples import session_examples
from benchmarks.cases.recognition.scenario import MINUTE_S, NO_PAUSE_SHARE, PAUSES_S
from tests.support.stored import stored
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.motion_rows import rows_of
from zenocap.services.recognizer.training.examples import BACKGROUND, LEAST_ROWS, Example
from zenocap.services.recognizer.training.manifest import Row
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.activities import ACTIVITIES
from zenocap.simulation.motion.timeline import MotionTimeline, session_timeline
from zenocap.tools.dataset.generate import FPS

AWAY, AWAY_SHARE = "turn-and-walk", 0.1  # of the movements: a posture, and the walk back is everyday movement


def session_of(seed: int, minutes: float) -> MotionTimeline:
    """A session of `minutes` or a little more of a person.  seed: of the person and the sequence of movements."""
    rng = np.random.default_rng([0x5E, seed])
    subject = person(seed)
    movements: list[tuple[str, int]] = []
    pauses_s: list[float] = []
    while True:
        script = session_timeline(subject, movements, pauses_s, seed)
        if script.duration_s - script.motion_from_s >= minutes * MINUTE_S:
            return script
        for _ in range(4):
            name = AWAY if rng.uniform() < AWAY_SHARE else str(rng.choice(ACTIVITIES))
            movements.append((name, len(movements)))
            pauses_s.append(0.0 if rng.uniform() < NO_PAUSE_SHARE else float(rng.uniform(*PAUSES_S)))


def stretches_of(script: MotionTimeline) -> Iterator[tuple[float, float]]:
    """Begin and end (s) of the movement before, between and after the postures of a session."""
    edges = [script.motion_from_s]
    for segment in script.segments:
        if segment.name == AWAY:
            edges += [segment.start_s, segment.end_s]
    edges.append(script.duration_s)
    return ((begin, end) for begin, end in list(pairwise(edges))[::2] if end > begin)


def everyday_examples(method: str, seed: int, minutes: float) -> list[Example]:
    """Background of a person, without gaps.  Empty without poses."""
    script = session_of(seed, minutes)
    if method == "truth":
        return stored(lambda: _true_examples(script, seed), seed, minutes, sources=(__name__,))
    spans = enumerate(stretches_of(script))
    rows = [Row(0, Path(), *span, BACKGROUND, str(seed), str(number)) for number, span in spans]
    return session_examples(method, script, seed, rows)


def _true_examples(script: MotionTimeline, seed: int) -> list[Example]:
    """The same without a take: a recording of true poses takes twice the time."""
    first = round(script.motion_from_s * FPS)
    rows = true_rows(script, np.arange(first, int(script.duration_s * FPS)) / FPS)
    found = []
    for number, (begin_s, end_s) in enumerate(stretches_of(script)):
        stretch = rows[max(round(begin_s * FPS) - first, 0) : round(end_s * FPS) - first]
        if len(stretch) >= LEAST_ROWS:
            found.append(Example(BACKGROUND, str(seed), str(number), FPS, stretch))
    return found


def true_rows(script: MotionTimeline, times_s: Floats) -> Floats:
    """(T, `motion_rows.WIDTH`) of the true poses at times (T,) after the empty scene, seconds."""
    angles, positions = np.empty((len(times_s), len(TEN_PARTS.angles))), np.empty((len(times_s), 3))
    for k, time_s in enumerate(times_s.tolist()):
        pose = script.pose_at(time_s)
        assert pose is not None, "the person is in the scene from the T-pose on"
        true = truth(script.person, pose)
        angles[k], positions[k] = [true.angles[name] for name in TEN_PARTS.angles], true.joints["Hip"]
    return rows_of(TEN_PARTS, positions, angles, DEFAULT)
