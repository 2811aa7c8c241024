"""The command that tells postures on the network: recognizer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from services.commands.live import WithParentOption
from services.commands.options import (
    ConfigOption,
    ConnectOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    one_line_errors,
    rig_at,
    zenoh_options,
)

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from common.runtime.rig import Rig


def recognizer(
    rigs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RIG...", help="Rig files, or folders with calibration.toml and videos/.", show_default=False
        ),
    ],
    model: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="Which postures; default: the rig's, else `fifteen`.", show_default=False),
    ] = None,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
    with_parent: WithParentOption = False,
) -> None:
    """The recogniser of one or more rigs: says which posture the person takes, and when it began and ended.

    It listens to the poses of the integrator or the tracker, whichever the rig has, and says each posture within half a
    second of its end; of a movement that none of its postures explains it says so. It runs until Ctrl-C. A rig that fails
    does not stop the others.

    Example: `zenocap recognizer studio.toml lab.toml`
    """
    from common.runtime import logs
    from common.runtime.signals import stop_signals
    from services.recognizer.shell import run_recognizers

    logs.configure("recognizer")
    if listen and len(rigs) > 1:
        raise typer.BadParameter("--listen with several rigs: allowed: `listen` in the zenoh table of each")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        found = [with_recognizer(rig_at(rig, files=False), model) for rig in rigs]
        options = [zenoh_options(rig, mode, connect, listen, config, no_multicast_scouting, "recognizer") for rig in found]
        raise typer.Exit(run_recognizers(list(zip(found, options, strict=True)), stopped))


def with_recognizer(rig: Rig, model: str | None) -> Rig:
    """The rig with a recogniser: its own, or the defaults.  model: instead of its own.  Raises RigError."""
    from common.runtime.recognizer_table import RecognizerError, RecognizerTable, find_postures, recognizer_spec
    from common.runtime.rig import RigError

    try:
        spec = rig.recognizer
        if spec is None:
            table = RecognizerTable() if model is None else RecognizerTable(model=model)
            spec = recognizer_spec(table, rig.method, rig.tracker is not None, Path())
        elif model is not None:
            spec = replace(spec, model=find_postures(model, Path()))
    except RecognizerError as error:
        raise RigError(f"--{error}" if model is not None else f"rig {rig.name}: recognizer.{error}") from error
    return replace(rig, recognizer=spec)
