"""The commands `zenocap posture ...`, put together; posture info is here."""

from __future__ import annotations

from typing import Annotated

import typer

from zenocap.tools.cli.options import JsonOption, one_line_errors
from zenocap.tools.cli.posture.act import act
from zenocap.tools.cli.posture.evaluate import evaluate
from zenocap.tools.cli.posture.label import label
from zenocap.tools.cli.posture.report import show_model
from zenocap.tools.cli.posture.train import add, train
from zenocap.tools.option_groups import add_command

posture = typer.Typer(help="Train, evaluate and inspect posture models.", no_args_is_help=True)
for command in (label, act, train, add, evaluate):
    add_command(posture, command)


@posture.command()
def info(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A file, or the name of a shipped model.")],
    as_json: JsonOption = False,
) -> None:
    """Show the training data of a posture model and its accuracy on held-out people.

    Example: `zenocap posture info mine.postures`
    """
    with one_line_errors():
        from zenocap.services.recognizer.model_file import find_model

        path = find_model(model)
    show_model(path, as_json)
