"""Detect which parts of `zenocap warmup` have their machine code in the cache.

A process that has run a part writes a record: the entries of the cache that it has used.  It is named after the part, the
sources of all compiled functions and what machine code depends on besides.  Does not import numba: half a second.
"""

import hashlib
import json
import logging
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import zenocap
from zenocap.common.cache import KERNELS, cache_folder, read_entry, write_entry
from zenocap.common.processor import processor
from zenocap.common.source_digests import kernel_digests


def is_compiled(part: str) -> bool:
    """Whether the machine code of a part is in the cache, for the present sources."""
    content = read_entry(_record(part))
    return content is not None and all((cache_folder() / KERNELS / name).is_file() for name in json.loads(content))


def record_compiled(part: str) -> None:
    """Record that this process has run a part.  Does nothing when the cache cannot be written."""
    write_entry(_record(part), json.dumps(sorted(_entries())).encode())


@contextmanager
def compiling(logger: logging.Logger, name: str, part: str) -> Iterator[None]:
    """Log that the `with` body compiles and record it as `name`, unless `name` or `part` is in the cache."""
    if is_compiled(name) or is_compiled(part):
        yield
        return
    logger.info("compiling (first run only)")
    yield
    record_compiled(name)


def _entries() -> set[str]:
    """Entries of the compiled functions of this process."""
    entries: set[str] = set()
    for name, module in list(sys.modules.items()):
        if name.startswith("zenocap."):
            for value in list(vars(module).values()):
                cached = getattr(value, "_cache", None)
                if cached is not None and hasattr(cached, "entries") and getattr(value, "__module__", None) == name:
                    entries |= {str(path.relative_to(cached.root)) for path in cached.entries()}
    return entries


def _environment() -> tuple[str, ...]:
    return platform.python_version(), version("numba"), processor()


def _record(part: str) -> Path:
    package = Path(zenocap.__file__).parent
    content = json.dumps([part, _environment(), kernel_digests(package)], sort_keys=True)
    return cache_folder() / "compiled" / f"{part}-{hashlib.sha256(content.encode()).hexdigest()[:16]}.json"
