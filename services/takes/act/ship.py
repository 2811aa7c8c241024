"""`make postures`: the posture model that comes with zenocap, learnt from the synthetic actor.  The same bytes every time.

python -m services.takes.act.ship [--to FOLDER] [--takes FOLDER] [--jobs N]

Learnt from true angles and from what the two viewers make of video, together: with the first alone two-view's errors are
unknown movements, and with the second alone the tracker's better angles are.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from services.recognizer.features import DEFAULT
from services.recognizer.file import SHIPPED, SUFFIX, write_model
from services.recognizer.manifest import read_manifest
from services.recognizer.model import PostureModel
from services.recognizer.reading import examples_of
from services.recognizer.training import Example, Plan, train
from services.takes.act.cast import Act, acts, people
from services.takes.act.shell import MANIFEST, Report, perform
from services.takes.act.stage import Method

NAME = "fifteen"
PEOPLE_SEED = 9  # persons 108 to 119
METHODS: tuple[Method, ...] = ("truth", "two-view")


def quiet(done: int, of: int, words: str) -> None: ...


def shipped_model(
    folder: Path, cast: Sequence[Act], jobs: int, plan: Plan | None = None, report: Report = quiet
) -> PostureModel:
    """The model of a cast.  folder: of the takes, those that are there are used.  Raises as `perform` and `train` do."""
    learnt_from: list[Example] = []
    for method in METHODS:
        perform(folder / method, method, cast, jobs, report)
        manifest = folder / method / MANIFEST
        rows = read_manifest(manifest)
        for row, example in zip(rows, examples_of(manifest, rows, DEFAULT), strict=True):
            # Where the takes were is nobody's business: the file would differ from machine to machine.
            learnt_from.append(replace(example, source=row.source.name))
    return train(learnt_from, plan or Plan(), report)


def told(done: int, of: int, words: str) -> None:
    print(f"\r{done} of {of} {words:40.40}", end="", file=sys.stderr, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description="Learn the posture model that comes with zenocap from the synthetic actor."
    )
    parser.add_argument("--to", type=Path, default=SHIPPED, metavar="FOLDER")
    parser.add_argument("--takes", type=Path, default=Path("build") / "postures", metavar="FOLDER", help="kept there")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes that film (default 2)")
    wanted = parser.parse_args()
    model = shipped_model(wanted.takes, acts(people(PEOPLE_SEED)), wanted.jobs, report=told)
    wanted.to.mkdir(parents=True, exist_ok=True)
    path = wanted.to / f"{NAME}{SUFFIX}"
    write_model(path, model)
    frames, size = model.training.frames, path.stat().st_size / 1000
    print(f"\n{path}: {len(model.labels)} postures of {frames} frames, {size:.0f} kB")


if __name__ == "__main__":
    main()
