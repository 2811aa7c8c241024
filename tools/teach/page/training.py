"""Training from the labels of a page, and the held-out result in words."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.services.recognizer.false_alarms import short_background
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import write_model
from zenocap.services.recognizer.training.cross_validation import held_out_results
from zenocap.services.recognizer.training.example_store import store_path, write_examples
from zenocap.services.recognizer.training.examples import (
    BACKGROUND,
    Example,
    Prepared,
    TrainingSettings,
    postures_of,
    prepare,
)
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.services.recognizer.training.thresholds import held_out_groups
from zenocap.services.recognizer.training.train import Report, train
from zenocap.tools.teach.page.messages import PostureRow
from zenocap.tools.teach.page.parameters import ENOUGH_EXAMPLES, MOST_GROUPS
from zenocap.tools.teach.page.training_settings import PageSettings

ReadExamples = Callable[[Sequence[ManifestRow], Report], list[Example]]
"""Examples of rows of a manifest; raises UserError."""


@dataclass(frozen=True)
class HeldOut:
    """An example, and what a model that was trained without it takes it for; None where that model lacks its posture."""

    posture: str
    answer: str | None


@dataclass(frozen=True)
class TrainingResult:
    """Result of a training.  lines: in words, the most important first.  postures: in the order of the model."""

    model: PostureModel
    lines: tuple[str, ...]
    postures: tuple[PostureRow, ...]


def check_rows(rows: Sequence[ManifestRow], settings: TrainingSettings) -> None:
    """Raise UserError for too few different postures, and for a rate of false postures without background."""
    postures = sorted({row.posture for row in rows if row.posture != BACKGROUND})
    if not postures:
        raise UserError("no posture is labelled: allowed for training: two postures, or one and background")
    background = any(row.posture == BACKGROUND for row in rows)
    if len(postures) == 1 and not background:
        raise UserError(f"only {postures[0]!r} is labelled: allowed for training: two postures, or one and background")
    if settings.false_per_hour is not None and not background:
        raise UserError(
            f"false_per_hour = {settings.false_per_hour:g}: no background: allowed for training: with some everyday "
            "movement marked as background"
        )


def train_rows(
    rows: Sequence[ManifestRow], read: ReadExamples, path: Path, chosen: PageSettings, report: Report
) -> TrainingResult:
    """Train a model of the rows and write it to `path`, its examples beside it for `posture add`.  Raises UserError."""
    settings = chosen.training
    check_rows(rows, settings)
    examples = read(rows, report)
    ready = prepare(postures_of(examples), settings)
    held = held_out(ready, settings, report)
    model = train(examples, settings, report)
    try:
        write_model(path, model)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}; the model is not kept") from None
    missing = stored_examples(path, examples, settings)
    background = any(example.label == BACKGROUND for example in examples)
    postures = results_of(ready, held)
    people = len({example.person for example in ready.examples})
    lines = words(postures, held, people, background=background)
    alarms = None if model.forest is None else model.forest.alarms
    short = short_background(alarms, settings.false_per_hour)
    warnings = [] if short is None else [f"Warning: {short}."]
    return TrainingResult(model, (*lines, *warnings, chosen.line, *missing), postures)


def stored_examples(path: Path, examples: Sequence[Example], settings: TrainingSettings) -> list[str]:
    """Write the examples of a model file beside it; a line where they cannot be written, and those of an earlier one go."""
    try:
        write_examples(path, examples, settings)
    except (UserError, OSError) as error:
        with suppress(OSError):
            store_path(path).unlink(missing_ok=True)
        reason = error if isinstance(error, UserError) else f"{store_path(path)}: {error.strerror or error}"
        return [f"The examples are not kept, and posture add cannot extend this model: {reason}"]
    return []


def held_out(ready: Prepared, settings: TrainingSettings, report: Report) -> list[HeldOut]:
    """Results of all examples: people are held out in turn; of one person, repetitions."""
    groups = held_out_groups(ready, MOST_GROUPS)
    found = held_out_results(ready, groups, settings, lambda done, of: report(done, of, "testing with held-out examples"))
    report(len(groups), len(groups), "tested")
    given = {one.example: ready.labels[one.given] for one in found}
    return [HeldOut(example.label, given.get(k)) for k, example in enumerate(ready.examples)]


def results_of(ready: Prepared, held: Sequence[HeldOut]) -> tuple[PostureRow, ...]:
    found = []
    for label in ready.labels:
        own = [example for example in ready.examples if example.label == label]
        answers = [one.answer for one in held if one.posture == label and one.answer is not None]
        people = len({example.person for example in own})
        found.append(PostureRow(label, len(own), people, len(answers), answers.count(label)))
    return tuple(found)


def words(postures: Sequence[PostureRow], held: Sequence[HeldOut], people: int, *, background: bool) -> list[str]:
    """Lines on the held-out result, and on what is missing."""
    of = {one.posture: one.tested for one in postures}
    tested, right = sum(of.values()), sum(one.right for one in postures)
    how = "by a model without that person" if people > 1 else "by a model without that repetition"
    lines = []
    if tested:
        lines.append(f"{right} of {tested} examples are recognized {how}.")
    else:
        lines.append("Nothing could be tested: every posture has one example only.")
    confused = Counter((one.posture, one.answer) for one in held if one.answer is not None and one.answer != one.posture)
    for (posture, answer), count in sorted(confused.items(), key=lambda pair: (-pair[1], pair[0])):
        lines.append(f"Confused: {posture!r} is taken for {answer!r}, {count} of {of[posture]}.")
    for row in postures:
        missing = ENOUGH_EXAMPLES - row.examples
        if missing > 0:
            more = "one more example" if missing == 1 else f"{missing} more examples"
            lines.append(f"{row.posture!r} needs {more}: it has {row.examples}, {ENOUGH_EXAMPLES} are advised.")
        elif row.right < row.tested:
            lines.append(f"{row.posture!r} may need one more example, or a clearer movement.")
    if people == 1:
        lines.append("One person only: other people were not tested; add a take of a second person.")
    if not background:
        lines.append("No background: movements that are no posture may be taken for one; mark some everyday movement.")
    return lines
