"""CSV files that people write: manifests and label tables."""

import csv
from collections.abc import Iterator
from io import StringIO
from pathlib import Path

from zenocap.common.errors import UserError

DELIMITERS = ",;\t"
MAX_BYTES = 16 << 20
LONGEST_S = 1e6


def read_table(path: Path, wrong: list[str]) -> tuple[str, list[str], Iterator[tuple[int, list[str]]]]:
    """First line of a file, its cells in lower case, and line number and cells of the further rows that are not blank.

    The delimiter is the one that the first line has most of.  wrong: receives the error of a row that is not CSV, which is
    the last.  Raises UserError for a file that is too large, cannot be read, or is not UTF-8.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UserError(f"{path}: more than {MAX_BYTES >> 20} MiB: allowed: a smaller table")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not UTF-8 text at byte {error.start}: allowed: a CSV file") from None
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
