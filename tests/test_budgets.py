"""Budgets of the house: tests/budgets.toml has the figures."""

import ast
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.measures import house
from tests.support.places import ROOT

BUDGETS = tomllib.loads((ROOT / "tests" / "budgets.toml").read_text(encoding="utf-8"))
SLACK, SMALL_CHANGES = 1.1, 60  # of a budget above its use
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
LEAST_RELEASES = 3
FIRST = 100  # letters of the first line of a module
DOCSTRING = re.compile(r'(?:#[^\n]*\n)*r?"""(.*?)(?:\n|"""|$)')
ASKING = re.compile(r"(What|How|Which|Where|By)\b")
FOLDERS = ("common", "services", "simulation", "tools", "zenocap", "tests", "benchmarks", "examples")


def above(used: Mapping[str, int], budgets: Mapping[str, int]) -> dict[str, tuple[int, int]]:
    """Rows above their budget, or far below it: use and budget."""
    return {
        name: (used[name], most)
        for name, most in budgets.items()
        if not most - SMALL_CHANGES <= used[name] * SLACK or used[name] > most
    }


def test_rows_above_their_budget_and_those_far_below_are_named() -> None:
    budgets = {"within": 100, "above": 100, "far below": 1000, "small": 50}
    assert set(above({"within": 99, "above": 101, "far below": 700, "small": 0}, budgets)) == {"above", "far below"}


@pytest.mark.slow
def test_the_whole_keeps_its_budgets() -> None:
    assert above(house.figures(ROOT), BUDGETS["whole"]) == {}


def test_rooms_keep_their_budgets() -> None:
    rooms = house.rooms(ROOT)
    assert set(BUDGETS["rooms"]) == {name for name in rooms if name not in ("benchmarks", "tests")}
    assert above(rooms, BUDGETS["rooms"]) == {}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_keeps_its_budget(page: Path) -> None:
    assert house.words(page) <= BUDGETS["words"].get(str(page.relative_to(ROOT)), BUDGETS["words"]["another page"])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_sentences_of_a_page_keep_their_budget(page: Path) -> None:
    assert [one for one in house.sentences(page) if len(one.split()) > BUDGETS["words"]["a sentence"]] == []


def test_the_documentation_keeps_its_budget() -> None:
    assert house.words(*(ROOT / "docs").glob("*.md")) <= BUDGETS["words"]["docs"]


def test_a_release_has_few_lines() -> None:
    _, *releases = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert len(releases) >= LEAST_RELEASES
    assert [text.split()[0] for text in releases if len(text.splitlines()) > BUDGETS["release"]["lines"]] == []


@pytest.mark.slow
def test_the_first_line_of_a_module_is_a_short_noun_phrase() -> None:
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
    first = {path: found[1] for path in files if (found := DOCSTRING.match(path.read_text(encoding="utf-8")))}
    assert len(first) > 1_000
    astray = [str(path) for path, line in first.items() if len(line) > FIRST or ASKING.match(line)]
    assert astray == []


@pytest.mark.slow
def test_texts_of_the_package_say_frame_sets() -> None:
    """Strings with more than one word; docstrings are for those who read the code."""
    instants = []
    for path in house.sources(ROOT, *house.PACKAGE):
        if "instant" not in (text := path.read_text(encoding="utf-8")):
            continue
        nodes = list(ast.walk(ast.parse(text)))
        docstrings = {node.value for node in nodes if isinstance(node, ast.Expr)}
        for node in nodes:
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in docstrings:
                instants += re.findall(r".*(?: instants?\b|\binstants? ).*", node.value)
    assert instants == []


@pytest.mark.slow
def test_one_class_name_has_one_meaning() -> None:
    """A name that begins with _ is its module's own."""
    places: dict[str, list[str]] = {}
    for path in house.sources(ROOT, *house.PACKAGE, "benchmarks"):
        for name in house.definitions(path).classes:
            if not name.startswith("_"):
                places.setdefault(name, []).append(str(path.relative_to(ROOT)))
    assert len(places) > 500
    assert {name: where for name, where in places.items() if len(where) > 1} == {}
