"""Saved files that pages can get: the latest ones, each at a path of its own that cannot be guessed."""

import threading
from dataclasses import dataclass
from pathlib import Path
from secrets import token_urlsafe
from urllib.parse import quote

from zenocap.common.web.content import Answer
from zenocap.common.web.parameters import MAX_OFFERED, MAX_OFFERED_BYTES

OFFERED_PATH = "/saved/"


@dataclass(frozen=True)
class OfferedFile:
    """A file and the header by which a browser saves it under its name."""

    path: Path
    disposition: str


class OfferedFiles:
    """The latest MAX_OFFERED files; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[str, OfferedFile] = {}

    def offer(self, path: Path) -> str:
        """Return the path at which pages get a file; "" for a file that is larger than MAX_OFFERED_BYTES."""
        if path.stat().st_size > MAX_OFFERED_BYTES:
            return ""
        address = OFFERED_PATH + token_urlsafe(16)
        with self._lock:
            self._files[address] = OfferedFile(path, f"attachment; filename*=UTF-8''{quote(path.name, safe='')}")
            while len(self._files) > MAX_OFFERED:
                del self._files[next(iter(self._files))]
        return address

    def read(self, address: str) -> Answer | None:
        """Content and headers of the file at a path; None where `at` has none."""
        found = self.at(address)
        try:
            body = found.path.read_bytes() if found is not None else b""
        except OSError:
            return None
        fields = {"Content-Type": "application/octet-stream"}
        return None if found is None else (body, {**fields, "Content-Disposition": found.disposition})

    def at(self, address: str) -> OfferedFile | None:
        """The file at a path; None for another path, or for a file that was removed or has grown."""
        with self._lock:
            found = self._files.get(address)
        try:
            return found if found is not None and found.path.stat().st_size <= MAX_OFFERED_BYTES else None
        except OSError:
            return None
