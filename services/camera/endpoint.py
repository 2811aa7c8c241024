"""The films of one camera at the command of another program: what is obeyed, and what is refused.

States: idle -> opening -> ready -> filming -> ended -> (open) opening.
"""

import logging
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from zenocap.common.arrays import LARGEST_PX
from zenocap.common.errors import UserError
from zenocap.common.messages import FilmQuery, FilmReply
from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX
from zenocap.common.rig.rig import Rig
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.video.parameters import RESERVE_BYTES
from zenocap.services.camera.board_search import BoardSearch, Command
from zenocap.services.camera.feeds import Feed
from zenocap.services.camera.files import FilmFiles
from zenocap.services.camera.parameters import EARLIEST_S, FILM_LEASE_S, FILMS, LATEST_S, OPEN_S
from zenocap.services.camera.recorder import Recorder, free_bytes_of

logger = logging.getLogger(__name__)

State = Literal["idle", "opening", "ready", "filming", "ended"]


@dataclass(frozen=True)
class Permission:
    """Permissions of a camera.

    read: films may leave this machine; with certificates only, for on an open network all receive the queries of who films.
    """

    film: bool = False
    read: bool = False


class _Refused(Exception):
    """The query is not obeyed; the text is the reason."""


class FilmEndpoint:
    """Films of one camera, into `folder`/NAME/videos, `folder`/NAME/times and `folder`/NAME/corners, and nowhere else."""

    def __init__(
        self, feed: Feed, camera: str | None, folder: Path, permission: Permission, clock: Clock, host: str = "",
        free_bytes: Callable[[Path], int] = free_bytes_of, used_by: Callable[[], str] = lambda: "",
        detect: Command | None = None,
    ) -> None:  # fmt: skip
        """camera: name that the files must have; None: that of the query.  host: default: that of this machine.

        used_by: user of the camera, which cannot be filmed here then; empty for none.  detect: command that searches a
        board in a film; None: none is searched.
        """
        self._detect_command = detect
        self._search: BoardSearch | None = None
        self._used_by = used_by
        self._feed, self._camera, self._folder, self._permission = feed, camera, folder, permission
        self._clock, self._host, self._free_bytes = clock, host or socket.gethostname(), free_bytes
        self._lock = threading.RLock()
        self._state: State = "idle"
        self._query: FilmQuery | None = None  # that opened the film
        self._recorder: Recorder | None = None
        self._files: FilmFiles | None = None
        self._failure = ""
        self._end_ns: int | None = None  # of the film, where its length was given
        self._asked_ns = self._opened_ns = 0  # elapsed, of the last query of who films, and when it opened the film

    @property
    def is_recording(self) -> bool:
        return self._state in ("opening", "ready", "filming")

    def sender(self) -> str:
        """Who films; "" before any."""
        return "" if self._query is None else self._query.sender

    def answer(self, query: FilmQuery) -> FilmReply:
        with self._lock:
            self.check()
            refused, data = "", b""
            if query.sender == self.sender():
                self._asked_ns = self._clock.elapsed_ns()
            try:
                if query.what != "state":
                    data = self._obey(query)
            except (_Refused, UserError) as error:
                refused = f"{error}"
            except OSError as error:
                refused = f"{printable(error.filename or '')}: {error.strerror or error}"
            return self._reply(query, refused, data)

    def check(self) -> None:
        """End a film that is over, that failed, or whose commander is gone."""
        with self._lock:
            now_ns, gone = self._clock.elapsed_ns(), f"who filmed is gone: no query for {FILM_LEASE_S:.0f} s"
            late = now_ns - self._asked_ns > FILM_LEASE_S * 1e9
            if late and self._search is not None and self._search.state == "searching":
                self._search.stop(gone)
            if not self.is_recording or self._recorder is None:
                return
            end_ns = self._end_ns if self._state == "filming" else None
            if self._feed.failure or self._recorder.failure:
                self._end(self._recorder.failure or self._feed.failure)
            elif self._recorder.complete or (end_ns is not None and self._clock.now_ns() > end_ns + 1_000_000_000):
                self._end("")
            elif late:
                self._end(gone)
            elif self._state != "filming" and now_ns - self._opened_ns > OPEN_S * 1e9:
                self._end(f"not started within {OPEN_S:.0f} s")
            elif self._state == "opening" and self._recorder.ready:
                self._state = "ready"

    def close(self) -> None:
        """End a film that is being recorded."""
        with self._lock:
            if self.is_recording:
                self._end("the program that has the camera was ended")
            if self._files is not None:
                self._files.close()
            if self._search is not None:
                self._search.stop("the program that has the camera was ended")

    def _obey(self, query: FilmQuery) -> bytes:
        if not self._permission.film:
            raise _Refused("this camera may not be filmed: allowed with film = true in the rig file")
        if query.film is None:
            raise _Refused("film: a name is missing")
        if query.what == "open":
            self._open(query)
            return b""
        if self._query is None or self._query.film != query.film:
            raise _Refused(f"no film {query.film} was opened here")
        if self._query.sender != query.sender:
            raise _Refused(f"film {query.film} was opened by another program")
        match query.what:
            case "start":
                self._start(query)
            case "stop":
                if self.is_recording:
                    self._end("")
            case "files" | "read":
                return self._read(query)
            case "detect":
                self._detect(query)
        return b""

    def _open(self, query: FilmQuery) -> None:
        if self.is_recording and self._query is not None:
            raise _Refused(f"film {self._query.film} is being recorded: allowed: one at a time")
        if user := self._used_by():
            raise _Refused(f"the camera is used by {user}: allowed: to film that rig")
        if query.camera is None or self._camera not in (None, query.camera):
            raise _Refused(f"camera = {query.camera!r}: allowed: {self._camera or 'the name of the files'}")
        if self._search is not None and self._search.state == "searching" and self._query is not None:
            raise _Refused(f"a board is being searched in film {self._query.film}: allowed when that has ended")
        size, fps = self._feed.size_and_rate(query)
        if size[0] * size[1] > LARGEST_PX:
            raise _Refused(f"size = {list(size)}: allowed: {LARGEST_PX} pixels at most")
        place = self._folder / str(query.film)
        video, times = place / "videos" / f"{query.camera}.mkv", place / "times" / f"{query.camera}.csv"
        if video.exists() or times.exists():
            raise _Refused(f"{video} exists: allowed: another name for the film")
        for path in (self._folder, place, video.parent, times.parent):
            path.mkdir(parents=path is self._folder, exist_ok=True)
            if path is not self._folder and path.is_symlink():
                raise _Refused(f"{path}: a link: allowed: a folder")
        if (free := self._free_bytes(place)) < RESERVE_BYTES:
            raise _Refused(f"{place}: {free / 1e6:.0f} MB free: allowed: at least {RESERVE_BYTES / 1e6:.0f} MB")
        if self._files is not None:
            self._files.close()
        self._search = None
        self._recorder = Recorder(video, times, size, fps, self._free_bytes)
        self._files = FilmFiles({"video": video, "times": times})
        self._query, self._failure, self._end_ns = query, "", None
        self._asked_ns = self._opened_ns = self._clock.elapsed_ns()
        self._state = "opening"
        logger.warning("film %s: the camera is opened", query.film)
        self._feed.open(query, self._recorder.offer)

    def _start(self, query: FilmQuery) -> None:
        if self._state != "ready" or self._recorder is None:
            raise _Refused(f"the camera is not ready: {self._failure or self._state}")
        late_s = (self._clock.now_ns() - query.begin_ns) / 1e9
        if not -LATEST_S <= late_s <= EARLIEST_S:
            raise _Refused(f"begin_ns: {-late_s:.1f} s from now: allowed: {-EARLIEST_S:.0f} to {LATEST_S:.0f} s")
        self._end_ns = query.begin_ns + query.duration_ns if query.duration_ns else None
        self._recorder.begin(query.begin_ns, query.duration_ns)
        self._state = "filming"
        logger.warning("film %s: recording into %s", query.film, self._folder / str(query.film))

    def _end(self, failure: str) -> None:
        assert self._recorder is not None
        self._feed.close()
        self._recorder.end()
        self._failure = failure or self._recorder.failure
        self._state = "ended"
        logger.warning(
            "film %s: ended: %d frames%s", self._query.film if self._query else "", self._recorder.writer.frames,
            f": {printable(self._failure)}" if self._failure else "",
        )  # fmt: skip

    def _detect(self, query: FilmQuery) -> None:
        """Begin to search a board in the film; the same board is searched once, and again after a failure."""
        if self._detect_command is None:
            raise _Refused("no board is searched here: allowed: `zenocap calibrate detect` on this machine")
        if self._state != "ended" or self._query is None:
            raise _Refused("the film has not ended")
        if query.board is None:
            raise _Refused("board: a description is missing")
        if self._search is not None:
            if self._search.board == query.board and self._search.state != "failed":
                return
            self._search.stop("another search was begun")
        place, name = self._folder / str(query.film), self._query.camera
        corners = place / CORNERS
        if corners.is_symlink():
            raise _Refused(f"{corners}: a link: allowed: a folder")
        command = self._detect_command(query.board, place / "videos" / f"{name}.mkv", corners)
        logger.warning("film %s: a board is searched in it", query.film)
        self._search = BoardSearch(query.board, command, corners / f"{name}{CORNERS_SUFFIX}")

    def _read(self, query: FilmQuery) -> bytes:
        corners = query.file == "corners"  # they are no pictures
        if not (corners or self._permission.read):
            raise _Refused("pictures do not leave this machine: allowed in a rig with certificates (zenocap certs)")
        if self._state != "ended" or self._files is None:
            raise _Refused("the film has not ended")
        if corners and (self._search is None or self._search.state != "found"):
            raise _Refused("there are no corners of a board")
        files = self._search.files if corners and self._search is not None else self._files
        if query.what == "files":
            files.compute()
            return b""
        return files.part(query.file, query.offset)

    def _reply(self, query: FilmQuery, refused: str, data: bytes) -> FilmReply:
        own = query.sender == self.sender()
        recorder, writer = (None, None) if self._recorder is None else (self._recorder, self._recorder.writer)
        search = self._search if own else None
        files = self._files if query.file != "corners" else None if search is None else search.files
        told = files.known() if own and files is not None and query.what == "files" and not refused else {}
        try:
            free = self._free_bytes(self._folder if self._folder.exists() else Path())
        except OSError:
            free = 0
        return FilmReply(
            frame=query.frame, captured_ns=self._clock.now_ns(), host=printable(self._host), state=self._state,
            refused=printable(refused, 900), failure=printable(self._failure, 900),
            film=self._query.film if self._query else None,
            folder=str((self._folder / str(self._query.film)).resolve())[:1000] if own and self._query else "",
            may_film=self._permission.film, may_read=self._permission.read, frames=writer.frames if writer else 0,
            lost=recorder.lost if recorder else 0, away=self._feed.away, first_ns=writer.first_ns if writer else 0,
            last_ns=writer.last_ns if writer else 0, written_bytes=writer.bytes if writer else 0,
            free_bytes=free, files=told, data=data, board="none" if search is None else search.state,
            board_failure="" if search is None else printable(search.failure, 900),
        )  # fmt: skip


def filming_of(
    rig: Rig, id: str, folder: Path | None, *, secured: bool, detect: Command | None = None
) -> Callable[[Feed, Clock], FilmEndpoint]:
    """What begins the endpoint of a running viewer of a rig, with the images of that.

    folder: of the films; None: FILMS beside the rig file.  secured: whether with certificates.  detect: see `FilmEndpoint`.
    """
    name, place, permission = rig.viewer(id).camera.name, folder or rig.base / FILMS, Permission(rig.film, secured)
    return lambda feed, clock: FilmEndpoint(feed, name, place, permission, clock, detect=detect)
