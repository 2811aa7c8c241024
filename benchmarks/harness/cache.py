"""Figures of earlier runs, named after the sources and inputs that made them."""

import hashlib
import json
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import zenocap
from benchmarks.harness.case import SHARED, Case, Figures, Kind
from tests.support.stored import surroundings
from zenocap.common.cache import cache_folder, mark_used, read_entry, write_entry
from zenocap.common.source_digests import Sources

ROOT = Path(__file__).resolve().parents[2]
PLACE = re.compile(r'"(zenocap(?:\.\w+)+):\w+"')  # a row of a table, which is imported by its name


class Closure(Sources):
    """Sources with the files among them that each one imports, also those that it imports by name."""

    def _imported(self, text: str) -> set[str]:
        named = {f"{module.replace('.', '/')}.py" for module in PLACE.findall(text)}
        return super()._imported(text) | (named & set(self.texts))


def read(kind: Kind, one: Case) -> Figures | None:
    """Figures that are kept; None without any, and for what is timed."""
    content = None if kind.timed else read_entry(_entry(kind, one))
    return None if content is None else json.loads(content)


def write(kind: Kind, one: Case, figures: Figures) -> None:
    if not kind.timed:
        write_entry(_entry(kind, one), json.dumps(figures).encode())


def digest(kind: Kind, one: Case) -> str:
    """Digest of what the figures depend on: the sources of the kind, its inputs, data of the package, versions."""
    parts = [module_digest(kind.module), surroundings(), *(content(SHARED / name) for name in kind.inputs(one))]
    return hashlib.sha256(" ".join(parts).encode()).hexdigest()[:24]


def source_digest(kind: Kind, one: Case) -> str:
    """Digest of the sources that decide a figure: the module of the kind, all that it imports, the case and the columns.

    Without inputs and versions: it is the same on every machine.
    """
    return hashlib.sha256(f"{module_digest(kind.module)} {one!r} {kind.columns!r}".encode()).hexdigest()[:16]


@cache
def module_digest(module: str) -> str:
    """Digest of a module and of all that it imports."""
    name = f"{module.replace('.', '/')}.py"
    if name not in _sources().texts:
        raise ValueError(f"{module}: no module of zenocap, benchmarks or tests")
    return _sources().digest([name])


def _entry(kind: Kind, one: Case) -> Path:
    folder = cache_folder() / "benchmarks" / digest(kind, one)
    mark_used(folder)
    return folder / hashlib.sha256(f"{kind.name} {one!r}".encode()).hexdigest()[:24]


@cache
def _sources() -> Closure:
    folders = {"zenocap": Path(zenocap.__file__).parent, "benchmarks": ROOT / "benchmarks", "tests": ROOT / "tests"}
    return Closure(folders)


@cache
def content(path: Path) -> str:
    """Digest of a file, or of all files of a folder."""
    files: Sequence[Path] = sorted(one for one in path.rglob("*") if one.is_file()) if path.is_dir() else [path]
    return hashlib.sha256(b"\0".join(one.name.encode() + one.read_bytes() for one in files)).hexdigest()
