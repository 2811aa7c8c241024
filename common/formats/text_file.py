"""Files of other programs: text, and what a library reads in a process of its own."""

import codecs
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from zenocap.common.errors import UserError, reading
from zenocap.common.formats.file_warnings import warn_of_file
from zenocap.common.runtime.foreign_text import printable

MAX_BYTES = 1 << 30  # of a file that is read, which is held in memory; chosen by hand


def read_text(path: Path, kind: str, most: int = MAX_BYTES) -> str:
    """Content of a file in UTF-8, in UTF-16 with its mark, or, which is noted, in that of Windows' older programs.

    kind: in errors, such as "a BVH file".  most: bytes.  Raises UserError.
    """
    with reading(path):
        if path.stat().st_size > most:
            raise UserError(f"{path}: larger than {most >> 20} MiB: allowed: {kind} below that")
        with path.open("rb") as file:
            marked = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        with suppress(UnicodeError):
            return path.read_text(encoding="utf-16" if marked else "utf-8-sig")
        with suppress(UnicodeError):
            text = path.read_text(encoding="cp1252")
            if not marked and "\0" not in text:
                warn_of_file(path, "is not UTF-8: read as Windows-1252; names with other letters may be wrong")
                return text
    raise UserError(f"{path}: not {kind}: no text in UTF-8, UTF-16 or Windows-1252")


def read_apart(path: Path, kind: str, module: str) -> bytes:
    """Output of a module that reads a file in a process of its own, which a damaged file may end by a signal.

    kind: in errors, such as "a C3D file".  module: writes to its standard output, or ends with a reason.  Raises UserError.
    """
    one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # each takes memory
    command = [sys.executable, "-P", "-m", module, str(path)]
    done = subprocess.run(command, env=one_thread, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    if done.returncode < 0:
        raise UserError(f"{path}: not {kind}: reading it was ended by {signal.Signals(-done.returncode).name}")
    if done.returncode:
        lines = done.stderr.decode(errors="replace").splitlines() or [""]
        raise UserError(f"{path}: not {kind}: {printable(lines[-1])}")
    return done.stdout
