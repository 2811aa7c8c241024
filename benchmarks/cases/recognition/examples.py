"""The recognizer's input from generated takes of simulated people, made once for the same sources."""

import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import cast

from tests.support.stored import stored
from zenocap.common.errors import UserError
from zenocap.services.recognizer.features import DEFAULT, Kind
from zenocap.services.recognizer.training.example_files import examples_of
from zenocap.services.recognizer.training.examples import Example
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.simulation.motion.timeline import MotionTimeline
from zenocap.tools.teach.dataset.batch import PEOPLE, generate_takes, people, posture_takes, take_path
from zenocap.tools.teach.dataset.generate import Method, dataset_rig, generate_take

Size = tuple[int, int]
SETTINGS_SEED = 9  # persons 108 to 119: settings were chosen on them; they are in no test


def posture_examples(
    method: str, people_seed: int, kind: Kind = DEFAULT, count: int = PEOPLE, size: Size | None = None
) -> list[Example]:
    """Examples of all takes with poses of a seed's people; the others count as not recognized."""
    found: list[Example] = []
    for person in people(people_seed, count):
        make = partial(_postures, cast(Method, method), person, kind, size)
        found += stored(make, method, person, kind, size, sources=(__name__,))
    return found


def _postures(method: Method, person: int, kind: Kind, size: Size | None) -> list[Example]:
    found = []
    with tempfile.TemporaryDirectory() as place:
        folder, wanted = Path(place), posture_takes([person])
        generate_takes(folder, method, wanted, 1, lambda *_: None, size)
        for one in wanted:
            take, line = take_path(folder, method, one), one.timeline()
            if take.is_file():
                row = ManifestRow(
                    0, take, line.motion_from_s, line.duration_s, one.posture, str(person), str(one.repetition)
                )
                found += _read(folder, [row], kind)
    return found


def session_take(method: str, script: MotionTimeline, seed: int, folder: Path) -> Path:
    """Take of a session in a folder."""
    take = folder / f"{seed}.mcap"
    generate_take(dataset_rig(cast(Method, method)), cast(Method, method), script, seed, take)
    return take


def _read(place: Path, rows: list[ManifestRow], kind: Kind) -> list[Example]:
    missing: list[str] = []
    try:
        return examples_of(place, rows, kind, missing=missing)
    except (ValueError, UserError) as error:
        print(f"{place.name}: {error}", file=sys.stderr)
        return []
