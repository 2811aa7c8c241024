"""Compiled kernels: numba's decorators with one set of options, and a cache that is never older than its sources.

numba drops a cached kernel when its own file changes, but not when a kernel or a constant imported from another file does:
the old machine code would be used without a word.  Importing this module compares all files that kernels depend on
with those of the last time and deletes the cached kernels that depend on a changed one.
"""

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TypeVar, cast

import numpy as np
from numba import njit

F = TypeVar("F", bound=Callable[..., object])

PACKAGE = "zenocap"
# For comparisons of eight pixels as a word: with a plain 0, which is signed, a loop over words takes three times as long.
NO_BITS = np.uint64(0)
FINITE = {"nnan", "ninf", "nsz"}  # LLVM's fast-math flags that leave results alone
USES_KERNELS = re.compile(rf"^from {PACKAGE}\.common\.jit import", re.MULTILINE)
IMPORT = re.compile(rf"^\s*(?:from|import)\s+({PACKAGE}[\w.]*)(?:\s+import\s+(?:\(([^)]*)\)|([^\n]*)))?", re.MULTILINE)


def kernel(function: F) -> F:
    """Compile a function, cached on disk; divisions by zero give infinity or NaN as in numpy.

    It runs without Python's global lock, so that other threads continue meanwhile.
    """
    return cast(F, njit(cache=True, error_model="numpy", nogil=True)(function))


def finite_kernel(function: F) -> F:
    """The same for finite numbers only: no NaN, no infinity, which loops with min and max need to be vectorized.

    Of LLVM's fast-math flags only those that leave results alone are set.  Reordered sums and fused operations would
    make the last digits depend on whether a kernel's callees were compiled in the same process or loaded from the cache.
    """
    return cast(F, njit(cache=True, error_model="numpy", nogil=True, fastmath=FINITE)(function))


def leaf_kernel(function: F) -> F:
    """The same as `kernel` for functions that create and return no array.

    References to its arguments are not counted: that takes two atomic operations for each array of each call, more than the
    arithmetic of a short function, and threads that share the arrays wait for one another.
    """
    return _without_references(function)


def finite_leaf_kernel(function: F) -> F:
    """The same as `finite_kernel` for functions that create and return no array."""
    return _without_references(function, fastmath=FINITE)


def _without_references(function: F, **options: object) -> F:
    compiler = cast(Callable[..., Callable[[F], F]], njit)  # its annotations lack the option _nrt
    return compiler(cache=True, error_model="numpy", nogil=True, _nrt=False, **options)(function)


def inlined_kernel(function: F) -> F:
    """The same, inlined into its callers."""
    return cast(F, njit(cache=True, error_model="numpy", inline="always")(function))


def discard_outdated(package: Path, caches: Path | None) -> list[Path]:
    """Delete the cached kernels of `package` that were compiled from other sources than today's; return their sources.

    package: folder of the package `zenocap`.  caches: the folder that NUMBA_CACHE_DIR names; None: kernels are cached
    beside their sources.  Where the record of the last time cannot be written, nothing is done: such an installation
    changes as a whole, with new times of all files, which numba sees.
    """
    folder = package / "__pycache__" if caches is None else caches
    record = folder / f"kernels-{hashlib.sha256(str(package).encode()).hexdigest()[:12]}.json"
    before = _read(record)
    if before and _unchanged(package, before["stamps"]):
        return []
    digests, stamps = _sources(package)
    outdated = [package / name for name, digest in digests.items() if before.get("digests", {}).get(name) != digest]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for source in outdated:
            for path in _cached(source, caches):
                path.unlink(missing_ok=True)
        temporary = record.with_suffix(f".{os.getpid()}")
        temporary.write_text(json.dumps({"digests": digests, "stamps": stamps}))
        temporary.replace(record)
    except OSError:
        return []
    return outdated


def _cached(source: Path, caches: Path | None) -> Iterable[Path]:
    """Files of numba's cache that belong to a source."""
    folders = [source.parent / "__pycache__"] if caches is None else caches.glob(f"{source.parent.name}_*")
    for folder in folders:
        yield from folder.glob(f"{source.stem}.*.nb[ic]")


def _read(record: Path) -> dict[str, dict[str, str]]:
    try:
        found = json.loads(record.read_text())
    except (OSError, ValueError):
        return {}
    good = isinstance(found, dict) and all(isinstance(found.get(key), dict) for key in ("digests", "stamps"))
    return found if good else {}


def _stamp(path: Path) -> str:
    try:
        status = path.stat()
    except OSError:
        return "missing"
    return f"{status.st_mtime_ns} {status.st_size}"


def _unchanged(package: Path, stamps: Mapping[str, str]) -> bool:
    return bool(stamps) and all(_stamp(package / name) == stamp for name, stamp in stamps.items())


def _sources(package: Path) -> tuple[dict[str, str], dict[str, str]]:
    """By path: of each file with kernels, a digest of it and of all that it imports; of all these, a stamp."""
    texts: dict[str, str] = {}
    for folder, _, names in os.walk(package, followlinks=True):
        for name in names:
            if name.endswith(".py"):
                path = Path(folder) / name
                texts[str(path.relative_to(package))] = path.read_text(encoding="utf-8")
    imports = {name: _imports(text, texts) for name, text in texts.items()}
    digests, used = {}, set()
    for name, text in texts.items():
        if USES_KERNELS.search(text):
            closure = _closure(name, imports)
            used |= closure
            content = "\0".join(f"{one}\0{texts[one]}" for one in sorted(closure))
            digests[name] = hashlib.sha256(content.encode()).hexdigest()
    return digests, {name: _stamp(package / name) for name in sorted(used)}


def _imports(text: str, known: Mapping[str, str]) -> set[str]:
    """Files of the package that a file imports."""
    found = set()
    for module, *names in IMPORT.findall(text):
        candidates = [module, *(f"{module}.{name}" for name in re.findall(r"\w+", " ".join(names)))]
        for candidate in candidates:
            path = "/".join(candidate.split(".")[1:])
            found |= {name for name in (f"{path}.py", f"{path}/__init__.py".lstrip("/")) if name in known}
    return found


def _closure(name: str, imports: Mapping[str, set[str]]) -> set[str]:
    seen: set[str] = set()
    waiting = [name]
    while waiting:
        if (one := waiting.pop()) not in seen:
            seen.add(one)
            waiting += imports[one]
    return seen


def _cache_folder() -> Path | None:
    own = os.environ.get("NUMBA_CACHE_DIR")  # numba's own setting
    return Path(own) if own else None


discard_outdated(Path(__file__).parents[1], _cache_folder())  # __file__ as imported: inside the package, through its links
