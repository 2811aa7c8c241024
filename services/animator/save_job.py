"""Saving the take that is played for other programs: one command at a time, in a process of its own.

The command writes into a hidden folder beside its destination, which is removed at the end whatever happens.  A complete
file is moved to a name that is not taken yet, so that no file is ever replaced.
"""

import logging
import os
import subprocess
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import msgspec

from zenocap.common.atomic_write import free_names, rename_new
from zenocap.common.errors import UserError
from zenocap.services.animator.page.save_messages import DRAWN, SaveTake, SavingUpdate
from zenocap.services.animator.parameters import MAX_SAVED_LINES, MAX_SAVED_NAMES, SAVING_END_S
from zenocap.services.animator.save_command import (
    Progress,
    command_line,
    file_name,
    notes_of,
    page_formats,
    progress_of,
    reason,
    shift_s,
)

logger = logging.getLogger(__name__)
DONE, LOSS = 0, 3  # exit statuses with a file


class SaveJob:
    """Saves takes for pages.  publish: called with every state of the work.

    offer: makes a saved file available to pages and returns its path there; "" for one that is too large.
    niceness: of the process, so that a live rig keeps its rates.  running: whether a file is being written; False before
    its last state is published, so that a page can start another.
    """

    def __init__(self, publish: Callable[[SavingUpdate], None], offer: Callable[[Path], str], niceness: int = 0) -> None:
        self._publish, self._offer, self._niceness = publish, offer, niceness
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[str] | None = None
        self._cancelled = threading.Event()
        self.running = False

    def start(self, request: SaveTake, take: Path, folder: Path, *, raw: bool = False, kept: bool = True) -> None:
        """Save `take` into `folder`; returns at once.

        kept: see `SavingUpdate`.  Raises ValueError for an unknown format, and while another file is being written.
        """
        if request.kind not in (allowed := (*page_formats(), *DRAWN)):
            raise ValueError(f"refused: format {request.kind!r}: allowed: {', '.join(allowed)}")
        with self._lock:
            if self.running:
                raise ValueError("refused: another file is being saved; wait for its end or cancel it")
            if request.start_s is not None and request.end_s is not None and request.end_s < request.start_s:
                raise ValueError(f"refused: the part ends at {request.end_s:g} s: allowed: {request.start_s:g} s or later")
            self._cancelled.clear()
            self.running = True
            arguments = (request, take, folder, raw, kept)
            self._thread = threading.Thread(target=self._run, args=arguments, name="saving", daemon=True)
            self._thread.start()

    def cancel(self) -> None:
        """End the work on the file, if there is any; returns at once."""
        self._cancelled.set()
        process = self._process
        if process is not None:
            with suppress(OSError):
                process.terminate()

    def close(self) -> None:
        self.cancel()
        if self._thread is not None:
            self._thread.join(2 * SAVING_END_S)

    def _run(self, request: SaveTake, take: Path, folder: Path, raw: bool, kept: bool) -> None:
        name = file_name(take.stem, request)
        self._publish(SavingUpdate("running", name))
        try:
            with tempfile.TemporaryDirectory(prefix=".zenocap-", dir=folder, ignore_cleanup_errors=True) as hidden:
                update = self._write(request, take, Path(hidden) / name, folder, raw)
        except OSError as error:
            update = SavingUpdate("failed", name, text=f"{folder}: cannot be written: {error.strerror or error}")
        except UserError as error:
            update = SavingUpdate("failed", name, text=str(error).partition("\n")[0])
        if self._cancelled.is_set() and update.state == "failed":
            update = SavingUpdate("cancelled", name)
        self.running = False
        self._publish(msgspec.structs.replace(update, kept=kept))

    def _write(self, request: SaveTake, take: Path, unfinished: Path, folder: Path, raw: bool) -> SavingUpdate:
        """Run the command and move its file to `folder`; return the last state.  Raises UserError and OSError."""
        part = request.start_s is not None or request.end_s is not None
        shift = shift_s(take, request, raw=raw) if part else 0.0
        status, printed, errors = self._execute(command_line(take, unfinished, request, shift, raw=raw), unfinished.name)
        hidden = f"{unfinished.parent}{os.sep}"
        if status not in (DONE, LOSS) or self._cancelled.is_set():
            return SavingUpdate("failed", unfinished.name, text=reason(errors, status).replace(hidden, ""))
        saved = moved(unfinished, folder)
        text = (printed[-1] if printed else "").replace(hidden, "").removeprefix(f"{unfinished.name}: ")
        return SavingUpdate("done", saved.name, text=text, notes=notes_of(errors), address=self._offer(saved))

    def _execute(self, command: list[str], name: str) -> tuple[int, list[str], list[str]]:
        """Exit status, and the last lines of standard output and error."""
        errors: list[str] = []
        with subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
            start_new_session=True,
        ) as process:  # fmt: skip
            self._process = process
            if self._niceness:
                with suppress(OSError):
                    os.setpriority(os.PRIO_PROCESS, process.pid, self._niceness)
            if self._cancelled.is_set():
                process.terminate()
            assert process.stdout is not None  # they are pipes
            assert process.stderr is not None
            before: Progress | None = None
            for line in process.stderr:
                progress = progress_of(line)
                if progress is None:
                    errors.append(line.rstrip("\n"))
                    del errors[:-MAX_SAVED_LINES]
                elif progress != before and not self._cancelled.is_set():
                    before = progress
                    self._publish(SavingUpdate("running", name, progress.done, progress.total or 0))
            printed = process.stdout.read().splitlines()[-MAX_SAVED_LINES:]
            try:
                status = process.wait(SAVING_END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                status = process.wait()
            self._process = None
        return status, printed, errors


def moved(file: Path, folder: Path) -> Path:
    """Move a file into a folder, as walk.bvh, or walk-2.bvh and so on where that exists; return its path.

    Raises OSError, and UserError when MAX_SAVED_NAMES names are taken.
    """
    for target in free_names(folder / file.name, MAX_SAVED_NAMES):
        with suppress(FileExistsError):
            rename_new(file, target)
            return target
    raise UserError(f"{folder / file.name}: {MAX_SAVED_NAMES} files of this name exist: move some of them away")
