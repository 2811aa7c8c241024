"""Camera host: announces the cameras of its machine, films them, and runs viewers with them."""

import logging
import secrets
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec

from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.bus.zenoh_query_server import QueryServer
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.messages import AssignQuery, CameraHost, FilmQuery
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.sources import LiveSource
from zenocap.common.runtime.clock import Clock, RealClock
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.topics import HOST_ASSIGN, HOST_FILM
from zenocap.common.video.v4l2.listing import FoundCamera, found_cameras
from zenocap.services.camera.assigned import AssignedCamera
from zenocap.services.camera.board_search import Command
from zenocap.services.camera.endpoint import FilmEndpoint, Permission
from zenocap.services.camera.feeds import CameraFeed, Opener
from zenocap.services.camera.host_cameras import OfferedCamera, named_camera, offered_cameras
from zenocap.services.camera.parameters import LOOK_AGAIN_S, TWIN_S
from zenocap.services.camera.saved import data_folder

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Viewers:
    """Viewers that may be assigned.  folder: of the assignments.  command: of the viewer of a saved assignment."""

    folder: Path
    command: Callable[[Path], Sequence[str]]


@dataclass(frozen=True)
class _Endpoints:
    """Endpoints of one camera."""

    film: FilmEndpoint
    assigned: AssignedCamera | None
    servers: Sequence[QueryServer[FilmQuery] | QueryServer[AssignQuery]]

    def close(self) -> None:
        for server in self.servers:
            server.undeclare()
        self.film.close()
        if self.assigned is not None:
            self.assigned.close()


class CameraHostServer:
    """The cameras of one machine on the network, until `close`."""

    def __init__(
        self, session: FilmSession, machine: str, named: Mapping[str, LiveSource], folder: Path, clock: Clock,
        opener: Opener, found: Callable[[], Sequence[FoundCamera]] = found_cameras, viewers: Viewers | None = None,
        detect: Command | None = None, *, previews: bool = False,
    ) -> None:  # fmt: skip
        """named: cameras besides those of this machine.  folder: of the films.  opener: of a camera.

        found: raises UserError without cameras.
        viewers: of rigs, which are run with the cameras when they are assigned; None for none.  detect: see `FilmEndpoint`.
        previews: whether these viewers may publish small pictures.
        """
        self._detect = detect
        self._session, self._machine, self._folder, self._viewers = session, machine, folder, viewers
        self.instance = secrets.token_hex(8)
        self._previews, self._clock, self._found = previews, clock, found
        self._named, self._opener = named, opener
        self._offered: dict[str, OfferedCamera] = {}
        self._endpoints: dict[str, _Endpoints] = {}
        self.look()
        self._server = session.announce(machine, self.announcement)

    def look(self) -> None:
        """Look which cameras there are; a camera that is gone is no longer announced."""
        found: Sequence[FoundCamera] = ()
        with suppress(UserError):  # no camera is plugged in, or this is not Linux: the named ones are all
            found = self._found()
        self._offered = offered_cameras(found, self._named)
        for id, one in self._offered.items():
            if id not in self._endpoints:
                self._endpoints[id] = self._served(id, one.source)

    def _served(self, id: str, source: LiveSource) -> "_Endpoints":
        """Answer the queries about one camera."""
        assigned: AssignedCamera | None = None
        servers: list[QueryServer[FilmQuery] | QueryServer[AssignQuery]] = []
        film = FilmEndpoint(
            CameraFeed(source, self._opener), None, self._folder, Permission(film=True), self._clock, self._machine,
            used_by=partial(self.used_by, id), detect=self._detect,
        )  # fmt: skip
        if self._viewers is not None:
            assigned = AssignedCamera(
                source, self._viewers.folder / f"{id}.json", self._viewers.command, self._clock,
                previews=self._previews, is_filmed=lambda: film.is_recording,
            )  # fmt: skip
            key = HOST_ASSIGN.format(machine=self._machine, camera=id)
            servers.append(self._session.serve(key, AssignQuery, assigned.answer, assigned.check))
        key = HOST_FILM.format(machine=self._machine, camera=id)
        servers.append(self._session.serve(key, FilmQuery, film.answer, film.check, film.sender))
        return _Endpoints(film, assigned, servers)

    def used_by(self, id: str) -> str:
        """The viewer that has a camera; empty when it is free."""
        endpoints = self._endpoints.get(id)
        return endpoints.assigned.used_by if endpoints is not None and endpoints.assigned is not None else ""

    def twin(self) -> str:
        """Host name of another machine that announces under the same name; empty without one."""
        found = self._session.hosts(TWIN_S, self._machine)
        return next((one.host for one in found if isinstance(one, CameraHost) and one.instance != self.instance), "")

    def announcement(self) -> CameraHost:
        """The cameras that are announced."""
        return CameraHost(
            frame=0, captured_ns=self._clock.now_ns(), machine=self._machine, host=printable(socket.gethostname()),
            cameras=[msgspec.structs.replace(one.announced, used_by=self.used_by(id)) for id, one in self._offered.items()],
            instance=self.instance,
        )  # fmt: skip

    def close(self) -> None:
        """End all films and viewers, all at once."""
        self._server.undeclare()
        with ThreadPoolExecutor(max(1, len(self._endpoints))) as pool:
            list(pool.map(_Endpoints.close, self._endpoints.values()))


def run_host(
    machine: str | None,
    named: Sequence[str],
    folder: Path,
    options: ZenohOptions,
    stopped: Callable[[], bool],
    opener: Opener,
    *,
    allow_preview: bool = False,
    command: Callable[[Path], Sequence[str]] | None = None,
    detect: Command | None = None,
) -> int:
    """Announce and film the cameras of this machine until `stopped`, and run viewers with them; returns the exit status.

    machine: its name on the network; default: its host name.  named: NAME=SOURCE of further cameras.  opener: of a
    camera.  command: of the viewer of an assignment's file; None: no viewers are run.  detect: see `FilmEndpoint`.
    allow_preview: whether these viewers may publish small pictures.

    Raises UserError.
    """
    name = machine or plain_name(socket.gethostname()).lstrip(".") or "machine"
    if plain_name(name) != name or name.startswith("."):
        raise UserError(f"--machine {name!r}: allowed: 1 to 64 letters, digits, '_', '-' and, not at first, '.'")
    viewers = None if command is None else Viewers(data_folder(name), command)
    cameras = dict(map(named_camera, named))
    with ExitStack() as stack:
        session, clock = FilmSession.open(options, stopped), RealClock()
        stack.callback(session.close)
        server = CameraHostServer(
            session, name, cameras, folder, clock, opener, viewers=viewers, detect=detect, previews=allow_preview
        )
        stack.callback(server.close)
        ids = ", ".join(one.id for one in server.announcement().cameras) or "no camera yet"
        logger.warning("%s announces %s; films go to %s", name, ids, folder.resolve())
        looked_s, told = time.monotonic(), ""
        while not stopped():
            time.sleep(0.1)
            if time.monotonic() - looked_s > LOOK_AGAIN_S:
                server.look()
                if (twin := server.twin()) and twin != told:
                    text = "%s announces as %s too: start one of them with another --machine"
                    logger.warning(text, printable(twin), name)
                looked_s, told = time.monotonic(), twin
    return 0
