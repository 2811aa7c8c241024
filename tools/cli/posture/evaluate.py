"""The command that tests posture models, by cross-validation or on streams: posture evaluate."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.runtime.foreign_text import MAX_LINE, printable
from zenocap.tools.cli.options import JointsOption, JsonOption, Method, one_line_errors
from zenocap.tools.cli.posture.report import draw_confusion, outcome_json, outcome_lines, write_confusion
from zenocap.tools.cli.posture.stream_report import draw_curve, read_streams, stream_json, stream_lines, unsuitable
from zenocap.tools.cli.posture.tracked_sources import read_examples
from zenocap.tools.cli.posture.training_options import (
    ClassifierOption,
    FeaturesOption,
    IgnoreOption,
    ManifestPath,
    MethodOption,
    RateOption,
    ScaleOption,
    SeedOption,
    StatesOption,
    SymbolsOption,
    TopologyOption,
    TrackedOption,
    check_folder,
    settings_of,
)
from zenocap.tools.cli.progress import progress

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.services.recognizer.training.cross_validation import Outcome
    from zenocap.services.recognizer.training.examples import Example, TrainingSettings

Report = Callable[[int, int, str], None]
PICTURES = (".png", ".svg", ".pdf")


def evaluate(
    manifest: ManifestPath,
    model: Annotated[
        str | None,
        typer.Option(metavar="MODEL", help="Run this model on the whole sources as streams, instead of cross-validation."),
    ] = None,
    protocol: Annotated[
        Literal["both", "paper", "subjects"],
        typer.Option(
            help="paper: same people in training and test, other repetitions. subjects: people not in the training set."
        ),
    ] = "both",
    classifier: ClassifierOption = "forest",
    features: FeaturesOption = "directions",
    symbols: SymbolsOption = 64,
    states: StatesOption = 5,
    topology: TopologyOption = None,
    scale: ScaleOption = None,
    rate: RateOption = 15.0,
    seed: SeedOption = 0,
    ignore: IgnoreOption = None,
    tracked: TrackedOption = None,
    method: MethodOption = None,
    joints: JointsOption = None,
    confusion: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Write the confusion matrix.")] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FIG", help="Plot the confusion matrix, of --model the operating curve (.png, .svg, .pdf)."),
    ] = None,
    skip_missing: Annotated[bool, typer.Option("--skip-missing", help="Leave out rows without angles.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Cross-validate a manifest: recognize each example with models trained on others.

    Every example is tested once by each protocol, and the likeliest posture is the answer: the paper's Table 2. A posture
    of one person only is not tested by `subjects`.

    With --model, the sources are streams: rows give what is in them, anything else is none of the postures. Recall,
    precision, false postures per hour and delay of every posture, and the operating curve. Training options have no effect.

    Example: `zenocap posture evaluate examples.csv --confusion confusion.csv --plot confusion.png`
    """
    missing: list[str] = []
    if model is not None:
        if confusion is not None or skip_missing:
            raise typer.BadParameter("--model: allowed without --confusion and --skip-missing")
        _evaluate_streams(manifest, model, tracked, method, joints, plot, as_json)
        return
    with one_line_errors():
        for path in (confusion, plot):
            check_folder(path)
        draw = None if plot is None else _drawing(plot)
        settings = settings_of(classifier, features, symbols, states, topology, scale, rate, seed, ignore)
        with progress("reading takes", "takes") as state:
            examples = read_examples(
                manifest, settings.features, tracked, method, state.update, missing if skip_missing else None, joints
            )
        with progress("evaluating", "models") as state:
            outcomes = _outcomes(examples, settings, protocol, state.update)
        if confusion is not None:
            write_confusion(confusion, outcomes)
        if draw is not None:
            draw(outcomes)
    for text in missing:
        typer.echo(f"missing: {text}", err=True)
    if as_json:
        names = [str(example) for example in examples]
        content = {"missing": missing, "protocols": [outcome_json(outcome, names) for outcome in outcomes]}
        typer.echo(json.dumps(content, ensure_ascii=False))
        return
    for line in outcome_lines(outcomes):
        typer.echo(printable(line, MAX_LINE))
    if missing:
        typer.echo(f"not tested: {len(missing)} rows without angles")


def _evaluate_streams(
    manifest: Path,
    name: str,
    tracked: Path | None,
    method: Method | None,
    joints: Path | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    with one_line_errors():
        from zenocap.common.errors import UserError
        from zenocap.services.recognizer.model_file import find_model, read_model
        from zenocap.services.recognizer.training.stream_evaluation import evaluate_streams

        check_folder(plot)
        if plot is not None:
            _check_drawing(plot)
        model = read_model(find_model(name))
        with progress("reading takes", "takes") as state:
            sources = read_streams(manifest, model.features, tracked, method, state.update, joints)
        outcome = evaluate_streams(model, list(sources.values()))
        if not outcome.hours:
            raise UserError(f"{manifest}: no pose in any source: allowed: sources in which the person is tracked")
        notes = list(unsuitable(model, outcome, list(sources)))
        if plot is not None:
            draw_curve(plot, outcome)
    if as_json:
        typer.echo(json.dumps(stream_json(outcome, notes), ensure_ascii=False))
        return
    for text in notes:
        typer.echo(f"note: {text}", err=True)
    for line in stream_lines(outcome):
        typer.echo(printable(line, MAX_LINE))


def _outcomes(examples: list[Example], settings: TrainingSettings, protocol: str, report: Report) -> list[Outcome]:
    """By every protocol that the examples allow.  Raises UserError where none is."""
    from zenocap.common.errors import UserError
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


def _drawing(path: Path) -> Callable[[list[Outcome]], None]:
    """Raises as `_check_drawing`."""
    _check_drawing(path)
    return lambda outcomes: draw_confusion(path, outcomes)


def _check_drawing(path: Path) -> None:
    """Raises UserError where drawing is not installed or the file's kind not known."""
    from zenocap.common.errors import UserError

    if path.suffix not in PICTURES:
        raise UserError(f"--plot {path}: suffix {path.suffix!r}: allowed: {', '.join(PICTURES)}")
    try:
        import matplotlib  # noqa: F401  # fails here, before anything is trained
    except ImportError:
        raise UserError("--plot needs matplotlib: pip install 'zenocap[plots]'") from None
