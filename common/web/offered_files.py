"""Saved files that pages can get: the latest ones, each at a path of its own that cannot be guessed."""

import threading
from pathlib import Path
from secrets import token_urlsafe
from urllib.parse import quote

from zenocap.common.web.content import Answer
from zenocap.common.web.parameters import MAX_OFFERED, MAX_OFFERED_BYTES

OFFERED_PATH = "/saved/"


class OfferedFiles:
    """The latest MAX_OFFERED files; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[str, Path] = {}

    def offer(self, path: Path) -> str:
        """Return the path at which pages get a file; "" for a file that is larger than MAX_OFFERED_BYTES."""
        if path.stat().st_size > MAX_OFFERED_BYTES:
            return ""
        address = OFFERED_PATH + token_urlsafe(16)
        with self._lock:
            self._files[address] = path
            while len(self._files) > MAX_OFFERED:
                del self._files[next(iter(self._files))]
        return address

    def read(self, address: str) -> Answer | None:
        """Content of the file at a path, and headers by which a browser saves it under its name.

        None for another path, or for a file that was removed or has grown beyond MAX_OFFERED_BYTES.
        """
        with self._lock:
            path = self._files.get(address)
        try:
            if path is None or path.stat().st_size > MAX_OFFERED_BYTES:
                return None
            body = path.read_bytes()
        except OSError:
            return None
        disposition = f"attachment; filename*=UTF-8''{quote(path.name, safe='')}"
        return body, {"Content-Type": "application/octet-stream", "Content-Disposition": disposition}
