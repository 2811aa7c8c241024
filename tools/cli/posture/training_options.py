"""Options that the commands which train postures share, and the settings of training that they give."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.options import JointsOption, method_option
from zenocap.tools.option_groups import EXPERT, option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.services.recognizer.training.examples import TrainingSettings

ManifestPath = Annotated[
    Path,
    typer.Argument(
        metavar="MANIFEST", help="CSV: source (take or clip), start, end, posture, person, repetition; or labels."
    ),
]


@dataclass(frozen=True)
class SourceArguments:
    """Sources of a manifest: how rigs and clip folders are tracked, and names of joints."""

    tracked: Path | None = option(
        None, "Folder for takes of tracked rigs and clip folders; default: tracked/ beside MANIFEST.", metavar="DIR"
    )
    method: str | None = method_option("Tracking method of rigs and clip folders; default: the rig's.")
    joints: JointsOption = None


@dataclass(frozen=True)
class TrainingArguments:
    """Settings of training; usual ones are those of the research that chose them."""

    classifier: Literal["forest", "paper"] = option(
        "forest",
        "forest: decision trees over joints, speeds and turns of a segment. paper: the likeliest hidden Markov model.",
    )
    features: Literal["directions", "joint-angles"] = option(
        "directions", "Angles of the hidden Markov models: limb directions, or the paper's ten."
    )
    symbols: int = option(64, "Number of symbols of the codebook.", min=2, max=1024)
    states: int = option(5, "Number of states of each posture's model.", min=1, max=32)
    topology: Literal["left-right", "ergodic"] | None = option(
        None, "Transitions: to the next state only, or to every state."
    )
    scale: Literal["full", "diagonal", "none"] | None = option(
        None, "Normalization of the angles: covariance one, variance one, or none."
    )
    rate: float = option(15.0, "Frames per second that examples are resampled to.", min=1, max=1000)
    seed: int = option(0, "Random seed; equal seeds give identical output.", min=0, max=2**31 - 1)
    ignore: str | None = option(
        None, "Parts of the body that are not used: arms, legs, head.", metavar="PART,...", rich_help_panel=EXPERT
    )

    def settings(self, false_per_hour: float | None = None) -> TrainingSettings:
        """Raises UserError."""
        from zenocap.services.recognizer.ignored_parts import parts_of
        from zenocap.services.recognizer.training.examples import TrainingSettings

        settings = TrainingSettings(
            classifier=self.classifier, features=self.features, symbols=self.symbols, states=self.states, rate=self.rate,
            seed=self.seed, ignored=parts_of(self.ignore or ""), false_per_hour=false_per_hour,
        )  # fmt: skip
        return replace(settings, topology=self.topology or settings.topology, scale=self.scale or settings.scale)
