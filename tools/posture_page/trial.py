"""Recognition of a whole take with a model, as a stream, and its comparison with the labels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from zenocap.services.recognizer.commands import confidence_of
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.stream import recognitions, stream_setup
from zenocap.services.recognizer.training.example_files import Features
from zenocap.services.recognizer.training.examples import BACKGROUND
from zenocap.services.recognizer.training.manifest import Row
from zenocap.tools.posture_page.parameters import OVERLAP

Verdict = Literal["right", "wrong", "unlabelled"]


@dataclass(frozen=True)
class Found:
    """A recognized posture, seconds of the take.  confidence: 0 to 1, as of commands."""

    start_s: float
    end_s: float
    posture: str
    confidence: float


@dataclass(frozen=True)
class TakeTrial:
    """Recognized postures with their verdicts, and what the model made of the labels.

    missed: ids of labels that no right result belongs to.  labels: number of labels with a posture of the model.
    """

    found: tuple[tuple[Found, Verdict], ...]
    missed: tuple[int, ...]
    labels: int

    def count(self, verdict: Verdict) -> int:
        """Number of results with a verdict."""
        return sum(one == verdict for _, one in self.found)


def recognized(model: PostureModel, motion: Features) -> list[Found]:
    """Postures in a motion, in the order in which a recognizer publishes them."""
    times_ns, found = [round(time_s * 1e9) for time_s in motion.times_s.tolist()], []
    for _, answer in recognitions(stream_setup(model), times_ns, motion.features):
        if answer.label is not None:
            scores = answer.classification
            confidence = confidence_of(float(scores.scores[scores.best]), scores.margin, len(model.labels))
            found.append(Found(answer.start_ns / 1e9, answer.end_ns / 1e9, answer.label, confidence))
    return found


def compare(model: PostureModel, found: Sequence[Found], labels: Sequence[tuple[int, Row]], end_s: float) -> TakeTrial:
    """Compare results with the labels of the take, which ends at `end_s`.

    A result is right when a label of its posture overlaps it by half of the shorter one, wrong when that is only another
    label, or background; else no label is there.  Labels of postures that the model does not have are left out.
    """
    known = [(id, row) for id, row in labels if row.posture in model.labels]
    judged: list[tuple[Found, Verdict]] = []
    explained: set[int] = set()
    for one in found:
        under = [(id, row) for id, row in labels if _overlaps(one, row, end_s)]
        right = [id for id, row in under if row.posture == one.posture and id not in explained]
        if right:
            explained.add(right[0])
            judged.append((one, "right"))
        else:
            judged.append((one, "wrong" if under else "unlabelled"))
    missed = tuple(id for id, _ in known if id not in explained)
    return TakeTrial(tuple(judged), missed, len(known))


def words(trial: TakeTrial, trained_on: bool) -> list[str]:
    """Lines on a trial.  trained_on: the take was in the training."""
    right, wrong, unlabelled = (trial.count(verdict) for verdict in ("right", "wrong", "unlabelled"))
    lines = []
    if trial.labels:
        lines.append(f"{right} of {trial.labels} labels are recognized at their place; {wrong} results are wrong.")
    else:
        lines.append(f"{right + wrong + unlabelled} postures are recognized; no label of these postures is in this take.")
    if unlabelled and trial.labels:
        lines.append(f"{unlabelled} results are where no label is.")
    if trained_on and trial.labels:
        lines.append("The model was trained on this take: a take of another day or person is the honest test.")
    return lines


def _overlaps(one: Found, row: Row, end_s: float) -> bool:
    begin, end = row.start or 0.0, end_s if row.end is None else row.end
    shared = min(one.end_s, end) - max(one.start_s, begin)
    length = one.end_s - one.start_s if row.posture == BACKGROUND else min(one.end_s - one.start_s, end - begin)
    return shared >= OVERLAP * length > 0.0
