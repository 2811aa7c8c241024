"""Budgets of words and lines: README, documentation, releases."""

import ast
import re
from pathlib import Path

import pytest

from tests.support.places import ROOT

DOCS = ROOT / "docs"
WORDS = {  # pages: most words
    "README.md": 1_200,
    "docs/papers.md": 3_700,
    "docs/measured.md": 7_300,  # generated tables
}
PAGE, ALL = 3_100, 40_300  # most words of another page; of all pages
RELEASE, LEAST_RELEASES = 60, 3  # lines
FIRST = 100  # letters of the first line of a module
ASKING = re.compile(r"(What|How|Which|Where|By)\b")
FOLDERS = ("common", "services", "simulation", "tools", "zenocap", "tests", "examples")
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]


def words(text: str) -> int:
    """Number of words: blanks separate them, and the bars of tables are none."""
    return sum(not set(word) <= set("|:-") for word in text.split())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_keeps_its_budget(page: Path) -> None:
    assert words(page.read_text(encoding="utf-8")) <= WORDS.get(str(page.relative_to(ROOT)), PAGE)


def test_the_documentation_keeps_its_budget() -> None:
    assert sum(words(page.read_text(encoding="utf-8")) for page in DOCS.glob("*.md")) <= ALL


def test_a_release_has_few_lines() -> None:
    _, *releases = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert len(releases) >= LEAST_RELEASES
    assert [text.split()[0] for text in releases if len(text.splitlines()) > RELEASE] == []


@pytest.mark.slow
def test_the_first_line_of_a_module_is_a_short_noun_phrase() -> None:
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
    assert len(files) > 1_000
    first = {path: (ast.get_docstring(ast.parse(path.read_bytes())) or "").partition("\n")[0] for path in files}
    astray = [str(path) for path, line in first.items() if len(line) > FIRST or ASKING.match(line)]
    assert astray == []
