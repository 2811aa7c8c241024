"""Commands that learn, test and show posture models: posture train, posture evaluate, posture info."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.runtime.foreign_text import MAX_LINE, printable
from zenocap.tools.cli.options import JointsOption, JsonOption, Method, OutputOption, one_line_errors
from zenocap.tools.cli.posture.act import act
from zenocap.tools.cli.posture.add import add, train_and_write
from zenocap.tools.cli.posture.label import label
from zenocap.tools.cli.posture.report import (
    draw_confusion,
    outcome_json,
    outcome_lines,
    show_model,
    write_confusion,
)
from zenocap.tools.cli.posture.stream_report import draw_curve, read_streams, stream_json, stream_lines, unsuitable
from zenocap.tools.cli.posture.tracked_sources import read_examples
from zenocap.tools.cli.progress import progress

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.services.recognizer.features import Kind
    from zenocap.services.recognizer.training.cross_validation import Outcome
    from zenocap.services.recognizer.training.examples import Classifier, Example, Scale, Topology, TrainingSettings

Report = Callable[[int, int, str], None]
HOW = "Training"
PICTURES = (".png", ".svg", ".pdf")

ManifestPath = Annotated[
    Path,
    typer.Argument(
        metavar="MANIFEST", help="CSV: source (take or clip), start, end, posture, person, repetition.", show_default=False
    ),
]
ClassifierOption = Annotated[
    Literal["forest", "paper"],
    typer.Option(
        help="forest: decision trees over joints, speeds and turns of a segment. paper: the likeliest hidden Markov model.",
        rich_help_panel=HOW,
    ),
]
FeaturesOption = Annotated[
    Literal["directions", "joint-angles"],
    typer.Option(help="Angles of the hidden Markov models: limb directions, or the paper's ten.", rich_help_panel=HOW),
]
SymbolsOption = Annotated[
    int, typer.Option(min=2, max=1024, help="Number of symbols of the codebook.", rich_help_panel=HOW)
]
StatesOption = Annotated[
    int, typer.Option(min=1, max=32, help="Number of states of each posture's model.", rich_help_panel=HOW)
]
TopologyOption = Annotated[
    Literal["left-right", "ergodic"] | None,
    typer.Option(help="Transitions: to the next state only, or to every state.", rich_help_panel=HOW),
]
ScaleOption = Annotated[
    Literal["full", "diagonal", "none"] | None,
    typer.Option(help="Normalization of the angles: covariance one, variance one, or none.", rich_help_panel=HOW),
]
RateOption = Annotated[
    float, typer.Option(min=1, max=1000, help="Frames per second that examples are resampled to.", rich_help_panel=HOW)
]
SeedOption = Annotated[
    int, typer.Option(min=0, max=2**31 - 1, help="Random seed; equal seeds give identical output.", rich_help_panel=HOW)
]
FalsePerHourOption = Annotated[
    float | None,
    typer.Option(
        metavar="N",
        help="Raise the thresholds until the background has at most N false postures per hour; default: as learnt from "
        "held-out people and background.",
        rich_help_panel=HOW,
    ),
]
IgnoreOption = Annotated[
    str | None,
    typer.Option(metavar="PART,...", help="Parts of the body that are not used: arms, legs, head.", rich_help_panel=HOW),
]
TrackedOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="Folder for takes of tracked rigs and clip folders; default: tracked/ beside MANIFEST."
    ),
]
MethodOption = Annotated[Method | None, typer.Option(help="Tracking method of rigs and clip folders; default: the rig's.")]

posture = typer.Typer(help="Train, evaluate and inspect posture models.", no_args_is_help=True)
posture.command()(label)
posture.command()(act)
posture.command()(add)


@posture.command()
def train(
    manifest: ManifestPath,
    output: OutputOption,
    classifier: ClassifierOption = "forest",
    features: FeaturesOption = "directions",
    symbols: SymbolsOption = 64,
    states: StatesOption = 5,
    topology: TopologyOption = None,
    scale: ScaleOption = None,
    rate: RateOption = 15.0,
    seed: SeedOption = 0,
    ignore: IgnoreOption = None,
    false_per_hour: FalsePerHourOption = None,
    tracked: TrackedOption = None,
    method: MethodOption = None,
    joints: JointsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Train a posture model of the examples in a manifest, and the rejection of other movements.

    Sources are takes (.mcap), motion capture (.bvh, .trc, .c3d), and rig files or clip folders, which are tracked first.
    Start and end are seconds from the start of the source; empty means all of it. Rejection thresholds are trained by
    leaving people out in turn. An existing output is replaced. Beside it, FILE.examples keeps the examples for posture add.

    Example: `zenocap posture train examples.csv -o mine.postures`
    """
    with one_line_errors():
        _check_folder(output)
        settings = _settings(classifier, features, symbols, states, topology, scale, rate, seed, ignore)
        settings = replace(settings, false_per_hour=false_per_hour)
        with progress("reading takes", "takes") as state:
            examples = read_examples(manifest, settings.features, tracked, method, state.update, joints=joints)
        train_and_write(output, examples, settings)
    show_model(output, as_json)


@posture.command()
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
            _check_folder(path)
        draw = None if plot is None else _drawing(plot)
        settings = _settings(classifier, features, symbols, states, topology, scale, rate, seed, ignore)
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
        from zenocap.services.recognizer.stream import stream_setup
        from zenocap.services.recognizer.training.stream_evaluation import evaluate_streams

        _check_folder(plot)
        if plot is not None:
            _check_drawing(plot)
        model = read_model(find_model(name))
        with progress("reading takes", "takes") as state:
            sources = read_streams(manifest, stream_setup(model).kind, tracked, method, state.update, joints)
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


@posture.command()
def info(
    model: Annotated[
        str, typer.Argument(metavar="MODEL", help="A file, or the name of a shipped model.", show_default=False)
    ],
    as_json: JsonOption = False,
) -> None:
    """Show the training data of a posture model and its accuracy on held-out people.

    Example: `zenocap posture info mine.postures`
    """
    with one_line_errors():
        from zenocap.services.recognizer.model_file import find_model

        path = find_model(model)
    show_model(path, as_json)


def _settings(
    classifier: Classifier,
    features: Kind,
    symbols: int,
    states: int,
    topology: Topology | None,
    scale: Scale | None,
    rate: float,
    seed: int,
    ignored: str | None,
) -> TrainingSettings:
    from zenocap.services.recognizer.ignored_parts import parts_of
    from zenocap.services.recognizer.training.examples import TrainingSettings

    settings = TrainingSettings(
        classifier=classifier,
        features=features,
        symbols=symbols,
        states=states,
        rate=rate,
        seed=seed,
        ignored=parts_of(ignored or ""),
    )
    return replace(settings, topology=topology or settings.topology, scale=scale or settings.scale)


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


def _check_folder(path: Path | None) -> None:
    from zenocap.common.errors import UserError

    if path is not None and not path.parent.is_dir():
        raise UserError(f"{path}: there is no folder {path.parent}: allowed: a file in a folder that exists")


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
