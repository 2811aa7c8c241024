"""README and documentation: their pages, and the commands in them."""

import re
import shlex
from functools import cache
from pathlib import Path

from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from tests.support.command import app
from tests.support.places import ROOT

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "deploy" / "README.md", ROOT / "CONTRIBUTING.md")
TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES}
ALL = "\n".join(TEXTS.values())
LINES = [line for block in re.findall(r"```sh\n(.*?)```", ALL, re.DOTALL) for line in block.splitlines() if line.strip()]
_BLOCK = [line for line in LINES if line.startswith("zenocap")]
_INLINE = re.findall(r"`(zenocap [a-z][^`]*)`", ALL)
COMMANDS = sorted({*_BLOCK, *_INLINE})


def sections(page: Path) -> dict[str, str]:
    """Text below each heading of a page, up to the next one of its level or a higher one, by link target."""
    text = page.read_text(encoding="utf-8")
    headings = list(re.finditer(r"^(#+) (.*)$", text, re.MULTILINE))
    found = {}
    for number, heading in enumerate(headings, 1):
        end = next((one.start() for one in headings[number:] if len(one[1]) <= len(heading[1])), len(text))
        target = re.sub(r"[^\w -]", "", heading[2]).strip().lower().replace(" ", "-")
        found[target] = text[heading.end() : end]
    return found


def words_of(line: str) -> list[str]:
    """The arguments of a line: without the program's name and the comment."""
    return shlex.split(line, comments=True)[1:]


@cache
def _program() -> TyperGroup:
    """The command line of zenocap with commands that do nothing."""
    program = get_command(app)
    groups = [program]
    while groups:
        for command in groups.pop().commands.values():
            if isinstance(command, TyperGroup):
                groups.append(command)
            else:
                command.callback = lambda **_: None
    return program


def command_of(line: str) -> tuple[TyperGroup | TyperCommand, str, list[str]]:
    """The command of a line, its name such as `posture act`, and its arguments."""
    command, words, name = _program(), words_of(line), []
    while isinstance(command, TyperGroup) and words and words[0] in command.commands:
        name.append(words.pop(0))
        command = command.commands[name[-1]]
    return command, " ".join(name), words


def parse(line: str) -> None:
    """Parse a line as the program does, without its effect.  Raises a UsageError of typer."""
    _program().main(words_of(line), prog_name="zenocap", standalone_mode=False)


def distinct_commands() -> list[str]:
    """Lines with arguments, one for each set of options of a command, in the order of the pages."""
    lines = [*_BLOCK, *(line for line in _INLINE if command_of(line)[2])]
    unique = {(command_of(line)[1], *sorted(re.findall(r" (--?[a-z][\w-]*)", line))): line for line in reversed(lines)}
    return list(reversed(unique.values()))
