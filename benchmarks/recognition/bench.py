"""Takes of the evaluation, generated once for the current code, and the recognizer's input from them."""

import hashlib
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.training.example_files import examples_of
from zenocap.services.recognizer.training.examples import Example
from zenocap.services.recognizer.training.manifest import Row
from zenocap.tools.dataset.batch import PostureTake, generate_takes, people, posture_takes, take_path
from zenocap.tools.dataset.generate import Method

ROOT = Path(__file__).resolve().parents[2]
GENERATOR_CODE = ("simulation", "tools/dataset")
TRACKING_CODE = ("common/body", "common/camera", "common/vision", "services/viewer")
CODE: dict[Method, tuple[str, ...]] = {
    "truth": GENERATOR_CODE,
    "two-view": (*GENERATOR_CODE, *TRACKING_CODE, "services/integrator"),
    "two-view-paper": (*GENERATOR_CODE, *TRACKING_CODE, "services/integrator"),
    "hybrid-two-view": (*GENERATOR_CODE, *TRACKING_CODE, "services/tracker"),
    "hybrid": (*GENERATOR_CODE, *TRACKING_CODE, "services/tracker"),
}
POSES: tuple[Method, ...] = ("truth", "two-view", "hybrid")  # compared by several parts
SETTINGS_SEED = 9  # persons 108 to 119: settings are chosen on them; they are in no test
STREAM_SEED = 10  # persons from 120 on: for the streams


@dataclass(frozen=True)
class Bench:
    """motions: folder of the shared motion capture.  out: folder of the report and of stored takes.

    seeds: of people, from 0.  count: people per seed.  jobs: number of processes that generate takes.  size: of the images
    (width, height) px; None for the default of each method.  minutes: of all streams together.  poses: sources of poses of
    the parts that compare several.
    """

    motions: Path
    out: Path
    seeds: int
    count: int
    jobs: int
    size: tuple[int, int] | None = None
    minutes: float = 10.0
    poses: tuple[Method, ...] = POSES

    def posture_takes(self, people_seed: int) -> list[PostureTake]:
        return posture_takes(people(people_seed, self.count))

    def folder(self, method: Method, people_seed: int) -> Path:
        """Of the takes."""
        size = "" if self.size is None else f"-{self.size[0]}x{self.size[1]}"
        return self.out / "acted" / f"{method}{size}-{people_seed}-{code_of(method)}"

    def generated(self, method: Method, people_seed: int) -> Path:
        """The same folder, after generation of every take of the seed's people."""
        folder = self.folder(method, people_seed)
        report = Report(f"{method}, people {people_seed}")
        generate_takes(folder, method, self.posture_takes(people_seed), self.jobs, report, self.size)
        return folder

    def examples(self, method: Method, people_seed: int, kind: Kind) -> list[Example]:
        """Examples of every take with poses; the others count as not recognized."""
        return examples(self.generated(method, people_seed), method, self.posture_takes(people_seed), kind)


def examples(folder: Path, method: Method, wanted: Iterable[PostureTake], kind: Kind) -> list[Example]:
    """Examples of the takes that exist and have poses throughout the posture."""
    found = []
    for one in wanted:
        take, timeline = take_path(folder, method, one), one.timeline()
        if not take.is_file():
            continue
        row = Row(0, take, timeline.motion_from_s, timeline.duration_s, one.posture, str(one.person), str(one.repetition))
        try:
            found += examples_of(folder, [row], kind)
        except (ValueError, UserError) as error:
            print(f"{take.name}: {error}", file=sys.stderr)
    return found


def code_of(method: Method) -> str:
    """Digest of the code that a method's takes depend on."""
    digest = hashlib.sha256()
    for place in CODE[method]:
        for path in sorted((ROOT / place).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:10]


@dataclass(frozen=True)
class Report:
    """Progress lines on standard error."""

    words: str
    every: int = 30

    def __call__(self, done: int, of: int, _: str) -> None:
        if done % self.every == 0 or done == of:
            print(f"{self.words}: {done} of {of}", file=sys.stderr, flush=True)
