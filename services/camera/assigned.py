"""Assignment of one camera of a camera host, and the viewer that runs there.

An assignment chooses among the cameras that are announced, and has the calibration and settings of a viewer; no path,
command or address is taken from it.
"""

import logging
import socket
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import msgspec

from zenocap.common.errors import UserError
from zenocap.common.messages import AssignQuery, AssignReply
from zenocap.common.rig.hosted import hosted_rig
from zenocap.common.rig.sources import LiveSource
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.foreign_text import printable
from zenocap.services.camera.child import Child
from zenocap.services.camera.parameters import VIEWER_LEASE_S
from zenocap.services.camera.saved import SavedAssignment, read_saved, write_saved

logger = logging.getLogger(__name__)


class AssignedCamera:
    """One camera: free, or used by a viewer of a rig, which is a process of its own."""

    def __init__(
        self,
        source: LiveSource,
        file: Path,
        command: Callable[[Path], Sequence[str]],
        clock: Clock,
        *,
        previews: bool,
        is_filmed: Callable[[], bool] = lambda: False,
    ) -> None:
        """file: where the assignment is saved; one that is there is taken up.  command: of the viewer of such a file.

        previews: whether small pictures may leave this machine.  is_filmed: whether the camera is being filmed.
        """
        self._source, self._file, self._command, self._clock = source, file, command, clock
        self._previews, self._is_filmed = previews, is_filmed
        self._lock = threading.RLock()
        self._query: AssignQuery | None = None
        self._child: Child | None = None
        self._asked_ns = 0
        if file.is_file():
            self._resume()

    @property
    def used_by(self) -> str:
        """The viewer that has the camera, for display; empty when it is free."""
        query = self._query
        return "" if query is None or query.viewer is None else f"viewer {query.viewer.id} of rig {query.rig}"

    def answer(self, query: AssignQuery) -> AssignReply:
        with self._lock:
            self.check()
            refused = ""
            try:
                self._obey(query)
            except UserError as error:
                refused = f"{error}"
            except OSError as error:
                refused = f"{error.filename or 'the viewer'}: {error.strerror or error}"
            return self._reply(query, refused)

    def check(self) -> None:
        """Look after the viewer; end it when its rig is gone."""
        with self._lock:
            if self._query is None or self._child is None:
                return
            if self._clock.elapsed_ns() - self._asked_ns > VIEWER_LEASE_S * 1e9:
                self._end(f"rig {self._query.rig} is gone: no query for {VIEWER_LEASE_S:.0f} s")
            else:
                self._child.check()

    def close(self) -> None:
        """End the viewer; the assignment stays saved."""
        with self._lock:
            if self._child is not None:
                self._child.stop()
            self._child = None

    def _obey(self, query: AssignQuery) -> None:
        if query.what == "state":
            return
        own = self._query
        if own is not None and own.rig != query.rig:
            raise UserError(f"the camera is used by {self.used_by}: allowed when that rig has ended")
        if query.what == "release":
            if own is not None:
                self._end("released")
            return
        self._asked_ns = self._clock.elapsed_ns()
        if own is not None and _same(own, query):
            return
        hosted_rig(query, self._source, Path(), previews=self._previews)  # its errors are the refusal
        if own is not None and own.viewer is not None and query.viewer is not None and own.viewer.id != query.viewer.id:
            raise UserError(f"the camera is used by {self.used_by}: allowed: one viewer for each camera")
        if own is not None:
            self._end("assigned again with other settings")
        if self._is_filmed():
            raise UserError("the camera is being filmed: allowed when the film has ended")
        self._begin(query)

    def _begin(self, query: AssignQuery) -> None:
        write_saved(self._file, SavedAssignment(query=query, source=self._source.text, previews=self._previews))
        self._query, self._asked_ns = query, self._clock.elapsed_ns()
        logger.warning("%s: assigned", self.used_by)
        self._child = Child(self.used_by, self._command(self._file), lambda: self._clock.elapsed_ns() / 1e9)

    def _resume(self) -> None:
        """Go on with a saved assignment, of the camera as it is named now."""
        try:
            query = read_saved(self._file).query
            hosted_rig(query, self._source, Path(), previews=self._previews)
            self._begin(query)
        except (UserError, OSError) as error:
            logger.warning("%s; the camera is free", printable(error))

    def _end(self, reason: str) -> None:
        logger.warning("%s: ended: %s", self.used_by, printable(reason))
        if self._child is not None:
            self._child.stop()
        self._query = self._child = None
        self._file.unlink(missing_ok=True)

    def _reply(self, query: AssignQuery, refused: str) -> AssignReply:
        own, child = self._query, self._child
        state: Literal["free", "running", "waiting"]
        state = "free" if own is None or child is None else "running" if child.is_running else "waiting"
        return AssignReply(
            frame=query.frame, captured_ns=self._clock.now_ns(), host=printable(socket.gethostname()), state=state,
            refused=printable(refused, 900), failure="" if child is None else printable(child.failure, 900),
            rig=None if own is None else own.rig, viewer=None if own is None or own.viewer is None else own.viewer.id,
            restarts=0 if child is None else max(0, child.restarts), previews=self._previews,
        )  # fmt: skip


def _same(one: AssignQuery, other: AssignQuery) -> bool:
    """Whether two queries assign the same."""
    return msgspec.structs.replace(one, frame=0, captured_ns=0) == msgspec.structs.replace(other, frame=0, captured_ns=0)
