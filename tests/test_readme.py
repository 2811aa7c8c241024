"""The README says what is so: its commands parse, its tables are the code's, its files exist."""

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from common.topics import TOPICS
from services.cli import app

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = [
    block
    for text in (README, (ROOT / "deploy" / "README.md").read_text(encoding="utf-8"))
    for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
]
LINES = [line for block in BLOCKS for line in block.splitlines() if line.strip()]
INLINE = re.findall(r"`(zenocap [a-z][^`]*)`", README)
COMMANDS = sorted({line for line in LINES if line.startswith("zenocap")} | set(INLINE))
OPTION = re.compile(r"^--?[a-z]")


def test_there_are_commands() -> None:
    assert len(COMMANDS) > 10
    assert LINES[:2] == ["make demo", "make test"]


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_parses(line: str) -> None:
    """Its own options, all of them known, with `--help` in the end so that nothing is done."""
    arguments = shlex.split(line)[1:]
    result = CliRunner().invoke(app, [*arguments, *([] if "--help" in arguments else ["--help"])], env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    command = " ".join(word for word in arguments[:2] if word.isalpha() and word != "calibration")
    for option in (word for word in arguments if OPTION.match(word)):
        assert option in result.output, f"{command} has no {option}"


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_topic_is_in_the_table(topic: object) -> None:
    row = next(t for t in TOPICS if t is topic)
    assert f"| `{row.key}` | {row.message.__name__} | {row.rate} | {row.queueing.value} |" in README


def test_the_files_of_the_map_exist() -> None:
    files = re.findall(r"`((?:common|services|deploy|docs)/[\w/.]+\.\w+)`", README) + re.findall(
        r"\]\((docs/[^)]+)\)", README
    )
    assert len(files) > 20
    assert [file for file in files if not (ROOT / file).is_file()] == []


def test_make_has_the_targets() -> None:
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"make (\w+)", " ".join([*LINES, *re.findall(r"`(make [^`]*)`", README)])):
        assert f"\n{target}:" in makefile
