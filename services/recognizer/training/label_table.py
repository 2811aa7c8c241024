"""Label tables: labels along one long source, a CSV file with the columns `time` and `label`.

A label holds from its time until the next row, whatever that has: a table may have one row per frame, or one per change.
The last one holds until the end of the source.  Rows without a label belong to no example.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.formats.text_file import read_text
from zenocap.services.recognizer.training.examples import LONGEST_LABEL

COLUMNS = ("time", "label")
DELIMITERS = ",;\t"
MAX_BYTES = 16 << 20
LONGEST_S = 1e6


@dataclass(frozen=True)
class LabelSpan:
    """line: of its first row in the table.  start, end: seconds from the start of the source; end None: its end."""

    line: int
    start: float
    end: float | None
    label: str


def read_spans(path: Path) -> list[LabelSpan]:
    """Spans of equal labels, in order.  Other columns are ignored.  Raises UserError with all errors."""
    wrong: list[str] = []
    spans: list[LabelSpan] = []
    previous: LabelSpan | None = None  # the open one
    for row in _labels(path, wrong):
        if previous is not None and row.label == previous.label:
            continue
        if previous is not None:
            spans.append(LabelSpan(previous.line, previous.start, row.start, previous.label))
        previous = row
    if previous is not None:
        spans.append(previous)
    spans = [span for span in spans if span.label]
    if not wrong and not spans:
        wrong.append(f"{path}: no labels: allowed: one or more")
    if wrong:
        raise UserError("\n".join(wrong))
    return spans


def _labels(path: Path, wrong: list[str]) -> Iterator[LabelSpan]:
    """One open span per row."""
    first, names, lines = read_table(path, wrong)
    if any(names.count(name) != 1 for name in COLUMNS):
        raise UserError(f"{path}: line 1: {first.strip()[:80]!r}: allowed: the columns {', '.join(COLUMNS)}, once each")
    at, named = names.index("time"), names.index("label")
    before = -1.0
    for number, cells in lines:
        value, label = (cells[k].strip() if k < len(cells) else "" for k in (at, named))
        time_s, line = seconds_of(value), f"{path}: line {number}"
        if time_s is None:
            wrong.append(f"{line}: time = {value!r}: allowed: seconds from the start of the source, 0 to {LONGEST_S:g}")
        elif time_s <= before:
            wrong.append(f"{line}: time = {value}: allowed: later than {before:g}, the time of the row before")
        elif len(label) > LONGEST_LABEL or not label.isprintable():
            wrong.append(f"{line}: label = {label!r}: allowed: at most {LONGEST_LABEL} printable characters")
        else:
            before = time_s
            yield LabelSpan(number, time_s, None, label)


def read_table(path: Path, wrong: list[str]) -> tuple[str, list[str], Iterator[tuple[int, list[str]]]]:
    """First line of a file, its cells in lower case, and line number and cells of the further rows that are not blank.

    The delimiter is the one that the first line has most of.  wrong: receives the error of a row that is not CSV, which is
    the last.  Raises UserError for a file that is too large, cannot be read, or is not UTF-8.
    """
    text = read_text(path, "a CSV file", MAX_BYTES)
    first = text.partition("\n")[0]
    delimiter = max(DELIMITERS, key=first.count)
    names = [name.strip('" ').strip().lower() for name in first.split(delimiter)]
    return first, names, _rows(path, text, delimiter, wrong)


def _rows(path: Path, text: str, delimiter: str, wrong: list[str]) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(StringIO(text), delimiter=delimiter, strict=True)
    try:
        next(reader, None)
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as error:
        wrong.append(f"{path}: line {reader.line_num}: {error}: allowed: one row per line")


def seconds_of(text: str) -> float | None:
    """Seconds from the start of a source, 0 to LONGEST_S; None for another text."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0.0 <= value <= LONGEST_S else None
