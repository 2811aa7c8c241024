"""Commands that train a posture model: posture train, posture add."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import JsonOption, OutputOption, check_folder, one_line_errors
from zenocap.tools.cli.posture.report import show_model
from zenocap.tools.cli.posture.tracked_sources import read_examples
from zenocap.tools.cli.posture.training_options import ManifestPath, SourceArguments, TrainingArguments
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import EXPERT, RESEARCH, option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from collections.abc import Sequence

    from zenocap.services.recognizer.training.examples import Example, TrainingSettings


@dataclass(frozen=True)
class AlarmArguments:
    """The rate of false postures that is accepted."""

    false_per_hour: float | None = option(
        None,
        "Raise the thresholds until the background shows at most N false postures per hour; default: as learnt "
        "from held-out people and background.",
        metavar="N",
    )


def train(
    manifest: ManifestPath, output: OutputOption, *, as_json: JsonOption = False, sources: SourceArguments,
    alarms: Annotated[AlarmArguments, EXPERT], training: Annotated[TrainingArguments, RESEARCH],
) -> None:  # fmt: skip
    """Train a posture model of the examples in a manifest, and the rejection of other movements.

    Sources are takes (.mcap), motion capture (.bvh, .trc, .c3d), and rig files or clip folders, which are tracked first.
    Start and end are seconds from the start of the source; empty means all of it. Rejection thresholds are trained by
    leaving people out in turn. An existing output is replaced. Beside it, FILE.examples keeps the examples for posture add.

    Example: `zenocap posture train examples.csv -o mine.postures`
    """
    with one_line_errors():
        check_folder(output)
        settings = training.settings(alarms.false_per_hour)
        with progress("reading takes", "takes") as state:
            examples = read_examples(manifest, settings.features, sources, state.update)
        train_and_write(output, examples, settings)
    show_model(output, as_json)


def add(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Model of posture train, with its .examples beside it.")],
    manifest: ManifestPath,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Write the new model here; default: replace MODEL."),
    ] = None,
    as_json: JsonOption = False,
    *,
    sources: SourceArguments,
) -> None:
    """Add examples of known or new postures to a model; the sources of the old ones are not needed.

    The model is trained again with the settings of its first training and with all examples: those in the file .examples
    beside it, which posture train writes, and the further ones. The result is that of training with all of them at once.

    Example: `zenocap posture add mine.postures tuesday.csv`
    """
    with one_line_errors():
        from zenocap.services.recognizer.training.example_store import joined, read_stored, store_path

        store = store_path(model)
        if not store.is_file():
            raise UserError(
                f"{store}: no such file: allowed: a model with its examples, which posture train writes beside it"
            )
        stored, settings = read_stored(model)
        with progress("reading takes", "takes") as state:
            further = read_examples(manifest, settings.features, sources, state.update)
        train_and_write(output or model, joined(stored, further), settings)
    show_model(output or model, as_json)


def train_and_write(output: Path, examples: Sequence[Example], settings: TrainingSettings) -> None:
    """Write a model and its examples; warnings and notes go to standard error.  Raises UserError and OSError."""
    from zenocap.services.recognizer.false_alarms import short_background
    from zenocap.services.recognizer.model_file import write_model
    from zenocap.services.recognizer.training.example_store import store_path, write_examples
    from zenocap.services.recognizer.training.train import train as run_train

    if store_path(output) == output:
        raise UserError(
            f"{output}: suffix {output.suffix!r}: allowed: any other, such as .postures; it is that of the examples"
        )
    with progress("training", "models") as state:
        model = run_train(examples, settings, state.update)
    write_model(output, model)
    try:
        write_examples(output, examples, settings)
    except UserError as error:
        store_path(output).unlink(missing_ok=True)  # of an earlier model
        typer.echo(f"note: {error}; posture add cannot extend this model", err=True)
    alarms = None if model.forest is None else model.forest.alarms
    if (short := short_background(alarms, settings.false_per_hour)) is not None:
        typer.echo(f"warning: {short}", err=True)
    for label, row in zip(model.labels, model.training.figures, strict=True):
        if row.examples == 1:
            typer.echo(f"note: {label!r} has one example: recognition of other people is unlikely", err=True)
    if not any(row.held for row in model.training.figures):
        typer.echo("note: nothing to hold out: no movement will be rejected; add a second person or repetition", err=True)
