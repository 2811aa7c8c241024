"""Real motion: the shared motion capture cut into examples, told apart, and what nobody taught refused.

The six kinds are CMU's own words for its files (subject 02: walk, walk, run, jump, punch, bend and scoop up, sword, broom;
subject 07: walks; 10_01 and 11_01: kick a ball).  Cuts were read off the speed of the joints.
"""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from services.recognizer.features import DEFAULT
from services.recognizer.manifest import Row, read_manifest, write_manifest
from services.recognizer.model import judge
from services.recognizer.plot import draw_confusion
from services.recognizer.protocols import PROTOCOLS, evaluated
from services.recognizer.reading import examples_of, features_in, stretch
from services.recognizer.sequences import resampled
from services.recognizer.training import Example, Plan, train
from tests.evaluation.recognition.bench import Bench
from tests.evaluation.sections import Row as Cells
from tests.evaluation.sections import Section, Table

# Windows of a stride in every walk; who is held out is a take.
WALKS = {
    "cmu_02_01": 2.8, "cmu_02_02": 2.4, "cmu_07_01": 2.6, "cmu_07_02": 2.7,
    "cmu_07_03": 3.4, "cmu_07_04": 3.7, "cmu_07_05": 4.3, "cmu_07_06": 3.4,
}  # fmt: skip
STRIDE_S, STEP_S, LEAD_S = 1.2, 0.6, 0.05
# By kind: file, edges in seconds between which each example lies; who is held out is a stretch of the file.
REPEATED: dict[str, tuple[str, tuple[float, ...], int]] = {
    "run": ("cmu_02_03", (0.0, 0.7, 1.4), 1),
    "punch": ("cmu_02_05", (0.5, 1.75, 3.0, 4.5, 5.75, 7.0, 8.25, 9.5, 10.75, 12.0, 13.25, 14.5), 4),
    "bend": ("cmu_02_06", (1.0, 3.75, 6.5, 9.25, 12.0, 14.75, 17.0), 2),
}
ONCE = (("kick", "cmu_10_01", 3.9, 6.4), ("kick", "cmu_11_01", 2.2, 4.7), ("jump", "cmu_02_04", 0.0, 2.5))
STRANGERS = ("cmu_02_07", "cmu_02_08")  # a sword, a broom: in windows of STRANGE_S
STRANGE_S = 1.5


def rows(motions: Path) -> Iterator[Row]:
    """The manifest of the six kinds.  person: a take, or a stretch of one where there is one take only."""
    for name, until in WALKS.items():
        starts = np.arange(LEAD_S, until - STRIDE_S + 1e-6, STEP_S)
        for number, start in enumerate(starts.tolist()):
            yield Row(0, motions / f"{name}.bvh", start, start + STRIDE_S, "walk", name, str(number))
    for kind, (name, edges, each) in REPEATED.items():
        for number, (start, end) in enumerate(pairwise(edges)):
            person = f"{name}, stretch {number // each + 1}"
            yield Row(0, motions / f"{name}.bvh", start, end, kind, person, str(number % each))
    for kind, name, start, end in ONCE:
        yield Row(0, motions / f"{name}.bvh", start, end, kind, name, "0")


def real(bench: Bench) -> Section:
    missing = sorted({row.source.name for row in rows(bench.motions) if not row.source.is_file()})
    if missing:
        return Section(
            "real", "Real motion", (f"Skipped: {', '.join(missing)} not there (they lie beside the checkout).",), ()
        )
    manifest = bench.out / "real.csv"
    write_manifest(manifest, rows(bench.motions))
    examples = examples_of(manifest, read_manifest(manifest), DEFAULT)
    outcomes = [evaluated(examples, Plan(), protocol) for protocol in PROTOCOLS]
    draw_confusion(bench.out / "confusion-real.png", outcomes)
    labels = outcomes[0].labels
    counts: list[Cells] = [
        (f"{one.protocol}: {one.right}/{one.total}", *(f"{c}/{t}" for c, t in zip(one.correct, one.tested, strict=True)))
        for one in outcomes
    ]
    taken: list[Cells] = [(one.protocol, *pair) for one in outcomes for pair in one.confusions]
    refused = tuple(_refused(bench.motions, examples))
    notes = (
        f"{len(examples)} examples of {', '.join(labels)}, from motion capture as it is (BVH). subjects: another take is "
        "held out, or, of what was recorded once only (run, punch, bend), another stretch of the same take: easier than "
        "another person. Of jump there is one example: it stands against the others and cannot be tested.",
        "Refused: movements of kinds that nobody taught, and each kind with its own model left out.",
    )
    return Section(
        "real",
        "Real motion",
        notes,
        (
            Table("Recognised", ("protocol", *labels), tuple(counts)),
            Table("Taken for another", ("protocol", "posture", "taken for", "times"), tuple(taken)),
            Table("None of these", ("movement", "windows", "refused", "taken mostly for"), refused),
        ),
        ("confusion-real.png",),
    )


def _refused(motions: Path, examples: list[Example]) -> Iterable[Cells]:
    for name in STRANGERS:
        motion = features_in(motions / f"{name}.bvh", DEFAULT)
        edges = np.arange(0.0, motion.times_s[-1], STRANGE_S)
        windows = [Example("?", name, "0", motion.rate, stretch(motion, *edge)) for edge in pairwise(edges.tolist())]
        yield _judged(name, examples, windows)
    for label in dict.fromkeys(example.label for example in examples):
        others = [example for example in examples if example.label != label]
        yield _judged(f"{label}, not taught", others, [example for example in examples if example.label == label])


def _judged(name: str, taught: list[Example], windows: list[Example]) -> Cells:
    model = train(taught, Plan())
    found = [judge(model, resampled(window.features, window.rate, model.rate)) for window in windows]
    known = [model.labels[one.best] for one in found if one.known]
    most = max(dict.fromkeys(known), key=known.count) if known else ""
    return name, len(found), len(found) - len(known), most
