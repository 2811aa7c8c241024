"""Command calibrate drift."""

import json
from dataclasses import dataclass
from pathlib import Path

import typer

from zenocap.tools.cli.calibrate.output import ForceOption, check_new, writing
from zenocap.tools.cli.options import LOSS, JsonOption, TakePath, checked_take, one_line_errors
from zenocap.tools.option_groups import option


@dataclass(frozen=True)
class DriftArguments:
    """calibration: of the take.  up_axis: of its world.  output: calibration with the cameras as they are now."""

    calibration: Path | None = option(
        None, "Calibration that the take was recorded with, to be corrected; default: the cameras of the take."
    )
    up_axis: str = option("y", "Up axis of the calibration's world: y or z.")
    output: Path | None = option(None, "Calibration to write with the new poses of moved cameras.", "-o", "--output")
    force: ForceOption = False
    as_json: JsonOption = False


def drift(take: TakePath, *, given: DriftArguments) -> None:
    """Check on a take whether a camera was moved since the calibration, by how much, and where it is now.

    Compares the silhouettes of a person who walks through the area, half a minute of them. With three cameras or more it
    names the moved one; two do not show which one it was. Exit status 3: a camera was moved or could not be checked, or
    views disagree without such a reason.

    Example: `zenocap calibrate drift walk.mcap --calibration calibration.toml -o moved.toml`
    """
    from zenocap.common.camera.calibration_files import read_calibration, write_calibration
    from zenocap.common.rig.folder import plain_name
    from zenocap.tools.setup.calibration.drift_report import (
        contradicts,
        corrected,
        drift_data,
        drift_lines,
        messages_of,
        take_drift,
    )

    output = given.output
    with one_line_errors():
        checked_take(take)
        known = None
        if given.calibration is not None:  # takes have names without characters that keys do not allow
            cameras = read_calibration(given.calibration, given.up_axis)
            known = {plain_name(name): camera for name, camera in cameras.items()}
        if output is not None:
            check_new(output, given.force)
        found, recorded = take_drift(take, messages_of(take))
        if output is not None and found.moved:
            with writing(output):
                write_calibration(output, corrected(found, recorded, known), given.up_axis if known is not None else "y")
    if given.as_json:
        typer.echo(json.dumps(drift_data(found) | {"written": str(output) if output and found.moved else None}, indent=2))
    else:
        typer.echo("\n".join(drift_lines(found)))
        if output is not None:
            typer.echo(f"written: {output}" if found.moved else "nothing is written")
        elif found.moved:
            typer.echo("next: the same with --calibration and -o writes a calibration with the new pose")
    if contradicts(found):
        raise typer.Exit(LOSS)
