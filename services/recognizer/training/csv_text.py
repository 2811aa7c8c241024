"""Text of the CSV files that people write: manifests and label tables."""

from pathlib import Path

from zenocap.common.errors import UserError

DELIMITERS = ",;\t"
MAX_BYTES = 16 << 20


def csv_text(path: Path) -> str:
    """Text of a file.  Raises UserError for one that is too large, cannot be read, or is not UTF-8."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UserError(f"{path}: more than {MAX_BYTES >> 20} MiB: allowed: a smaller table")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not UTF-8 text at byte {error.start}: allowed: a CSV file") from None


def delimiter_of(line: str) -> str:
    """The separator that a first line has most of."""
    return max(DELIMITERS, key=line.count)
