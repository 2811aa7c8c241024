"""Folders made once and kept on disk for later tests, workers and sessions."""

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from tests.support.places import ROOT

FOLDER = Path(tempfile.gettempdir()) / f"zenocap-stored-{os.getuid()}"


def stored_folder(make: Callable[[Path], None], *key: object, sources: Sequence[str]) -> Path:
    """The folder that `make` has filled for this key and these sources; it must not be changed."""
    path = FOLDER / hashlib.sha256(f"{_sources()} {make.__qualname__} {key!r} {sorted(sources)}".encode()).hexdigest()
    if not path.is_dir():
        FOLDER.mkdir(mode=0o700, parents=True, exist_ok=True)
        unfinished = Path(tempfile.mkdtemp(dir=FOLDER))
        make(unfinished)
        try:
            unfinished.replace(path)
        except OSError:  # another worker was first
            shutil.rmtree(unfinished)
    return path


@cache
def _sources() -> str:
    folders = (ROOT / "common", ROOT / "services", ROOT / "simulation", ROOT / "tools", ROOT / "tests" / "support")
    files = sorted(file for folder in folders for file in folder.rglob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
