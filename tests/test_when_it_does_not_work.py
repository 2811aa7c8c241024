"""The page "When it does not work" quotes texts of the source, and has every line of the verdict."""

import ast
import re
from functools import cache

import pytest

from tests.support.documentation import sections
from tests.support.places import ROOT
from zenocap.common.camera_advice import WORDINGS
from zenocap.tools.judge.seen import KINDS, LEFT_OUT

FILE = ROOT / "docs" / "when-it-does-not-work.md"
PAGE = FILE.read_text(encoding="utf-8")
QUOTED = [line.strip() for block in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()]
SPOKEN = 0.75  # least share of the letters of a quoted line that stand in the source; the others are names and numbers
LEAST = 5  # letters of a text in the source, so that it tells anything
SOUGHT, SHORTEST = 4, 6  # words of a line of the verdict that are looked for on the page; of a line, else it is part of one


@cache
def texts(*folders: str) -> frozenset[tuple[str | None, ...]]:
    """The texts in the source, no docstrings: their parts, None in the place of each value."""
    found = set()
    for folder in folders:
        for path in (ROOT / folder).rglob("*.py"):
            nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
            docstrings = {node.value for node in nodes if isinstance(node, ast.Expr)}
            for node in nodes:
                if isinstance(node, ast.JoinedStr | ast.Constant) and node not in docstrings:
                    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
                    found.add(tuple(str(one.value).strip("\n") if isinstance(one, ast.Constant) else None for one in parts))
    return frozenset(text for text in found if _letters("".join(filter(None, text))) >= LEAST)


def _letters(text: str) -> int:
    return sum(letter.isalpha() for letter in text)


def spoken_share(line: str) -> float:
    """Share of the letters of a line that stand in texts of the source."""
    spoken = [False] * len(line)
    for text in texts("common", "services", "tools"):
        if not all(part in line for part in text if part):
            continue
        for match in re.finditer("".join("(.{0,60}?)" if part is None else re.escape(part) for part in text), line):
            values = {k for group in range(1, match.re.groups + 1) for k in range(*match.span(group))}
            for k in range(*match.span()):
                spoken[k] = spoken[k] or k not in values
    letters = [k for k, letter in enumerate(line) if letter.isalpha()]
    return sum(spoken[k] for k in letters) / len(letters)


def test_the_page_quotes_the_program() -> None:
    assert len(QUOTED) > 20


@pytest.mark.slow
@pytest.mark.parametrize("line", sorted(set(QUOTED)))
def test_a_quoted_line_is_made_of_texts_in_the_source(line: str) -> None:
    assert spoken_share(line) >= SPOKEN, line


@pytest.mark.slow
def test_an_invented_line_is_noticed() -> None:
    assert spoken_share("the person is too far away from the lamp, please come closer") < SPOKEN


def test_every_symptom_has_its_section() -> None:
    sections = re.findall(r"^## (.*)$", PAGE, re.MULTILINE)
    linked = re.findall(r"^\| [^|]* \| \[[^\]]*\]\(#([\w-]+)\) \|$", PAGE, re.MULTILINE)
    assert [re.sub(r"[^\w -]", "", one).lower().replace(" ", "-") for one in sections] == linked


def words_of(text: str) -> list[str]:
    return re.findall(r"[\w'-]+", text)


def verdict_lines() -> list[str]:
    """What a user can look for of each line of the verdict: the first SOUGHT words that no value separates."""
    inner = {part for line in texts("tools/judge") if len(line) > 1 for part in line}
    lines: list[tuple[str | None, ...]] = [(WORDINGS[code].found,) for code in (*KINDS, *LEFT_OUT)]
    lines += [line for line in texts("tools/judge") if len(line) > 1 or line[0] not in inner]
    parts = [[part for whole in line if whole for part in re.split(r"\{[^}]*\}", whole)] for line in lines]
    long = [line for line in parts if len(words_of(" ".join(line))) >= SHORTEST]
    return sorted({" ".join(max(map(words_of, line), key=lambda one: len(one) >= SOUGHT)[:SOUGHT]) for line in long})


def test_every_line_of_the_verdict_is_found_on_the_page_by_its_words() -> None:
    page = " ".join(words_of(sections(FILE)["lines-of-the-verdict"]))
    assert len(verdict_lines()) > 25
    assert [line for line in verdict_lines() if line not in page] == []
