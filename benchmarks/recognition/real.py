"""Real motion: classification of examples from the shared motion capture, and rejection of untrained movements.

The six kinds are CMU's names of its files (subject 02: walk, walk, run, jump, punch, bend and scoop up, sword, broom;
subject 07: walks; 10_01 and 11_01: kick a ball).  Cuts were chosen by the speed of the joints.
"""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.recognition.bench import Bench
from benchmarks.sections import Row as Cells
from benchmarks.sections import Section, Table
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.model import classify
from zenocap.services.recognizer.training.cross_validation import PROTOCOLS, cross_validate
from zenocap.services.recognizer.training.example_files import examples_of, read_features, span
from zenocap.services.recognizer.training.examples import Example, TrainingSettings, resample
from zenocap.services.recognizer.training.manifest import Row, read_manifest, write_manifest
from zenocap.services.recognizer.training.train import train
from zenocap.tools.cli.posture.report import draw_confusion

# Windows of a stride in every walk; a take is held out at a time.
WALKS = {
    "cmu_02_01": 2.8, "cmu_02_02": 2.4, "cmu_07_01": 2.6, "cmu_07_02": 2.7,
    "cmu_07_03": 3.4, "cmu_07_04": 3.7, "cmu_07_05": 4.3, "cmu_07_06": 3.4,
}  # fmt: skip
STRIDE_S, STEP_S, LEAD_S = 1.2, 0.6, 0.05
# By kind: file, boundaries (s) between which each example is; a span of the file is held out at a time.
REPEATED: dict[str, tuple[str, tuple[float, ...], int]] = {
    "run": ("cmu_02_03", (0.0, 0.7, 1.4), 1),
    "punch": ("cmu_02_05", (0.5, 1.75, 3.0, 4.5, 5.75, 7.0, 8.25, 9.5, 10.75, 12.0, 13.25, 14.5), 4),
    "bend": ("cmu_02_06", (1.0, 3.75, 6.5, 9.25, 12.0, 14.75, 17.0), 2),
}
SINGLE_EXAMPLES = (("kick", "cmu_10_01", 3.9, 6.4), ("kick", "cmu_11_01", 2.2, 4.7), ("jump", "cmu_02_04", 0.0, 2.5))
UNTRAINED = ("cmu_02_07", "cmu_02_08")  # a sword, a broom: in windows of UNTRAINED_WINDOW_S
UNTRAINED_WINDOW_S = 1.5


def rows(motions: Path) -> Iterator[Row]:
    """The manifest of the six kinds.  person: a take, or a span of the take where there is only one."""
    for name, until in WALKS.items():
        starts = np.arange(LEAD_S, until - STRIDE_S + 1e-6, STEP_S)
        for number, start in enumerate(starts.tolist()):
            yield Row(0, motions / f"{name}.bvh", start, start + STRIDE_S, "walk", name, str(number))
    for kind, (name, edges, each) in REPEATED.items():
        for number, (start, end) in enumerate(pairwise(edges)):
            person = f"{name}, span {number // each + 1}"
            yield Row(0, motions / f"{name}.bvh", start, end, kind, person, str(number % each))
    for kind, name, start, end in SINGLE_EXAMPLES:
        yield Row(0, motions / f"{name}.bvh", start, end, kind, name, "0")


def missing_motions(motions: Path) -> list[str]:
    """Names of the files of the manifest that do not exist."""
    return sorted({row.source.name for row in rows(motions) if not row.source.is_file()})


def real_examples(bench: Bench) -> list[Example]:
    """Examples of the manifest, which is written into the folder of the report."""
    manifest = bench.out / "real.csv"
    write_manifest(manifest, rows(bench.motions))
    return examples_of(manifest, read_manifest(manifest), DEFAULT)


def real(bench: Bench) -> Section:
    if missing := missing_motions(bench.motions):
        return Section(
            "real", "Real motion", (f"Skipped: {', '.join(missing)} missing (expected beside the checkout).",), ()
        )
    examples = real_examples(bench)
    outcomes = [cross_validate(examples, TrainingSettings(), protocol) for protocol in PROTOCOLS]
    draw_confusion(bench.out / "confusion-real.png", outcomes)
    labels = outcomes[0].labels
    counts: list[Cells] = [
        (f"{one.protocol}: {one.right}/{one.total}", *(f"{c}/{t}" for c, t in zip(one.correct, one.tested, strict=True)))
        for one in outcomes
    ]
    confusions: list[Cells] = [(one.protocol, *pair) for one in outcomes for pair in one.confusions]
    rejections = tuple(_rejections(bench.motions, examples))
    notes = (
        f"{len(examples)} examples of {', '.join(labels)}, from unchanged motion capture (BVH). subjects: another take is "
        "held out, or, of motions recorded only once (run, punch, bend), another span of the same take: easier than "
        "another person. Jump has one example: it is used in training and cannot be tested.",
        "Rejected: movements of untrained kinds, and each kind without its own model.",
    )
    return Section(
        "real",
        "Real motion",
        notes,
        (
            Table("Recognized", ("protocol", *labels), tuple(counts)),
            Table("Confusions", ("protocol", "posture", "recognized as", "times"), tuple(confusions)),
            Table("Rejections", ("movement", "windows", "rejected", "otherwise mostly recognized as"), rejections),
        ),
        ("confusion-real.png",),
    )


def _rejections(motions: Path, examples: list[Example]) -> Iterable[Cells]:
    for name in UNTRAINED:
        motion = read_features(motions / f"{name}.bvh", DEFAULT)
        edges = np.arange(0.0, motion.times_s[-1], UNTRAINED_WINDOW_S)
        windows = [Example("?", name, "0", motion.rate, span(motion, *edge)) for edge in pairwise(edges.tolist())]
        yield _rejection_row(name, examples, windows)
    for label in dict.fromkeys(example.label for example in examples):
        others = [example for example in examples if example.label != label]
        yield _rejection_row(f"{label}, not trained", others, [example for example in examples if example.label == label])


def _rejection_row(name: str, training: list[Example], windows: list[Example]) -> Cells:
    model = train(training, TrainingSettings())
    found = [classify(model, resample(window.features, window.rate, model.rate)) for window in windows]
    accepted = [model.labels[one.best] for one in found if one.accepted]
    most_frequent = max(dict.fromkeys(accepted), key=accepted.count) if accepted else ""
    return name, len(found), len(found) - len(accepted), most_frequent
