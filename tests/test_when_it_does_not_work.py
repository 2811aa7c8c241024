"""Lines quoted by the page "When it does not work" are texts of the source."""

import ast
import re
from functools import cache

import pytest

from tests.support.places import ROOT

PAGE = (ROOT / "docs" / "when-it-does-not-work.md").read_text(encoding="utf-8")
QUOTED = [line.strip() for block in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()]
SPOKEN = 0.75  # least share of the letters of a quoted line that stand in the source; the others are names and numbers
LEAST = 5  # letters of a text in the source, so that it tells anything


@cache
def texts() -> frozenset[tuple[str | None, ...]]:
    """The texts in the source: their parts, None in the place of each value."""
    found = set()
    for folder in ("common", "services", "tools"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.JoinedStr | ast.Constant):
                    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
                    found.add(tuple(str(one.value).strip("\n") if isinstance(one, ast.Constant) else None for one in parts))
    return frozenset(text for text in found if _letters("".join(filter(None, text))) >= LEAST)


def _letters(text: str) -> int:
    return sum(letter.isalpha() for letter in text)


def spoken_share(line: str) -> float:
    """Share of the letters of a line that stand in texts of the source."""
    spoken = [False] * len(line)
    for text in texts():
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
    linked = re.findall(r"\| \[[^\]]*\]\(#([\w-]+)\) \|", PAGE)
    assert [re.sub(r"[^\w -]", "", one).lower().replace(" ", "-") for one in sections] == linked
