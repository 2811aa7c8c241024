"""The files of an ended film, or its corners: their sizes and checksums, and parts of them."""

import hashlib
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from zenocap.common.messages import FILM_PART_BYTES, FilmFile

Kind = Literal["video", "times", "corners"]


class FilmFiles:
    """paths: of the video and its times, or of the corners of a board.

    Checksums are computed on a thread: a long film takes a while.
    """

    def __init__(self, paths: Mapping[Kind, Path]) -> None:
        self._paths = dict(paths)
        self._sums: dict[Kind, str] = {}
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def compute(self) -> None:
        """Begin to compute the checksums, the first time."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._compute, name="film-checksum", daemon=True)
            self._thread.start()

    def known(self) -> dict[Kind, FilmFile]:
        """Size and checksum of each file that exists."""
        return {
            kind: FilmFile(bytes=path.stat().st_size, sha256=self._sums.get(kind, ""))
            for kind, path in self._paths.items()
            if path.is_file()
        }

    def part(self, kind: Kind, offset: int) -> bytes:
        """At most FILM_PART_BYTES from `offset` on; none behind the end.  Raises OSError."""
        with self._paths[kind].open("rb") as file:
            file.seek(offset)
            return file.read(FILM_PART_BYTES)

    def close(self) -> None:
        self._stop.set()

    def _compute(self) -> None:
        for kind, path in self._paths.items():
            digest = hashlib.sha256()
            if not path.is_file():
                continue
            with path.open("rb") as file:
                while data := file.read(FILM_PART_BYTES):
                    if self._stop.is_set():
                        return
                    digest.update(data)
            self._sums[kind] = digest.hexdigest()
