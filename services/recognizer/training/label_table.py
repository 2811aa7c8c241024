"""Label tables: labels along one long source, a CSV file with the columns `time` and `label`.

A label holds from its time until the next row, whatever that has: a table may have one row per frame, or one per change.
The last one holds until the end of the source.  Rows without a label belong to no example.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.csv_text import LONGEST_S, read_table, seconds_of
from zenocap.services.recognizer.training.examples import LONGEST_LABEL

COLUMNS = ("time", "label")


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
    for row in _rows(path, wrong):
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


def _rows(path: Path, wrong: list[str]) -> Iterator[LabelSpan]:
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
