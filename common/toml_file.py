"""TOML files within limits of size, key length and depth."""

import re
import tomllib
from pathlib import Path

from zenocap.common.errors import UserError, reading

MAX_TOML_BYTES = 1 << 20  # of a rig, calibration or measurements file; ours have a few kB; chosen by hand
MAX_DOTS = 64  # in one key; our keys have up to two; chosen by hand
KEY_ENDS = re.compile(r"[\n\r=,]")  # no key continues after one of them, unless they are quoted
QUOTED_PART = re.compile(r"""["'][ \t]*\.|\.[ \t]*["']""")  # dot beside a quoted part of a key


def read_toml(path: Path) -> dict[str, object]:
    """The tables of a TOML file.  Raises UserError."""
    try:
        with reading(path):
            if (size := path.stat().st_size) > MAX_TOML_BYTES:
                raise UserError(f"{path}: {size} bytes: allowed: up to {MAX_TOML_BYTES}")
            text = path.read_text(encoding="utf-8-sig")  # editors of Windows begin with a byte-order mark
        _check_dots(path, text)
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: not TOML: {error}") from error
    except RecursionError:
        raise UserError(f"{path}: not TOML: values too deeply nested") from None


def quoted(text: str) -> str:
    """A string of TOML.  text: without control characters."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _check_dots(path: Path, text: str) -> None:
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") <= MAX_DOTS:
            continue
        dots = max(*(part.count(".") for part in KEY_ENDS.split(line)), len(QUOTED_PART.findall(line)))
        if dots > MAX_DOTS and not line.lstrip().startswith("#"):
            raise UserError(f"{path}: line {number}: {line[:40]!r}: {dots} dots: allowed: up to {MAX_DOTS} in a key")
