"""Comparison of the postures that a model recognizes in a take with its labels."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.services.recognizer.training.stream_evaluation import PostureAnswer, PostureSpan, overlaps

Verdict = Literal["right", "wrong", "unlabelled"]


@dataclass(frozen=True)
class TakeTrial:
    """Recognized postures with their verdicts, and what the model made of the labels.

    missed: ids of labels that no right result belongs to.  labels: number of labels with a posture of the model.
    """

    found: tuple[tuple[PostureAnswer, Verdict], ...]
    missed: tuple[int, ...]
    labels: int


def compare(
    model: PostureModel, found: Sequence[PostureAnswer], labels: Sequence[tuple[int, ManifestRow]], end_s: float
) -> TakeTrial:
    """Compare results with the labels of the take, which ends at `end_s`.

    A result is right when a label of its posture overlaps it by half of the shorter one, wrong when that is only another
    label, or background; else no label is there.  Labels of postures that the model does not have are left out.
    """
    spans = {id: PostureSpan(row.posture, row.start or 0.0, end_s if row.end is None else row.end) for id, row in labels}
    known = [id for id, span in spans.items() if span.label in model.labels]
    judged: list[tuple[PostureAnswer, Verdict]] = []
    explained: set[int] = set()
    for one in found:
        under = [id for id, span in spans.items() if overlaps(span, one)]
        right = [id for id in under if spans[id].label == one.label and id not in explained]
        if right:
            explained.add(right[0])
            judged.append((one, "right"))
        else:
            judged.append((one, "wrong" if under else "unlabelled"))
    missed = tuple(id for id in known if id not in explained)
    return TakeTrial(tuple(judged), missed, len(known))


def words(trial: TakeTrial, trained_on: bool) -> list[str]:
    """Lines on a trial.  trained_on: the take was in the training."""
    counts = Counter(verdict for _, verdict in trial.found)
    right, wrong, unlabelled = counts["right"], counts["wrong"], counts["unlabelled"]
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
