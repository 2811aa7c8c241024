"""Output of the posture commands: text, JSON and CSV."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from zenocap.tools.cli.options import echo, one_line_errors

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.services.recognizer.false_alarms import FalseAlarms
    from zenocap.services.recognizer.model import PostureModel
    from zenocap.services.recognizer.training.cross_validation import ValidationOutcome

NAMES_SHOWN, CONFUSIONS_SHOWN = 8, 12


def show_model(path: Path, as_json: bool) -> None:
    """Print the description of a model file; a file that is none ends the command with one line."""
    with one_line_errors():
        from zenocap.services.recognizer.model_file import read_model

        model = read_model(path)
    if as_json:
        typer.echo(json.dumps(model_json(path, model), ensure_ascii=False))
        return
    for line in lines_of(path, model):
        echo(line)


def lines_of(path: Path, model: PostureModel) -> Iterator[str]:
    """Description of a posture model as text lines."""
    training = model.training
    size = f"{path.stat().st_size / 1000:.0f} kB" if path.is_file() else ""
    yield f"model       {path}: {size}"
    examples = sum(row.examples for row in training.figures)
    yield f"trained on  {examples} examples, {training.frames} frames at {model.rate:g}/s"
    yield f"people      {_names(training.people)}"
    trees = "" if model.forest is None else f"{len(model.forest.nodes)} trees over segments; "
    models = f"hidden Markov models of {model.features}: {model.symbols} symbols, {model.states} states each"
    yield f"classifier  {trees}{models}"
    yield f"settings    {', '.join(f'{name} {value}' for name, value in training.settings.items())}"
    if model.forest is not None and (alarms := model.forest.alarms) is not None:
        raised = (
            f"{model.training.settings.get('false_per_hour', '?')}/h asked for; thresholds of at least {alarms.least:.3f}"
        )
        yield f"false       {raised}; {alarms}"
    yield ""
    yield "held out: recognized by a model without that person's examples; accepted: of these, above the threshold;"
    yield "rejected: below the threshold, of the examples for which it is likeliest without their own model"
    width = max(len("posture"), *map(len, model.labels))
    headings = " ".join(f"{heading:>9}" for heading in ("held out", "accepted", "rejected", "seconds"))
    yield f"{'posture':{width}} {'examples':>8} {'people':>6} {headings}"
    for k, (label, row) in enumerate(zip(model.labels, training.figures, strict=True)):
        shortest, _, longest = model.durations[k]
        counts = (f"{row.recognised}/{row.held}", f"{row.accepted}/{row.held}", f"{row.refused}/{row.strangers}")
        cells = " ".join(f"{cell:>9}" for cell in (*counts, f"{shortest:.1f}-{longest:.1f}"))
        yield f"{label:{width}} {row.examples:8d} {row.people:6d} {cells}"


def model_json(path: Path, model: PostureModel) -> dict[str, object]:
    """The same as JSON; durations in seconds."""
    return {
        "file": str(path), "classifier": "paper" if model.forest is None else "forest", "features": model.features,
        "rate": model.rate, "symbols": model.symbols, "states": model.states, "labels": list(model.labels),
        "durations": model.durations.tolist(),
        "thresholds": (model if model.forest is None else model.forest).thresholds.tolist(),
        "false_postures": None if model.forest is None else _alarms_json(model.forest.alarms),
        "training": asdict(model.training),
    }  # fmt: skip


def _alarms_json(alarms: FalseAlarms | None) -> dict[str, object] | None:
    if alarms is None:
        return None
    return {
        "background_hours": alarms.hours, "found": alarms.count, "per_hour": alarms.per_hour,
        "most_per_hour": alarms.most_per_hour, "least_share": alarms.least,
    }  # fmt: skip


def show_outcomes(
    outcomes: Sequence[ValidationOutcome], examples: Sequence[str], missing: Sequence[str], *, as_json: bool
) -> None:
    """Print the results of the protocols.  examples: their names.  missing: rows without angles, in words."""
    for text in missing:
        typer.echo(f"missing: {text}", err=True)
    if as_json:
        content = {"missing": missing, "protocols": [outcome_json(outcome, examples) for outcome in outcomes]}
        typer.echo(json.dumps(content, ensure_ascii=False))
        return
    for line in outcome_lines(outcomes):
        echo(line)
    if missing:
        typer.echo(f"not tested: {len(missing)} rows without angles")


def outcome_lines(outcomes: Sequence[ValidationOutcome]) -> Iterator[str]:
    """Correct recognitions by posture as [Two-view Table 2], and the confusions."""
    labels = outcomes[0].labels
    width = max(len("posture"), *map(len, labels))
    yield f"{'posture':{width}} " + " ".join(f"{outcome.protocol:>9}" for outcome in outcomes)
    for k, label in enumerate(labels):
        cells = (f"{outcome.correct[k]}/{outcome.tested[k]}" if outcome.tested[k] else "-" for outcome in outcomes)
        yield f"{label:{width}} " + " ".join(f"{cell:>9}" for cell in cells)
    yield f"{'all':{width}} " + " ".join(f"{f'{outcome.right}/{outcome.total}':>9}" for outcome in outcomes)
    yield f"{'':{width}} " + " ".join(f"{100 * outcome.right / outcome.total:8.1f}%" for outcome in outcomes)
    for outcome in outcomes:
        wrong = outcome.confusions
        if wrong:
            shown = ", ".join(f"{true} as {given} {count}" for true, given, count in wrong[:CONFUSIONS_SHOWN])
            more = len(wrong) - CONFUSIONS_SHOWN
            yield f"{outcome.protocol}: {shown}" + (f" and {more} more kinds" if more > 0 else "")
        untested = [label for label, count in zip(labels, outcome.tested, strict=True) if not count]
        if untested:
            yield f"{outcome.protocol}: not tested, because no other person performs it: {', '.join(untested)}"


def outcome_json(outcome: ValidationOutcome, names: Sequence[str]) -> dict[str, object]:
    """names: of the examples, for those that were not recognized."""
    wrong = [
        {
            "example": names[answer.example], "posture": outcome.labels[answer.true],
            "answer": outcome.labels[answer.given],
            "margin": round(answer.margin, 6) if isfinite(answer.margin) else None,
        }
        for answer in outcome.answers if answer.true != answer.given
    ]  # fmt: skip
    return {
        "protocol": outcome.protocol, "people": outcome.people, "right": outcome.right, "total": outcome.total,
        "labels": list(outcome.labels), "correct": outcome.correct.tolist(), "tested": outcome.tested.tolist(),
        "confusion": outcome.confusion.tolist(), "wrong": wrong,
    }  # fmt: skip


def write_confusion(path: Path, outcomes: Sequence[ValidationOutcome]) -> None:
    """CSV: a row for each protocol and posture, a column for each answer.  Raises OSError."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["protocol", "posture", *outcomes[0].labels])
        for outcome in outcomes:
            for label, row in zip(outcome.labels, outcome.confusion, strict=True):
                writer.writerow([outcome.protocol, label, *row.tolist()])


