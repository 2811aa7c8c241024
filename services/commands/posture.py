"""Commands that learn, test and show posture models: posture train, posture evaluate, posture info."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from services.commands.options import JsonOption, Method, OutputOption, one_line_errors
from services.commands.posture_label import label
from services.commands.posture_sources import read_examples
from services.commands.posture_text import lines_of, model_json, outcome_json, outcome_lines, write_confusion

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from services.recognizer.examples import Example, Plan, Scale, Topology
    from services.recognizer.features import Kind
    from services.recognizer.protocols import Outcome

Report = Callable[[int, int, str], None]
HOW = "How to learn"
PICTURES = (".png", ".svg", ".pdf")

ManifestPath = Annotated[
    Path,
    typer.Argument(
        metavar="MANIFEST", help="CSV: source (take or clip), start, end, posture, person, repetition.", show_default=False
    ),
]
FeaturesOption = Annotated[
    Literal["directions", "joint-angles"],
    typer.Option(help="Where limbs point, or the paper's own ten joint angles.", rich_help_panel=HOW),
]
SymbolsOption = Annotated[int, typer.Option(min=2, max=1024, help="Of the codebook.", rich_help_panel=HOW)]
StatesOption = Annotated[int, typer.Option(min=1, max=32, help="Of each posture's model.", rich_help_panel=HOW)]
TopologyOption = Annotated[
    Literal["left-right", "ergodic"] | None,
    typer.Option(help="From each state to the next, or to every one.", rich_help_panel=HOW),
]
ScaleOption = Annotated[
    Literal["full", "diagonal", "none"] | None,
    typer.Option(help="Features of covariance one, of variance one, or as they are.", rich_help_panel=HOW),
]
RateOption = Annotated[
    float, typer.Option(min=1, max=1000, help="Frames per second that examples are resampled to.", rich_help_panel=HOW)
]
SeedOption = Annotated[
    int, typer.Option(min=0, max=2**31 - 1, help="Of chance: the same gives the same bytes.", rich_help_panel=HOW)
]
TrackedOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Takes of rigs and clip folders; default: tracked/ beside MANIFEST."),
]
MethodOption = Annotated[Method | None, typer.Option(help="How rigs and clip folders are tracked; default: the rig's.")]

posture = typer.Typer(help="Teach postures by examples, and see how well they are told apart.", no_args_is_help=True)
posture.command()(label)


@posture.command()
def train(
    manifest: ManifestPath,
    output: OutputOption,
    features: FeaturesOption = "directions",
    symbols: SymbolsOption = 64,
    states: StatesOption = 5,
    topology: TopologyOption = None,
    scale: ScaleOption = None,
    rate: RateOption = 15.0,
    seed: SeedOption = 0,
    tracked: TrackedOption = None,
    method: MethodOption = None,
    as_json: JsonOption = False,
) -> None:
    """Learn one hidden Markov model for each posture of a manifest, and when a movement is none of them.

    Sources are takes (.mcap), motion capture (.bvh, .trc), and rig files or clip folders, which are tracked first.
    Start and end are seconds from the source's start; empty is all of it. What no model should be taken for is learnt by
    leaving people out in turn. An existing output is replaced.

    Example: `zenocap posture train examples.csv -o mine.postures`
    """
    with one_line_errors():
        from services.recognizer.file import write_model
        from services.recognizer.training import train as run_train

        _check_folder(output)
        plan = _plan(features, symbols, states, topology, scale, rate, seed)
        with _progress() as report:
            examples = read_examples(manifest, plan.features, tracked, method, report)
            model = run_train(examples, plan, report)
        write_model(output, model)
        for label, row in zip(model.labels, model.training.figures, strict=True):
            if row.examples == 1:
                typer.echo(f"note: {label!r} has one example: it will hardly be known when others do it", err=True)
        if not any(row.held for row in model.training.figures):
            typer.echo(
                "note: nothing to hold out: everything will be known; two people or repetitions teach more", err=True
            )
    _show(output, as_json)


@posture.command()
def evaluate(
    manifest: ManifestPath,
    protocol: Annotated[
        Literal["both", "paper", "subjects"],
        typer.Option(help="paper: people in training and test, other repetitions. subjects: people never seen."),
    ] = "both",
    features: FeaturesOption = "directions",
    symbols: SymbolsOption = 64,
    states: StatesOption = 5,
    topology: TopologyOption = None,
    scale: ScaleOption = None,
    rate: RateOption = 15.0,
    seed: SeedOption = 0,
    tracked: TrackedOption = None,
    method: MethodOption = None,
    confusion: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Write what was taken for what.")] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FIG", help="Draw the same (.png, .svg, .pdf).")] = None,
    skip_missing: Annotated[bool, typer.Option("--skip-missing", help="Go on without rows that have no angles.")] = False,
    as_json: JsonOption = False,
) -> None:
    """How many examples of a manifest are recognised by models that were learnt from the others.

    Every example is tested once by each protocol, and the likeliest posture is the answer: the paper's Table 2. A posture
    that one person only shows is not tested by `subjects`.

    Example: `zenocap posture evaluate examples.csv --confusion confusion.csv --plot confusion.png`
    """
    missing: list[str] = []
    with one_line_errors():
        for path in (confusion, plot):
            _check_folder(path)
        draw = None if plot is None else _drawing(plot)
        plan = _plan(features, symbols, states, topology, scale, rate, seed)
        with _progress() as report:
            examples = read_examples(manifest, plan.features, tracked, method, report, missing if skip_missing else None)
            outcomes = _outcomes(examples, plan, protocol, report)
        if confusion is not None:
            write_confusion(confusion, outcomes)
        if draw is not None:
            draw(outcomes)
    for words in missing:
        typer.echo(f"missing: {words}", err=True)
    if as_json:
        names = [str(example) for example in examples]
        content = {"missing": missing, "protocols": [outcome_json(outcome, names) for outcome in outcomes]}
        typer.echo(json.dumps(content, ensure_ascii=False))
        return
    for line in outcome_lines(outcomes):
        typer.echo(line)
    if missing:
        typer.echo(f"not tested: {len(missing)} rows without angles")


@posture.command()
def info(
    model: Annotated[
        str, typer.Argument(metavar="MODEL", help="A file, or the name of a shipped model.", show_default=False)
    ],
    as_json: JsonOption = False,
) -> None:
    """What a posture model was learnt from, and how well it told held-out people's postures apart.

    Example: `zenocap posture info mine.postures`
    """
    with one_line_errors():
        from services.recognizer.file import find_model

        path = find_model(model)
    _show(path, as_json)


def _plan(
    features: Kind, symbols: int, states: int, topology: Topology | None, scale: Scale | None, rate: float, seed: int
) -> Plan:
    from services.recognizer.examples import Plan

    plan = Plan(features=features, symbols=symbols, states=states, rate=rate, seed=seed)
    return replace(plan, topology=topology or plan.topology, scale=scale or plan.scale)


def _outcomes(examples: list[Example], plan: Plan, protocol: str, report: Report) -> list[Outcome]:
    """By every protocol that the examples allow.  Raises ExampleError where none is."""
    from services.recognizer.examples import ExampleError
    from services.recognizer.protocols import PROTOCOLS, evaluated

    outcomes, refused = [], []
    for one in PROTOCOLS:
        if protocol in ("both", one):
            try:
                outcomes.append(evaluated(examples, plan, one, report))
            except ExampleError as error:
                refused.append(f"{one}: {error}")
    if not outcomes:
        raise ExampleError("; ".join(refused))
    for words in refused:
        typer.echo(f"note: {words}", err=True)
    return outcomes


def _check_folder(path: Path | None) -> None:
    from services.recognizer.examples import ExampleError

    if path is not None and not path.parent.is_dir():
        raise ExampleError(f"{path}: there is no folder {path.parent}: allowed: a file in a folder that exists")


def _drawing(path: Path) -> Callable[[list[Outcome]], None]:
    """Raises ExampleError where drawing is not installed or the file's kind not known."""
    from services.recognizer.examples import ExampleError

    if path.suffix not in PICTURES:
        raise ExampleError(f"--plot {path}: suffix {path.suffix!r}: allowed: {', '.join(PICTURES)}")
    try:
        from services.recognizer.plot import draw_confusion
    except ImportError:
        raise ExampleError("--plot needs matplotlib: pip install 'zenocap[plots]'") from None
    return lambda outcomes: draw_confusion(path, outcomes)


def _show(path: Path, as_json: bool) -> None:
    with one_line_errors():
        from services.recognizer.file import read_model

        model = read_model(path)
    if as_json:
        typer.echo(json.dumps(model_json(path, model), ensure_ascii=False))
        return
    for line in lines_of(path, model):
        typer.echo(line)


@contextmanager
def _progress() -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task("reading", total=None)
        yield lambda done, of, words: progress.update(bar, completed=done, total=of, description=words)
