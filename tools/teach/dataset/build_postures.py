"""`make postures`: train the shipped posture model on simulated people.  Equal code gives equal bytes.

python -m zenocap.tools.teach.dataset.build_postures [--to FOLDER] [--takes FOLDER] [--jobs N]

Trained on true angles and on angles tracked by two viewers together.  With the first alone, two-view's errors are rejected
as unknown movements, and with the second alone, the tracker's better angles are.  Everyday movement of other people is the
background, by both, too.
"""

import argparse
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import SHIPPED, SUFFIX, write_model
from zenocap.services.recognizer.training.example_files import examples_of
from zenocap.services.recognizer.training.examples import BACKGROUND, Example, TrainingSettings
from zenocap.services.recognizer.training.manifest import ManifestRow, read_manifest
from zenocap.services.recognizer.training.train import no_report, train
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.activities import ACTIVITIES
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import MotionTimeline, session_timeline
from zenocap.tools.teach.dataset.batch import MANIFEST, PostureTake, Report, generate_takes, people, posture_takes
from zenocap.tools.teach.dataset.generate import Method, dataset_rig, generate_take

NAME = "fifteen"
PEOPLE_SEED = 9  # persons 108 to 119
BACKGROUND_SEED, BACKGROUND_PEOPLE = 11, 6  # persons 132 to 137
METHODS: tuple[Method, ...] = ("truth", "two-view")
REPETITIONS = 3  # of each activity by each person
AWAY, AWAY_TIMES = "turn-and-walk", 3  # a posture that ends elsewhere: the walk back is background
PAUSES_S = (0.4, 2.0)


def shipped_model(
    folder: Path, takes: Sequence[PostureTake], background: Iterable[int], jobs: int,
    settings: TrainingSettings | None = None, report: Report = no_report,
) -> PostureModel:  # fmt: skip
    """Train a model.

    folder: of the takes; existing ones are reused.  background: seeds of the people of everyday movement.  Raises as
    `generate_takes` and `train` do.
    """
    examples: list[Example] = []
    for method in METHODS:
        generate_takes(folder / method, method, takes, jobs, report)
        manifest = folder / method / MANIFEST
        report(0, 1, f"{method}, everyday movement")
        rows = [*read_manifest(manifest), *background_rows(folder / method, method, background)]
        for row in rows:
            # Only the file name: with the folder, the model would differ between machines.
            examples += [replace(one, source=row.source.name) for one in examples_of(manifest, [row], DEFAULT, missing=[])]
    return train(examples, settings or TrainingSettings(), report)


def session_of(seed: int) -> MotionTimeline:
    """Every activity of a person REPETITIONS times, in random order, with pauses, and walks.  seed: of the person."""
    rng = np.random.default_rng([0xB6, seed])
    names = [*ACTIVITIES * REPETITIONS, *[AWAY] * AWAY_TIMES]
    movements = [(names[k], number) for number, k in enumerate(rng.permutation(len(names)).tolist())]
    return session_timeline(person(seed), movements, rng.uniform(*PAUSES_S, len(movements)).tolist(), seed)


def background_rows(folder: Path, method: Method, people: Iterable[int]) -> Iterator[ManifestRow]:
    """Rows of a manifest, of everything but postures; takes that exist are used again.  Raises OSError and UserError."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in people:
        session, path = session_of(seed), folder / f"{method}-background-{seed}.mcap"
        if not path.is_file():
            part = path.with_suffix(f".{os.getpid()}.part")
            generate_take(dataset_rig(method), method, session, seed, part)
            part.replace(path)
        for number, (start_s, end_s) in enumerate(_without_postures(session)):
            yield ManifestRow(0, path, start_s, end_s, BACKGROUND, str(seed), str(number))


def _without_postures(session: MotionTimeline) -> Iterator[tuple[float, float]]:
    """Begin and end (s) of the stretches between postures."""
    begin = session.motion_from_s
    for segment in session.segments:
        if segment.name in POSTURES:
            if segment.start_s > begin:
                yield begin, segment.start_s
            begin = segment.end_s
    yield begin, session.duration_s


def print_progress(done: int, of: int, text: str) -> None:
    print(f"\r{done} of {of} {text:40.40}", end="", file=sys.stderr, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="Train the shipped posture model on simulated people.")
    parser.add_argument("--to", type=Path, default=SHIPPED, metavar="FOLDER")
    parser.add_argument("--takes", type=Path, default=Path("build/postures"), metavar="FOLDER", help="of the takes, kept")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="number of processes (default 2)")
    wanted = parser.parse_args()
    background = people(BACKGROUND_SEED, BACKGROUND_PEOPLE)
    model = shipped_model(wanted.takes, posture_takes(people(PEOPLE_SEED)), background, wanted.jobs, report=print_progress)
    wanted.to.mkdir(parents=True, exist_ok=True)
    path = wanted.to / f"{NAME}{SUFFIX}"
    write_model(path, model)
    frames, size = model.training.frames, path.stat().st_size / 1000
    print(f"\n{path}: {len(model.labels)} postures of {frames} frames, {size:.0f} kB")


if __name__ == "__main__":
    main()
