"""The README and the pages behind it say what is so: its commands parse, its tables are the code's, its files exist."""

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from common.topics import TOPICS
from services.cli import app

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "deploy" / "README.md")
TEXTS = {path: path.read_text(encoding="utf-8") for path in PAGES}
WIRE = TEXTS[ROOT / "docs" / "wire.md"]
ALL = "\n".join(TEXTS.values())
BLOCKS = re.findall(r"```sh\n(.*?)```", ALL, re.DOTALL)
LINES = [line for block in BLOCKS for line in block.splitlines() if line.strip()]
INLINE = re.findall(r"`(zenocap [a-z][^`]*)`", ALL)
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
    assert f"| `{row.key}` | {row.message.__name__} | {row.rate} | {row.queueing.value} |" in WIRE


def test_the_files_of_the_map_exist() -> None:
    files = re.findall(r"`((?:common|services|deploy|docs)/[\w/.]+\.\w+)`", ALL)
    assert len(files) > 20
    assert [file for file in files if not (ROOT / file).is_file()] == []


def anchors(page: Path) -> set[str]:
    """Of a page's headings, as they are linked to."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    links = [link for link in re.findall(r"\]\(([^)\s]+)\)", TEXTS[page]) if not link.startswith("http")]
    for link in links:
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.is_file(), f"{page.name}: {link}"
        assert not anchor or anchor in anchors(target), f"{page.name}: {link}"


def test_every_page_is_linked_from_the_first() -> None:
    linked = {(ROOT / link).resolve() for link in re.findall(r"\]\(([\w/]+\.md)\)", TEXTS[PAGES[0]])}
    assert linked == set(PAGES[1:])


def test_make_has_the_targets() -> None:
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"make (\w+)", " ".join([*LINES, *re.findall(r"`(make [^`]*)`", ALL)])):
        assert f"\n{target}:" in makefile
