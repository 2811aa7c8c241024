"""Commands for model files that are not shipped: models add, models list, models remove."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.options import JsonOption, one_line_errors

if TYPE_CHECKING:
    from zenocap.common.rig.detectors import Detector

Name = Annotated[str, typer.Argument(help="people, or one of an installed package.")]

models = typer.Typer(help="Model files that are not shipped: the network of `people = true`.", no_args_is_help=True)


@models.command()
def add(
    name: Name,
    file: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Wheel of mediapipe (.whl), or the model itself (.tflite), for machines without network.",
        ),
    ] = None,
) -> None:
    """Fetch the model of `people = true`, check it, and keep it in the user's data folder.

    pip downloads a wheel of mediapipe 0.10.14 to 0.10.21 (36 MB) from the index that is set up for it; one file of 0.25 MB
    is kept after its SHA-256 was compared, with a note on its licence (Apache-2.0), and the wheel is deleted. Nothing of
    it is installed or run. It works offline afterwards. A model that is there is left alone.

    Examples: `zenocap models add people`, `zenocap models add people --from selfie_segmentation.tflite`
    """
    with one_line_errors():
        from zenocap.tools.setup.models import store

        detector = _detector(name)
        path, written = store.add(detector, lambda: detector.contents(file))
    typer.echo(f"{path}: {'added' if written else 'is there already'}; in a rig file: {detector.option} of a viewer")


@models.command("list")
def list_models(as_json: JsonOption = False) -> None:
    """List the models: present, missing, or damaged, and the path of each.

    Example: `zenocap models list`
    """
    with one_line_errors():
        from zenocap.common.rig.detectors import DETECTORS
        from zenocap.tools.setup.models.store import state_of

        states = [state_of(detector) for detector in DETECTORS.rows().values() if detector.files]
    if as_json:
        rows = [{"name": one.name, "state": one.state, "path": str(one.path), "size": one.size} for one in states]
        typer.echo(json.dumps({"models": rows}))
        return
    for state in states:
        advice = "" if state.state == "present" else f"; `zenocap models add {state.name}` gets it"
        typer.echo(f"{state.name}: {state.state}: {state.path}{advice}")


@models.command()
def remove(name: Name) -> None:
    """Delete a model from the user's data folder; viewers with `people = true` do not start without it.

    Example: `zenocap models remove people`
    """
    with one_line_errors():
        from zenocap.tools.setup.models import store

        there = store.remove(_detector(name))
    typer.echo(f"{name}: {'removed' if there else 'was not there'}")


def _detector(name: str) -> Detector:
    from zenocap.common.rig.detectors import DETECTORS

    if name not in DETECTORS.names():
        raise typer.BadParameter(f"{name!r}: allowed: {', '.join(DETECTORS.names())}")
    detector = DETECTORS.row(name)
    if not detector.files:
        raise typer.BadParameter(f"{name!r}: needs no model file")
    return detector
