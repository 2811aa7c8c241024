"""Takes of everyday movement of simulated people: the background of the shipped posture model."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from zenocap.services.recognizer.training.examples import BACKGROUND
from zenocap.services.recognizer.training.manifest import Row
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.activities import ACTIVITIES
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import MotionTimeline, session_timeline
from zenocap.tools.dataset.generate import Method, dataset_rig, generate_take

REPETITIONS = 3  # of each activity by each person
AWAY, AWAY_TIMES = "turn-and-walk", 3  # a posture that ends elsewhere: the walk back is background
PAUSES_S = (0.4, 2.0)


def session_of(seed: int) -> MotionTimeline:
    """Every activity of a person REPETITIONS times, in random order, with pauses, and walks.  seed: of the person."""
    rng = np.random.default_rng([0xB6, seed])
    names = [*ACTIVITIES * REPETITIONS, *[AWAY] * AWAY_TIMES]
    movements = [(names[k], number) for number, k in enumerate(rng.permutation(len(names)).tolist())]
    return session_timeline(person(seed), movements, rng.uniform(*PAUSES_S, len(movements)).tolist(), seed)


def background_rows(folder: Path, method: Method, people: Iterable[int]) -> Iterator[Row]:
    """Rows of a manifest, of everything but postures; takes that exist are used again.  Raises OSError and UserError."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in people:
        session, path = session_of(seed), folder / f"{method}-background-{seed}.mcap"
        if not path.is_file():
            part = path.with_suffix(f".{os.getpid()}.part")
            generate_take(dataset_rig(method), method, session, seed, part)
            part.replace(path)
        for number, (start_s, end_s) in enumerate(_without_postures(session)):
            yield Row(0, path, start_s, end_s, BACKGROUND, str(seed), str(number))


def _without_postures(session: MotionTimeline) -> Iterator[tuple[float, float]]:
    """Begin and end (s) of the stretches between postures."""
    begin = session.motion_from_s
    for segment in session.segments:
        if segment.name in POSTURES:
            if segment.start_s > begin:
                yield begin, segment.start_s
            begin = segment.end_s
    yield begin, session.duration_s
