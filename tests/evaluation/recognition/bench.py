"""Acted takes for the evaluation, made once for the code as it is, and what the recogniser gets of them."""

import hashlib
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from common.formats.trc import FormatError
from services.recognizer.features import Kind
from services.recognizer.manifest import Row
from services.recognizer.reading import examples_of
from services.recognizer.training import Example
from services.takes.act.cast import Act, acts, people
from services.takes.act.shell import perform, take_of
from services.takes.act.stage import Method

ROOT = Path(__file__).resolve().parents[3]
ACTED_BY = ("common/actor", "services/takes/act")
TRACKED_BY = ("common/body", "common/camera", "common/vision", "services/viewer")
CODE: dict[Method, tuple[str, ...]] = {
    "truth": ACTED_BY,
    "two-view": (*ACTED_BY, *TRACKED_BY, "services/integrator"),
    "hybrid": (*ACTED_BY, *TRACKED_BY, "services/tracker"),
}
SETTINGS_SEED = 9  # persons 108 to 119: what is chosen is chosen on them, and they are in no test
STREAM_SEED = 10  # persons 120 and after: of the streams


@dataclass(frozen=True)
class Bench:
    """motions: folder of the shared motion capture.  out: of the report and of what is kept.

    seeds: of people, from 0.  count: people of a seed.  jobs: processes that film.
    """

    motions: Path
    out: Path
    seeds: int
    count: int
    jobs: int

    def acts(self, people_seed: int) -> list[Act]:
        return acts(people(people_seed, self.count))

    def folder(self, method: Method, people_seed: int) -> Path:
        """Of the takes."""
        return self.out / "acted" / f"{method}-{people_seed}-{code_of(method)}"

    def filmed(self, method: Method, people_seed: int) -> Path:
        """The same, with every take of the seed's people in it."""
        folder = self.folder(method, people_seed)
        perform(folder, method, self.acts(people_seed), self.jobs, Report(f"{method}, people {people_seed}"))
        return folder

    def examples(self, method: Method, people_seed: int, kind: Kind) -> list[Example]:
        """Of every take that has poses; the others were not recognised, and count so."""
        return examples(self.filmed(method, people_seed), method, self.acts(people_seed), kind)


def examples(folder: Path, method: Method, wanted: Iterable[Act], kind: Kind) -> list[Example]:
    """Of those acts whose takes are there and have poses throughout the posture."""
    found = []
    for one in wanted:
        take, script = take_of(folder, method, one), one.script()
        if not take.is_file():
            continue
        row = Row(0, take, script.motion_from_s, script.duration_s, one.posture, str(one.person), str(one.repetition))
        try:
            found += examples_of(folder, [row], kind)
        except (ValueError, FormatError) as error:
            print(f"{take.name}: {error}", file=sys.stderr)
    return found


def code_of(method: Method) -> str:
    """Digest of the code that decides what is in a method's takes."""
    told = hashlib.sha256()
    for place in CODE[method]:
        for path in sorted((ROOT / place).rglob("*.py")):
            told.update(path.read_bytes())
    return told.hexdigest()[:10]


@dataclass(frozen=True)
class Report:
    """A line on standard error now and then."""

    words: str
    every: int = 30

    def __call__(self, done: int, of: int, _: str) -> None:
        if done % self.every == 0 or done == of:
            print(f"{self.words}: {done} of {of}", file=sys.stderr, flush=True)
