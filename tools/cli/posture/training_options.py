"""Options that the commands which train postures share, and the settings of training that they give."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.expansion import EXPERT
from zenocap.tools.cli.options import JointsOption, Method

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.services.recognizer.training.examples import TrainingSettings

ManifestPath = Annotated[
    Path,
    typer.Argument(
        metavar="MANIFEST",
        help="CSV: source (take or clip), start, end, posture, person, repetition; or labels.",
        show_default=False,
    ),
]


@dataclass(frozen=True)
class SourceArguments:
    """Sources of a manifest: how rigs and clip folders are tracked, and names of joints."""

    tracked: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for takes of tracked rigs and clip folders; default: tracked/ beside MANIFEST."
        ),
    ] = None
    method: Annotated[Method | None, typer.Option(help="Tracking method of rigs and clip folders; default: the rig's.")] = (
        None
    )
    joints: JointsOption = None


@dataclass(frozen=True)
class TrainingArguments:
    """Settings of training; usual ones are those of the research that chose them."""

    classifier: Annotated[
        Literal["forest", "paper"],
        typer.Option(
            help="forest: decision trees over joints, speeds and turns of a segment. paper: the likeliest hidden Markov "
            "model.",
        ),
    ] = "forest"
    features: Annotated[
        Literal["directions", "joint-angles"],
        typer.Option(help="Angles of the hidden Markov models: limb directions, or the paper's ten."),
    ] = "directions"
    symbols: Annotated[int, typer.Option(min=2, max=1024, help="Number of symbols of the codebook.")] = 64
    states: Annotated[int, typer.Option(min=1, max=32, help="Number of states of each posture's model.")] = 5
    topology: Annotated[
        Literal["left-right", "ergodic"] | None,
        typer.Option(help="Transitions: to the next state only, or to every state."),
    ] = None
    scale: Annotated[
        Literal["full", "diagonal", "none"] | None,
        typer.Option(help="Normalization of the angles: covariance one, variance one, or none."),
    ] = None
    rate: Annotated[float, typer.Option(min=1, max=1000, help="Frames per second that examples are resampled to.")] = 15.0
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, help="Random seed; equal seeds give identical output.")] = 0
    ignore: Annotated[
        str | None,
        typer.Option(
            metavar="PART,...", help="Parts of the body that are not used: arms, legs, head.", rich_help_panel=EXPERT
        ),
    ] = None

    def settings(self, false_per_hour: float | None = None) -> TrainingSettings:
        """Raises UserError."""
        from zenocap.services.recognizer.ignored_parts import parts_of
        from zenocap.services.recognizer.training.examples import TrainingSettings

        settings = TrainingSettings(
            classifier=self.classifier,
            features=self.features,
            symbols=self.symbols,
            states=self.states,
            rate=self.rate,
            seed=self.seed,
            ignored=parts_of(self.ignore or ""),
            false_per_hour=false_per_hour,
        )
        return replace(settings, topology=self.topology or settings.topology, scale=self.scale or settings.scale)
