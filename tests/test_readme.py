"""README and documentation agree with the code: commands parse, tables equal the code's, files and links exist."""

import re
import shlex
from pathlib import Path

import pytest
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command
from typer.testing import CliRunner

from tests.support.places import ROOT
from zenocap.common.topics import TOPICS
from zenocap.tools.cli.main import app

PAGES = (
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "deploy" / "README.md",
    ROOT / "CONTRIBUTING.md",
)
TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES}
WIRE = TEXTS[ROOT / "docs" / "wire.md"]
ALL = "\n".join(TEXTS.values())
BLOCKS = re.findall(r"```sh\n(.*?)```", ALL, re.DOTALL)
LINES = [line for block in BLOCKS for line in block.splitlines() if line.strip()]
INLINE = re.findall(r"`(zenocap [a-z][^`]*)`", ALL)
COMMANDS = sorted({line for line in LINES if line.startswith("zenocap")} | set(INLINE))
OPTION = re.compile(r"^--?[a-z]")


def test_the_first_commands_are_demo_and_test() -> None:
    assert len(COMMANDS) > 10
    assert LINES[:2] == ["make demo", "make test"]


@pytest.mark.slow
@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_parses(line: str) -> None:
    """Every option of a documented command exists; `--help` at the end keeps it from running."""
    arguments = shlex.split(line, comments=True)[1:]
    result = CliRunner().invoke(app, [*arguments, *([] if "--help" in arguments else ["--help"])], env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    command = " ".join(word for word in arguments[:2] if word.isalpha() and word != "calibration")
    for option in (word for word in arguments if OPTION.match(word)):
        assert option in result.output, f"{command} has no {option}"


def test_every_command_with_arguments_has_all_that_are_required() -> None:
    incomplete = {}
    for line in COMMANDS:
        command = get_command(app)
        arguments = shlex.split(line, comments=True)[1:]
        while isinstance(command, TyperGroup) and arguments and arguments[0] in command.commands:
            command = command.commands[arguments.pop(0)]
        if not isinstance(command, TyperCommand) or not arguments or "--help" in arguments or "-h" in arguments:
            continue  # only names the command
        given, _, _ = command.make_parser(command.context_class(command)).parse_args(arguments)
        missing = [one.name for one in command.params if one.required and given.get(one.name or "") in (None, ())]
        if missing:
            incomplete[line] = missing
    assert incomplete == {}


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_topic_is_in_the_table(topic: object) -> None:
    row = next(t for t in TOPICS if t is topic)
    rate = f"{row.rate_hz:g}" if row.rate_hz else "on change"
    assert f"| `{row.key}` | {row.message.__name__} | {rate} | {row.queueing.value} |" in WIRE


def test_every_named_file_exists() -> None:
    folders = "common|services|simulation|tools|zenocap|tests|benchmarks|examples|deploy|docs"
    files = re.findall(rf"`((?:{folders})/[\w/.]+\.\w+)`", ALL)
    assert len(files) > 20
    assert [file for file in files if not (ROOT / file).is_file()] == []


def anchors(page: Path) -> set[str]:
    """Link targets of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_a_file_and_a_heading(page: Path) -> None:
    links = [link for link in re.findall(r"\]\(([^)\s]+)\)", TEXTS[page]) if not link.startswith("http")]
    for link in links:
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.is_file(), f"{page.name}: {link}"
        assert not anchor or anchor in anchors(target), f"{page.name}: {link}"


def test_every_page_is_linked_from_the_readme() -> None:
    linked = {(ROOT / link).resolve() for link in re.findall(r"\]\(([\w/-]+\.md)\)", TEXTS[PAGES[0]])}
    assert linked == set(PAGES[1:])


def test_every_named_make_target_exists() -> None:
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"make ([\w-]+)", " ".join([*LINES, *re.findall(r"`(make [^`]*)`", ALL)])):
        assert f"\n{target}:" in makefile


def test_the_moving_picture_of_the_readme_is_small_and_moves() -> None:
    (name,) = re.findall(r"\]\((docs/\w+\.webp)\)", TEXTS[ROOT / "README.md"])
    content = (ROOT / name).read_bytes()
    assert len(content) < 1_500_000
    assert content[8:16] == b"WEBPVP8X"
    assert content.count(b"ANMF") > 20  # frames of an animation
