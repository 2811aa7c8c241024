"""Options that the commands which train postures share, and the settings of training that they give."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.options import Method

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.services.recognizer.features import Kind
    from zenocap.services.recognizer.training.examples import Classifier, Scale, Topology, TrainingSettings

HOW = "Training"

ManifestPath = Annotated[
    Path,
    typer.Argument(
        metavar="MANIFEST",
        help="CSV: source (take or clip), start, end, posture, person, repetition; or labels.",
        show_default=False,
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
        help="Raise the thresholds until the background shows at most N false postures per hour; default: as learnt from "
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


def settings_of(
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
    """Settings of the options.  Raises UserError."""
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


def check_folder(path: Path | None) -> None:
    """Raise UserError where the folder of a file to write is missing."""
    from zenocap.common.errors import UserError

    if path is not None and not path.parent.is_dir():
        raise UserError(f"{path}: there is no folder {path.parent}: allowed: a file in a folder that exists")
