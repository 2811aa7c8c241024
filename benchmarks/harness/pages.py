"""Figures and tables in the pages of the documentation, written from the stored results.

    <!-- figure KIND CASE COLUMN -->31 (32)<!-- end -->
    <!-- table KIND [COLUMN ...] [across] [rows=PATTERN] -->
    ...
    <!-- end -->
    <!-- kinds unmeasured -->
    ...
    <!-- end -->

CASE in quotation marks where it has spaces.  rows: only cases whose names match the regular expression;
`across`, of one column: the last part of the names of the cases goes across.  A table of a kind without results is a line
that says so.  kinds unmeasured: those without results.
"""

import re
import shlex
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path

from benchmarks.harness.cache import ROOT
from benchmarks.harness.results import Results
from benchmarks.harness.text import across, cell, markdown
from benchmarks.kinds import KINDS
from zenocap.common.errors import UserError

MARKER = re.compile(r"(<!-- (figure|table|kinds) ([^>]*?) -->)(.*?)(<!-- end -->)", re.DOTALL)


def pages() -> list[Path]:
    """Pages that may have markers."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def written(text: str, results: Mapping[str, Results], page: str = "") -> str:
    """The page with the figures of the results.  Raises UserError, which names page and marker."""

    def replaced(match: re.Match[str]) -> str:
        start, what, words, _, end = match.groups()
        try:
            content = _figure(words, results) if what == "figure" else f"\n{OF_LINES[what](words, results)}\n"
        except (UserError, ValueError, re.error) as error:
            raise UserError(f"{page}: {start}: {error}") from error
        return f"{start}{content}{end}"

    return MARKER.sub(replaced, text)


def publish(results: Mapping[str, Results]) -> list[Path]:
    """Renew all pages; return those that changed.  Raises UserError."""
    changed = list(stale(results))
    for page, text in changed:
        page.write_text(text, encoding="utf-8")
    return [page for page, _ in changed]


def stale(results: Mapping[str, Results]) -> Iterator[tuple[Path, str]]:
    """Pages that differ from the results, and what they should be.  Raises UserError."""
    for page in pages():
        before = page.read_text(encoding="utf-8")
        text = written(before, results, page.name)
        if text != before:
            yield page, text


def _figure(words: str, results: Mapping[str, Results]) -> str:
    parts = shlex.split(words)
    if len(parts) != 3:
        raise UserError("KIND CASE COLUMN expected")
    kind, case, column = parts
    found = _results(kind, results)
    return cell(found.row(case), found.heading(column))


def _table(words: str, results: Mapping[str, Results]) -> str:
    kind, *parts = shlex.split(words)
    if kind not in results and kind in KINDS.names():
        return f"*Not measured with this version: `python -m benchmarks {kind}`.*"
    found = _results(kind, results)
    patterns = [part.removeprefix("rows=") for part in parts if part.startswith("rows=")]
    names = [part for part in parts if not part.startswith("rows=") and part != "across"]
    wanted = re.compile("|".join(patterns))
    cases = dict.fromkeys(row.case for row in found.figures if wanted.search(row.case))
    if not cases:
        raise UserError(f"{kind}: no result of {', '.join(patterns) or 'any case'}")
    headings = [found.heading(name) for name in names] or list(found.columns)
    rows = [found.row(case) for case in cases]
    if "across" not in parts:
        return markdown(found, rows, headings)
    if len(names) != 1:
        raise UserError("across: one COLUMN expected")
    return across(found, rows, headings[0])


def _unmeasured(words: str, results: Mapping[str, Results]) -> str:
    if words != "unmeasured":
        raise UserError("`unmeasured` expected")
    names = [f"`{name}`" for name in KINDS.names() if name not in results]
    return textwrap.fill(", ".join(names) + ".", 120, break_on_hyphens=False) if names else "None."


OF_LINES = {"table": _table, "kinds": _unmeasured}


def _results(kind: str, results: Mapping[str, Results]) -> Results:
    if kind not in results:
        raise UserError(f"no results of {kind!r}: allowed: {', '.join(results)}")
    return results[kind]
