"""Digests of source files and of all files of the package that they import."""

import hashlib
import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from zenocap.common.cache import cache_folder, read_entry, write_entry

PACKAGE = "zenocap"
IMPORT = re.compile(r"^\s*(?:from|import)\s+(\w[\w.]*)(?:\s+import\s+(?:\(([^)]*)\)|([^\n]*)))?", re.MULTILINE)
USES_KERNELS = re.compile(rf"^from {PACKAGE}\.common\.jit import", re.MULTILINE)


class Sources:
    """All source files of some packages and the files among them that each one imports.

    packages: folders by the packages' names.  A file's name is that of the package with its path inside it.
    """

    def __init__(self, packages: Mapping[str, Path]) -> None:
        self.texts: dict[str, str] = {}
        for package, start in packages.items():
            for folder, _, names in os.walk(start, followlinks=True):
                for name in names:
                    if name.endswith(".py"):
                        path = Path(folder) / name
                        self.texts[f"{package}/{path.relative_to(start)}"] = path.read_text(encoding="utf-8")
        self._imports = {name: self._imported(text) for name, text in self.texts.items()}

    def closure(self, names: Iterable[str]) -> set[str]:
        """The files and all that they import, directly or not."""
        seen: set[str] = set()
        waiting = list(names)
        while waiting:
            if (one := waiting.pop()) not in seen:
                seen.add(one)
                waiting += self._imports[one]
        return seen

    def digest(self, names: Iterable[str]) -> str:
        """SHA-256 of the files and of all that they import."""
        content = "\0".join(f"{one}\0{self.texts[one]}" for one in sorted(self.closure(names)))
        return hashlib.sha256(content.encode()).hexdigest()

    def _imported(self, text: str) -> set[str]:
        found = set()
        for module, *names in IMPORT.findall(text):
            candidates = [module, *(f"{module}.{name}" for name in re.findall(r"\w+", " ".join(names)))]
            for candidate in candidates:
                path = candidate.replace(".", "/")
                found |= {name for name in (f"{path}.py", f"{path}/__init__.py") if name in self.texts}
        return found


def kernel_digests(package: Path, needed: str | None = None) -> Mapping[str, str]:
    """Digest of each file with compiled functions and of all that it imports, by its path inside the package.

    They are kept in the cache with the times and sizes of the files, so that a start does not read all sources.
    needed: a file that must be among them; one that is new since then is not in what is kept.
    """
    record = cache_folder() / "sources" / f"{hashlib.sha256(str(package).encode()).hexdigest()[:16]}.json"
    kept = _read(record)
    if (
        kept is not None
        and needed in (None, *kept["digests"])
        and all(_stamp(package / name) == stamp for name, stamp in kept["stamps"].items())
    ):
        return kept["digests"]
    sources = Sources({PACKAGE: package})
    names = [name for name, text in sources.texts.items() if USES_KERNELS.search(text)]
    digests = {_inside(name): sources.digest([name]) for name in names}
    stamps = {_inside(name): _stamp(package / _inside(name)) for name in sorted(sources.closure(names))}
    write_entry(record, json.dumps({"digests": digests, "stamps": stamps}).encode())
    return digests


def _inside(name: str) -> str:
    return name.removeprefix(f"{PACKAGE}/")


def _read(record: Path) -> dict[str, dict[str, str]] | None:
    content = read_entry(record)
    return None if content is None else json.loads(content)


def _stamp(path: Path) -> str:
    try:
        status = path.stat()
    except OSError:
        return "missing"
    return f"{status.st_mtime_ns} {status.st_size}"
