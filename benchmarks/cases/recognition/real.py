"""Real motion: classification of motion capture, and rejection of untrained movements.

The six kinds are CMU's names of its files (subject 02: walk, walk, run, jump, punch, bend and scoop up, sword, broom;
subject 07: walks; 10_01 and 11_01: kick a ball).  Cuts were chosen by the speed of the joints.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np

from benchmarks.harness.case import SHARED, Case, Figures, Kind, Quantity, case
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.model import classify
from zenocap.services.recognizer.training.cross_validation import PROTOCOLS, cross_validate
from zenocap.services.recognizer.training.example_files import examples_of, read_features, span
from zenocap.services.recognizer.training.examples import CLASSIFIERS, Classifier, Example, TrainingSettings, resample
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.services.recognizer.training.train import train

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
MOTIONS = SHARED / "motions"


def rows(motions: Path) -> Iterator[ManifestRow]:
    """The manifest of the six kinds.  person: a take, or a span of the take where there is only one."""
    for name, until in WALKS.items():
        starts = np.arange(LEAD_S, until - STRIDE_S + 1e-6, STEP_S)
        for number, start in enumerate(starts.tolist()):
            yield ManifestRow(0, motions / f"{name}.bvh", start, start + STRIDE_S, "walk", name, str(number))
    for kind, (name, edges, each) in REPEATED.items():
        for number, (start, end) in enumerate(pairwise(edges)):
            person = f"{name}, span {number // each + 1}"
            yield ManifestRow(0, motions / f"{name}.bvh", start, end, kind, person, str(number % each))
    for kind, name, start, end in SINGLE_EXAMPLES:
        yield ManifestRow(0, motions / f"{name}.bvh", start, end, kind, name, "0")


def real_examples() -> list[Example]:
    """Examples of the manifest."""
    return examples_of(MOTIONS / "manifest.csv", list(rows(MOTIONS)), DEFAULT)


def run(one: Case) -> Figures:
    """Recognized segments, and rejected ones of untrained kinds.  Options: classifier."""
    settings = TrainingSettings(classifier=cast(Classifier, one.option("classifier", "forest")))
    examples = real_examples()
    outcomes = [cross_validate(examples, settings, protocol) for protocol in PROTOCOLS]
    found: dict[str, float] = {}
    for protocol, each in zip(PROTOCOLS, outcomes, strict=True):
        found[protocol] = 100.0 * each.right / each.total
    untrained = [window for name in UNTRAINED for window in windows_of(name)]
    found["untrained rejected"] = 100.0 * _rejected(examples, untrained, settings)
    walks = [example for example in examples if example.label == "walk"]
    others = [example for example in examples if example.label != "walk"]
    return found | {"walks rejected": 100.0 * _rejected(others, walks, settings)}


def windows_of(name: str) -> list[Example]:
    """An untrained movement in windows."""
    motion = read_features(MOTIONS / f"{name}.bvh", DEFAULT)
    edges = np.arange(0.0, motion.times_s[-1], UNTRAINED_WINDOW_S)
    return [Example("?", name, "0", motion.rate, span(motion, *edge)) for edge in pairwise(edges.tolist())]


def _rejected(training: Sequence[Example], windows: Sequence[Example], settings: TrainingSettings) -> float:
    model = train(list(training), settings)
    found = [classify(model, resample(window.features, window.rate, model.rate)) for window in windows]
    return sum(not one.accepted for one in found) / len(found)


REAL = Kind(
    "real-motion",
    "Segments of motion capture of six kinds (walk, run, punch, bend, kick, jump) that are recognized, by protocol, and of "
    "untrained kinds (sword, broom; walks without a model) that are rejected. Nothing in it is random.",
    run,
    tuple(Quantity(name, "%", 0, "low") for name in (*PROTOCOLS, "untrained rejected", "walks rejected")),
    {classifier: case("motions", classifier=classifier) for classifier in CLASSIFIERS},
    case("motions"),
    seeds=1,
    rows="classifier",
    inputs=lambda _: ("motions",),
)
