"""Options of posture label."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.live_page import DEFAULT_PORT
from zenocap.tools.cli.options import JointsOption, JsonOption
from zenocap.tools.option_groups import option

Sources = Annotated[
    list[Path], typer.Argument(metavar="TAKE...", help="Takes (.mcap), or motion capture (.bvh, .trc, .c3d).")
]

SHIPPED = "fifteen"


@dataclass(frozen=True)
class LabelArguments:
    """output: folder or manifest.  model: that suggests labels.  rig: of a running rig."""

    output: Path | None = option(
        None, "Folder of examples.csv, or a manifest; existing rows are kept. Default: this folder.", "-o", "--output",
        metavar="FOLDER|MANIFEST",
    )  # fmt: skip
    model: str | None = option(
        None, f"Posture model that suggests labels; default: {SHIPPED}, which is built in.", metavar="NAME|FILE"
    )
    person: str = option("1", "Person in the takes.", metavar="NAME")
    rig: Path | None = option(
        None, "Rig file of a running rig, whose poses the page can recognize live with the trained model.", metavar="RIG"
    )
    terminal: bool = option(False, "No page: play and label here; without -o only list.")
    accept: bool = option(False, "Do not ask: accept all suggestions above the model's thresholds.")
    only_list: bool = option(False, "List the candidates only.", "--list")
    joints: JointsOption = None
    as_json: JsonOption = False

    @property
    def has_page(self) -> bool:
        return not (self.terminal or self.accept or self.only_list or self.as_json)


@dataclass(frozen=True)
class LabelExpert:
    """Address of the page, settings of training on it, and playback in the terminal."""

    host: str = option("127.0.0.1", "Address of the page on this machine.")
    port: int | None = option(
        None, f"Port of the page, 0 for any free one; default: {DEFAULT_PORT} or a free one.", min=0, max=65535
    )
    token: str | None = option(
        None, "Access token; required with a --host that other machines can reach. `new` generates one."
    )
    false_per_hour: float | None = option(
        None,
        "Train raises the thresholds until the background shows at most N false postures per hour; default: that "
        "of the model's last training, else no limit.",
        metavar="N",
    )
    ignore: str | None = option(
        None,
        "Parts of the body that Train does not use: arms, legs, head, or '' for none; default: those of the "
        "model's last training, else none.",
        metavar="PART,...",
    )
    play: bool = option(True, "Play every candidate in the terminal.")
    speed: float = option(1.0, "Playback speed of candidates.", min=0.05, max=20)
