"""Detect which parts of `zenocap warmup` have their machine code in numba's cache.

A process that has run a part writes a record: the source files with compiled functions, their times and sizes, and the
index files of the cache.  A part is compiled when its record matches the present files.  Does not import numba, which
takes half a second.
"""

import logging
import os
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import msgspec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.runtime.service_info import processor


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """environment: what machine code depends on besides its source.  sources: modification time (ns) and size by path.

    indexes: the index files of numba's cache.
    """

    environment: tuple[str, ...]
    sources: dict[str, tuple[int, int]]
    indexes: tuple[str, ...]


def is_compiled(part: str) -> bool:
    """Whether the machine code of a part is in the cache, for the present sources."""
    try:
        record = msgspec.json.decode(_record_file(part).read_bytes(), type=Record)
        unchanged = all(_stamp(Path(path)) == stamp for path, stamp in record.sources.items())
    except (OSError, msgspec.MsgspecError):
        return False
    return record.environment == _environment() and unchanged and all(Path(path).is_file() for path in record.indexes)


def record_compiled(part: str) -> None:
    """Record that this process has run a part.  Does nothing when the cache cannot be written."""
    sources: dict[str, tuple[int, int]] = {}
    indexes: set[str] = set()
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if not name.startswith("zenocap.") or file is None:
            continue
        for value in list(vars(module).values()):
            index = _index_of(value)
            if index is not None and getattr(value, "__module__", None) == name:
                sources[file] = _stamp(Path(file))
                indexes.add(index)
    record = Record(environment=_environment(), sources=sources, indexes=tuple(sorted(indexes)))
    try:
        path = _record_file(part)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, msgspec.json.encode(record))
    except OSError:
        return


@contextmanager
def compiling(logger: logging.Logger, name: str, part: str) -> Iterator[None]:
    """Log that the `with` body compiles and record it as `name`, unless `name` or `part` is in the cache."""
    if is_compiled(name) or is_compiled(part):
        yield
        return
    logger.info("compiling (first run only)")
    yield
    record_compiled(name)


def _index_of(value: object) -> str | None:
    """Index file of a compiled function's cache; None for other objects and for functions not called yet."""
    cache = getattr(getattr(value, "_cache", None), "_cache_file", None)
    index = getattr(cache, "_index_path", None)
    return index if isinstance(index, str) and Path(index).is_file() else None


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_mtime_ns, status.st_size


def _environment() -> tuple[str, ...]:
    return platform.python_version(), version("numba"), processor()


def _record_file(part: str) -> Path:
    """In the folder of this module's byte code, as numba does, or in the user's cache when that cannot be written."""
    own = os.environ.get("NUMBA_CACHE_DIR")  # numba's own setting
    beside = Path(__file__).parent / "__pycache__"
    if own:
        folder = Path(own)
    elif os.access(beside if beside.is_dir() else beside.parent, os.W_OK):
        folder = beside
    else:
        folder = Path.home() / ".cache" / "zenocap"
    return folder / f"compiled-{part}.json"
