"""Dataclass parameters of commands: one option per field, and the dataclass built from the arguments."""

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from zenocap.tools.option_groups import COMMON, EXPERT, RESEARCH, add_command, expanded, option
from zenocap.tools.service_arguments import ZenohArguments


@dataclass(frozen=True)
class Span:
    first: Annotated[int | None, typer.Option("--from", help="First frame.")] = None
    last: Annotated[int | None, typer.Option("--until", help="Last frame.")] = None


@dataclass(frozen=True)
class Rates:
    fps: float = option(30.0, "Frames per second.", min=1.0)
    loud: bool = option(False, "Say more.")
    kept: bool = option(True, "Keep it.")
    part_mb: float | None = option(None, "Size of a part.", "-p", "--part-mb")


@dataclass(frozen=True)
class MoreRates(Rates):
    seed: int = option(0, "Random seed.")


def run(command: object, *arguments: str) -> tuple[int, str]:
    app = typer.Typer(add_completion=False)
    add_command(app, command)  # type: ignore[arg-type]  # a command of any signature
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


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((), "MoreRates(fps=30.0, loud=False, kept=True, part_mb=None, seed=0)"),
        (
            ("--loud", "--no-kept", "-p", "2", "--seed", "3"),
            "MoreRates(fps=30.0, loud=True, kept=False, part_mb=2.0, seed=3)",
        ),
    ],
)
def test_options_are_named_as_their_fields_and_inherited(arguments: tuple[str, ...], expected: str) -> None:
    def show(*, rates: MoreRates) -> None:
        typer.echo(f"{rates}")

    assert run(show, *arguments) == (0, f"{expected}\n")
    assert Rates(fps=5.0).part_mb is None


@pytest.mark.parametrize("word", ["--no-loud", "--fps=0"])
def test_a_flag_has_no_opposite_and_a_number_its_range(word: str) -> None:
    def show(*, rates: Rates) -> None: ...

    assert run(show, word)[0] == 2


def test_panels_are_in_their_order_and_the_others_are_common() -> None:
    def cut(
        take: str,
        as_json: Annotated[bool, typer.Option("--json")] = False,
        *,
        zenoh: ZenohArguments,
        rates: Annotated[Rates, RESEARCH],
        span: Annotated[Span, EXPERT],
    ) -> None: ...

    text = run(cut, "--help")[1]
    words = ["Arguments", COMMON, "--json", "--help", EXPERT, "--from", "--until", RESEARCH, "--fps", "Zenoh", "--mode"]
    assert sorted(words, key=text.index) == words
    assert "─ Options ─" not in text
    assert run(cut, "a.mcap", "--fps", "5", "-m", "client")[0] == 0
