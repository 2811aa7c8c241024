"""Papers in code and documentation: equations, named files, vocabulary of departures."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.support.places import ROOT
from zenocap.common.rig.two_view import ADDITIONS

FOLDERS = ("common", "services", "simulation", "tools", "benchmarks", "zenocap")
PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
EQUATIONS = {"Two-view": range(1, 5), "Hybrid": range(1, 42)}  # as numbered in the papers
WORDS = ("corrected", "replaced", "added", "open")
TAG = re.compile(r"\[(Two-view|Hybrid)\b")
SECTION = re.compile(r"(?<![\d.])[1-5]\.\d(?!\d)|\b(?:V(?:-[AB]|II?)?|IV|III?)\b")
DEPARTURE = re.compile(r"# Paper \((\w+)\): (\S.*)")
ADDITION = rf"`(?:{'|'.join(ADDITIONS)})`"
OF_ADDITION = re.compile(rf"{ADDITION}\]\(#variants\)(:| adds\b)")
FILE = re.compile(r"`(\w[\w/.-]*/[\w.-]+\.\w+)`")
NUMBERS = r"\d+(?:-\d+)?"
EQUATION = re.compile(rf"\bEq\. ({NUMBERS}(?:(?:, | and ){NUMBERS})*)")
PLACES = [(paper, number) for paper, numbers in EQUATIONS.items() for number in numbers]


def equations(text: str) -> set[int]:
    """Numbers after "Eq." in a text: single ones, ranges (Eq. 2-5), and lists of both (Eq. 2, 4-6)."""
    found: set[int] = set()
    for match in EQUATION.finditer(text):
        for part in re.findall(NUMBERS, match[1]):
            first, _, last = part.partition("-")
            found |= set(range(int(first), int(last or first) + 1))
    return found


def places(text: str) -> set[str]:
    """Sections and equations that a text names."""
    return set(SECTION.findall(text)) | {f"Eq. {number}" for number in equations(text)}


def texts(source: str) -> Iterator[str]:
    """Docstrings of a source, and its blocks of comment lines."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield ast.get_docstring(node) or ""
    block, line = "", 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            if token.start[0] != line + 1:
                yield block
                block = ""
            block, line = f"{block}\n{token.string}", token.start[0]
    yield block


@cache
def sources() -> dict[Path, str]:
    """Text of every source file."""
    files = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py") if not path.is_symlink())
    assert len(files) > 100
    return {path: path.read_text(encoding="utf-8") for path in files}


@cache
def in_sources() -> dict[str, set[int]]:
    """Equations of each paper in docstrings and comments that name that paper and no other."""
    found: dict[str, set[int]] = {paper: set() for paper in EQUATIONS}
    for source in filter(TAG.search, sources().values()):
        for text in texts(source):
            if len(papers := set(TAG.findall(text))) == 1:
                found[papers.pop()] |= equations(text)
    return found


@cache
def on_page() -> dict[str, set[int]]:
    """Equations of each paper in the tables of the page; each heading names its paper."""
    found: dict[str, set[int]] = {paper: set() for paper in EQUATIONS}
    for section in re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]:
        if tag := TAG.match(section):
            rows = [line for line in section.splitlines() if line.startswith("|")]
            found[tag[1]] |= set().union(*(equations(row.split("|")[1]) for row in rows))
    return found


def test_equations_of_a_text() -> None:
    assert equations("Eq. 2 and [Hybrid Eq. 4-6, 9]") == {2, 4, 5, 6, 9}
    assert equations("Eq. 7 and 8") == {7, 8}
    assert equations("Equation 3, equations 4") == set()
    assert places("IV and V-A, Eq. 3; 3.1 and V; 0.65 h") == {"IV", "V-A", "Eq. 3", "3.1", "V"}


@pytest.mark.nightly
@pytest.mark.parametrize(("paper", "number"), PLACES, ids=lambda value: str(value))
def test_every_equation_is_in_the_source_or_on_the_page(paper: str, number: int) -> None:
    assert number in in_sources()[paper] | on_page()[paper]


@pytest.mark.parametrize("paper", EQUATIONS)
def test_the_page_has_a_row_for_every_equation(paper: str) -> None:
    assert on_page()[paper] == set(EQUATIONS[paper])


@pytest.mark.nightly
@pytest.mark.parametrize("paper", EQUATIONS)
def test_the_source_names_no_equation_that_the_paper_lacks(paper: str) -> None:
    assert in_sources()[paper] <= set(EQUATIONS[paper])


def test_every_file_on_the_page_exists() -> None:
    files = FILE.findall(PAGE)
    assert len(files) > 100
    assert [file for file in files if not (ROOT / file).is_file()] == []


@cache
def rows() -> list[list[str]]:
    """Cells of the rows of all sections: section, what it specifies, here, files, reason."""
    found: list[list[str]] = []
    for block in re.findall(r"(?:^\|.*\n)+", PAGE, re.MULTILINE):
        header, _, *its = [[cell.strip() for cell in line.split("|")[1:-1]] for line in block.splitlines()]
        found += its if header[0] in ("section", "equations") else []
    assert len(found) > 100
    return found


def departures(here: str) -> set[str]:
    """Words of a row's cell "here"; an addition replaces what is printed, or adds to it."""
    named = {word for word in WORDS if re.search(rf"\b{word}\b", here)}
    return named | {"replaced" if how == ":" else "added" for how in OF_ADDITION.findall(here)}


def test_departures_of_a_row() -> None:
    assert departures("as printed; [`tilt`](#variants) adds lean; axis open") == {"added", "open"}
    assert departures("as printed; [`turn`](#variants): continuous") == {"replaced"}
    assert departures("as printed, opened by `ends`: flat") == set()


def test_every_file_of_a_row_has_its_departure() -> None:
    """Each file has a comment with a word of the row, each word a comment in a file of the row."""
    astray = []
    for row in rows():
        words = departures(row[2])
        tags = {file: {word for word, _ in DEPARTURE.findall(sources()[ROOT / file])} for file in FILE.findall(row[3])}
        assert words or re.fullmatch(r"as printed\b[^`]*", row[2]), row
        astray += [(row[0], row[2], file) for file, its in tags.items() if words and not words & its]
        astray += [(row[0], row[2], word) for word in words - set().union(*tags.values())]
    assert astray == []


@pytest.mark.slow
def test_every_departure_in_the_code_has_one_of_four_words_and_its_row() -> None:
    """A row with its file and word, and of the sections and equations that it names, one."""
    known = [(FILE.findall(row[3]), departures(row[2]), places(row[0])) for row in rows()]
    comments = [(path, line) for path, source in sources().items() for line in re.findall(r"#\s*Papers?\b *[:(].*", source)]
    astray = []
    for path, line in comments:
        word, text = DEPARTURE.findall(line)[0] if DEPARTURE.match(line) else ("", "")
        file, named = str(path.relative_to(ROOT)), places(text)
        if not any(file in files and word in words and (not named or named & its) for files, words, its in known):
            astray.append((file, line))
    assert astray == []
    assert len(comments) > 100


def test_every_row_of_the_page_is_complete() -> None:
    """Five cells; what is not as printed has a file, and a reason or an effect."""
    for row in rows():
        assert len(row) == 5, row
        assert all(row[k] for k in (0, 1, 2, 3)), row
        assert row[2].startswith("as printed") or row[4], row
        assert not re.search(rf"{ADDITION}(?!\]\(#variants\))", row[2]), row  # its effect is in the table of variants
