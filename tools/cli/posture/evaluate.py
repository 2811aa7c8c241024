"""The command that tests posture models, by cross-validation or on streams: posture evaluate."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import JsonOption, check_folder, check_plot, echo, one_line_errors
from zenocap.tools.cli.posture.report import draw_confusion, show_outcomes, write_confusion
from zenocap.tools.cli.posture.stream_report import draw_curve, read_streams, stream_json, stream_lines, unsuitable
from zenocap.tools.cli.posture.tracked_sources import read_examples
from zenocap.tools.cli.posture.training_options import ManifestPath, SourceArguments, TrainingArguments
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import RESEARCH, option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.services.recognizer.training.cross_validation import ValidationOutcome
    from zenocap.services.recognizer.training.examples import Example, TrainingSettings

Report = Callable[[int, int, str], None]


@dataclass(frozen=True)
class ValidationArguments:
    """model: to run on streams.  protocol: of the cross-validation."""

    model: str | None = option(
        None, "Run this model on the whole sources as streams, instead of cross-validation.", metavar="MODEL"
    )
    protocol: Literal["both", "paper", "subjects"] = option(
        "both", "paper: same people in training and test, other repetitions. subjects: people not in the training set."
    )
    confusion: Path | None = option(None, "Write the confusion matrix.", metavar="FILE.csv")
    plot: Path | None = option(
        None, "Plot the confusion matrix, of --model the operating curve (.png, .jpg, .pdf, .svg).", metavar="FIG"
    )
    skip_missing: bool = option(False, "Leave out rows without angles.")
    as_json: JsonOption = False


def evaluate(
    manifest: ManifestPath, *, given: ValidationArguments, sources: SourceArguments,
    training: Annotated[TrainingArguments, RESEARCH],
) -> None:  # fmt: skip
    """Cross-validate a manifest: recognize each example with models trained on others.

    Every example is tested once by each protocol, and the likeliest posture is the answer: the paper's Table 2. A posture
    of one person only is not tested by `subjects`.

    With --model, the sources are streams: rows give what is in them, anything else is none of the postures. Recall,
    precision, false postures per hour and delay of every posture, and the operating curve. Training options have no effect.

    Example: `zenocap posture evaluate examples.csv --confusion confusion.csv --plot confusion.png`
    """
    if given.model is not None:
        if given.confusion is not None or given.skip_missing:
            raise typer.BadParameter("--model: allowed without --confusion and --skip-missing")
        _evaluate_streams(manifest, given.model, sources, given)
        return
    missing: list[str] = []
    with one_line_errors():
        check_folder(given.confusion)
        check_plot(given.plot)
        settings = training.settings()
        kept = missing if given.skip_missing else None
        with progress("reading takes", "takes") as state:
            examples = read_examples(manifest, settings.features, sources, state.update, kept)
        with progress("evaluating", "models") as state:
            outcomes = _outcomes(examples, settings, given.protocol, state.update)
        if given.confusion is not None:
            write_confusion(given.confusion, outcomes)
        if given.plot is not None:
            draw_confusion(given.plot, outcomes)
    show_outcomes(outcomes, [str(example) for example in examples], missing, as_json=given.as_json)


def _evaluate_streams(manifest: Path, name: str, sources: SourceArguments, given: ValidationArguments) -> None:
    with one_line_errors():
        from zenocap.services.recognizer.model_file import find_model, read_model
        from zenocap.services.recognizer.training.stream_evaluation import evaluate_streams

        check_plot(given.plot)
        model = read_model(find_model(name))
        with progress("reading takes", "takes") as state:
            found = read_streams(manifest, model.features, sources, state.update)
        outcome = evaluate_streams(model, list(found.values()))
        if not outcome.hours:
            raise UserError(f"{manifest}: no pose in any source: allowed: sources in which the person is tracked")
        notes = list(unsuitable(model, outcome, list(found)))
        if given.plot is not None:
            draw_curve(given.plot, outcome)
    if given.as_json:
        typer.echo(json.dumps(stream_json(outcome, notes), ensure_ascii=False))
        return
    for text in notes:
        typer.echo(f"note: {text}", err=True)
    for line in stream_lines(outcome):
        echo(line)


def _outcomes(
    examples: list[Example], settings: TrainingSettings, protocol: str, report: Report
) -> list[ValidationOutcome]:
    """By every protocol that the examples allow.  Raises UserError where none is."""
    from zenocap.services.recognizer.training.cross_validation import PROTOCOLS, cross_validate

    outcomes, refused = [], []
    for one in PROTOCOLS:
        if protocol in ("both", one):
            try:
                outcomes.append(cross_validate(examples, settings, one, report))
            except UserError as error:
                refused.append(f"{one}: {error}")
    if not outcomes:
        raise UserError("; ".join(refused))
    for text in refused:
        typer.echo(f"note: {text}", err=True)
    return outcomes
