"""Dataclass parameters of commands: one option per field, and the dataclass built from the arguments."""

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from zenocap.tools.cli.expansion import expanded
from zenocap.tools.service_arguments import ZenohArguments


@dataclass(frozen=True)
class Span:
    first: Annotated[int | None, typer.Option("--from", help="First frame.")] = None
    last: Annotated[int | None, typer.Option("--until", help="Last frame.")] = None


def run(command: object, *arguments: str) -> tuple[int, str]:
    app = typer.Typer()
    app.command()(expanded(command))  # type: ignore[arg-type]  # a command of any signature
    result = CliRunner().invoke(app, list(arguments), env={"COLUMNS": "200"})
    return result.exit_code, result.output


def test_fields_become_options_and_return_as_the_dataclass() -> None:
    def cut(take: str, loud: bool = False, *, span: Span, zenoh: ZenohArguments) -> None:
        """Cut a take."""
        typer.echo(f"{take} {loud} {span} {zenoh.connect} {zenoh.mode}")

    arguments = ("a.mcap", "--from", "3", "-e", "tcp/a:1", "-e", "tcp/b:2", "-m", "client", "--loud")
    assert run(cut, *arguments) == (0, "a.mcap True Span(first=3, last=None) ['tcp/a:1', 'tcp/b:2'] client\n")
    status, text = run(cut, "--help")
    assert status == 0
    for words in ("Cut a take", "--from", "First frame.", "--no-multicast-scouting"):
        assert words in text


def test_command_without_dataclass_is_unchanged() -> None:
    def plain(take: str) -> None: ...

    assert expanded(plain) is plain


def test_two_parameters_of_one_name_are_rejected() -> None:
    def twice(first: int, *, span: Span) -> None: ...

    with pytest.raises(TypeError, match="two parameters have one name"):
        expanded(twice)
