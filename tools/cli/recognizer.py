"""The command `recognizer`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.options import one_line_errors, rig_at
from zenocap.tools.service_arguments import ServiceArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig


def recognizer(
    rigs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RIG...", help="Rig files, or folders with calibration.toml and videos/.", show_default=False
        ),
    ],
    model: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="Posture model; default: the rig's, else `fifteen`.", show_default=False),
    ] = None,
    commands: Annotated[
        bool, typer.Option("--commands/--no-commands", help="Whether postures trigger the commands of the rigs.")
    ] = True,
    *,
    arguments: ServiceArguments,
) -> None:
    """Run the posture recognizer of one or more rigs.

    Receives poses of the integrator or the tracker, and publishes each posture with its start and end, within half a
    second of its end; a movement that no model explains is published without a label. Runs until Ctrl-C. A rig that
    fails does not stop the others.

    Example: `zenocap recognizer studio.toml lab.toml`
    """
    from zenocap.services.recognizer.shell import run_recognizers

    if arguments.listen and len(rigs) > 1:
        raise typer.BadParameter("--listen with several rigs: allowed: `listen` in the zenoh table of each")
    with one_line_errors(), arguments.running("recognizer") as stopped:
        found = [with_recognizer(rig_at(rig, files=False), model, commands=commands) for rig in rigs]
        options = [arguments.options(rig, "recognizer") for rig in found]
        raise typer.Exit(run_recognizers(list(zip(found, options, strict=True)), stopped))


def with_recognizer(rig: Rig, model: str | None, *, commands: bool = True) -> Rig:
    """The rig with a recognizer: its own, or the defaults.  model: instead of its own.  commands: whether to keep them.

    Raises UserError.
    """
    from zenocap.common.errors import UserError
    from zenocap.common.rig.recognizer import RecognizerTable, find_postures, recognizer_spec
    from zenocap.common.rig.table_errors import TableError

    try:
        spec = rig.recognizer
        if spec is None:
            table = RecognizerTable() if model is None else RecognizerTable(model=model)
            spec = recognizer_spec(table, rig.method, Path())
        elif model is not None:
            spec = replace(spec, model=find_postures(model, Path()))
    except TableError as error:
        raise UserError(f"--{error}" if model is not None else f"rig {rig.name}: recognizer.{error}") from error
    return replace(rig, recognizer=spec if commands else replace(spec, commands=()))
