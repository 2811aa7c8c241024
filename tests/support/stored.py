"""Films, scenes and takes of the tests, made once and kept in the user's cache.

An entry is named after its key and the sources that make it, so a change of these makes it again.
"""

import hashlib
import pickle
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TypeVar

import zenocap
from tests.support.places import ROOT
from zenocap.common.cache import cache_folder, mark_used, read_entry, write_entry
from zenocap.common.runtime.service_info import versions
from zenocap.common.source_digests import Sources

T = TypeVar("T")
made_s = 0.0  # processor time of this process spent in making what is kept


def stored(make: Callable[[], T], *key: object, sources: Sequence[str] = ("zenocap.simulation",)) -> T:
    """Return make(), from the cache if an earlier call with equal key and equal sources has made it.

    key: everything that `make` depends on, with a stable `repr`.  sources: modules or packages that it runs, as in
    "zenocap.tools.takes.track" or "tests.support.walkers"; all that these import counts as well.
    """
    folder = cache_folder() / "tests" / _digest(tuple(sources))
    mark_used(folder)
    path = folder / hashlib.sha256(repr(key).encode()).hexdigest()[:24]
    content = read_entry(path)
    if content is not None:
        value: T = pickle.loads(content)
        return value
    global made_s
    start_s = time.process_time()
    value = make()
    made_s += time.process_time() - start_s
    write_entry(path, pickle.dumps(value))
    return value


def stored_files(folder: Path, make: Callable[[Path], object], *key: object, sources: Sequence[str]) -> Path:
    """Fill an empty folder with the files that make(folder) writes, from the cache as `stored`; return the folder."""

    def made() -> dict[str, bytes]:
        make(folder)
        return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}

    for name, content in stored(made, "files", *key, sources=sources).items():
        path = folder / name
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    return folder


@cache
def _sources() -> Sources:
    folders = {"zenocap": Path(zenocap.__file__).parent, "tests": ROOT / "tests", "benchmarks": ROOT / "benchmarks"}
    return Sources(folders)


@cache
def surroundings() -> str:
    """Digest of what every result depends on beside its sources: data of the package, versions, processor."""
    data = sorted(path for path in (ROOT / "zenocap" / "data").rglob("*") if path.is_file() and path.suffix != ".pyc")
    return hashlib.sha256(b"\0".join([repr(versions()).encode(), *(path.read_bytes() for path in data)])).hexdigest()


@cache
def _digest(modules: tuple[str, ...]) -> str:
    names = []
    for module in modules:
        path = module.replace(".", "/")
        found = [name for name in _sources().texts if name == f"{path}.py" or name.startswith(f"{path}/")]
        if not found:
            raise ValueError(f"sources = {module!r}: no module of zenocap or of the tests")
        names += found
    return hashlib.sha256(f"{surroundings()} {_sources().digest(names)}".encode()).hexdigest()[:24]
