"""Commands that learn, test and show posture models: posture train, posture evaluate, posture info."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from services.commands.options import JsonOption, Method, OutputOption, one_line_errors
from services.commands.posture_text import lines_of, model_json, outcome_json, outcome_lines, write_confusion

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from services.recognizer.training import Plan

MANIFEST_HELP = "CSV: source (or take, clip), start, end, posture, person, repetition."
HOW = "How to learn"

ManifestPath = Annotated[Path, typer.Argument(metavar="MANIFEST", help=MANIFEST_HELP, show_default=False)]
FeaturesOption = Annotated[
    Literal["directions", "joint-angles"],
    typer.Option(help="Where limbs point, or the paper's own ten angles.", rich_help_panel=HOW),
]
SymbolsOption = Annotated[int, typer.Option(min=2, max=1024, help="Of the codebook.", rich_help_panel=HOW)]
StatesOption = Annotated[int, typer.Option(min=1, max=32, help="Of each posture's model.", rich_help_panel=HOW)]
TopologyOption = Annotated[
    Literal["left-right", "ergodic"] | None,
    typer.Option(help="From each state to the next, or to every one; default: the better one.", rich_help_panel=HOW),
]
ScaleOption = Annotated[
    Literal["full", "diagonal", "none"] | None,
    typer.Option(help="Features whitened, each of variance one, or radians.", rich_help_panel=HOW),
]
RateOption = Annotated[
    float, typer.Option(min=1, max=1000, help="Frames per second that examples are resampled to.", rich_help_panel=HOW)
]
SeedOption = Annotated[int, typer.Option(min=0, help="Of chance: the same gives the same bytes.", rich_help_panel=HOW)]
TrackedOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="Where takes of the rigs and clip folders go; default: tracked/ beside MANIFEST.",
        show_default=False,
    ),
]  # fmt: skip
MethodOption = Annotated[
    Method | None, typer.Option(help="How rigs and clip folders are tracked; default: as each rig says.")
]

posture = typer.Typer(help="Teach postures by examples, and see how well they are told apart.", no_args_is_help=True)
