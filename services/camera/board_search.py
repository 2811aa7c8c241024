"""The search of a board in an ended film: a process of its own, so that no frame waits for it."""

import logging
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from zenocap.common.messages import FilmBoard
from zenocap.common.runtime.foreign_text import printable
from zenocap.services.camera.files import FilmFiles
from zenocap.services.camera.parameters import LAST_BYTES, SEARCH_STOP_S

logger = logging.getLogger(__name__)

Command = Callable[[FilmBoard, Path, Path], Sequence[str]]
"""Command that searches a board in a video and writes a file with its corners into a folder."""


class BoardSearch:
    """Runs a command that writes `corners`.  files: these corners, once they are found."""

    def __init__(self, board: FilmBoard, command: Sequence[str], corners: Path) -> None:
        """Raises OSError."""
        self.board, self.files = board, FilmFiles({"corners": corners})
        self._corners, self._failure = corners, ""
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 # read after the process has ended
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._output, start_new_session=True
        )

    @property
    def state(self) -> Literal["searching", "found", "failed"]:
        if self._failure:
            return "failed"
        if (status := self._process.poll()) is None:
            return "searching"
        return "found" if status == 0 and self._corners.is_file() else "failed"

    @property
    def failure(self) -> str:
        """Reason that the board was not found; empty otherwise."""
        return (self._failure or self._last_line()) if self.state == "failed" else ""

    def stop(self, reason: str) -> None:
        """End the process where it runs."""
        if self.state == "searching":
            logger.warning("the search of a board is ended: %s", reason)
            self._process.terminate()
            try:
                self._process.wait(SEARCH_STOP_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            self._failure = reason
        self.files.close()

    def _last_line(self) -> str:
        self._output.seek(0, 2)
        self._output.seek(max(0, self._output.tell() - LAST_BYTES))
        lines = self._output.read().decode(errors="replace").replace("\r", "\n").split("\n")
        return next(
            (printable(line.removeprefix("error: ")) for line in reversed(lines) if line.strip()),
            f"exit status {self._process.returncode}",
        )