def _names(names: Sequence[str]) -> str:
    more = len(names) - NAMES_SHOWN
    return f"{len(names)}: {', '.join(names[:NAMES_SHOWN])}" + (f" and {more} more" if more > 0 else "")


TITLES = {"paper": "the paper's protocol", "subjects": "leave-subjects-out"}


def draw_confusion(path: Path, outcomes: Sequence[ValidationOutcome]) -> None:
    """Write a picture in the format of `path`'s suffix: a matrix for each outcome, rows true.

    Raises OSError, and ImportError without matplotlib.
    """
    import numpy as np
    from matplotlib.figure import Figure

    count = len(outcomes[0].labels)
    side = 2.5 + 0.32 * count
    figure = Figure(figsize=(len(outcomes) * side, side), layout="constrained")
    for at, outcome in enumerate(outcomes):
        axes = figure.add_subplot(1, len(outcomes), at + 1)
        confusion, tested = outcome.confusion, outcome.tested
        axes.imshow(confusion / np.maximum(tested, 1)[:, None], cmap="Blues", vmin=0.0, vmax=1.0)
        for true, given in zip(*np.nonzero(confusion), strict=True):
            dark = 2 * confusion[true, given] > tested[true]
            axes.text(
                given, true, str(confusion[true, given]), ha="center", va="center", color="white" if dark else "black",
                size=8,
            )  # fmt: skip
        axes.set_xticks(range(count), outcome.labels, rotation=90, size=8)
        axes.set_yticks(range(count), outcome.labels if at == 0 else [""] * count, size=8)
        axes.set(xlabel="recognized as", ylabel="posture" if at == 0 else "")
        axes.set_title(f"{TITLES[outcome.protocol]}: {outcome.right} of {outcome.total}", size=10)
    figure.savefig(path, dpi=150)
