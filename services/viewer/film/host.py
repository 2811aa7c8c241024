"""A camera host: announces the cameras of its machine and films them at the command of `zenocap film`, without a rig."""

import logging
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.bus.zenoh_film import FilmServer, FilmSession
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.messages import CameraHost, HostCamera
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.sources import Device, Source, Stream, parse_source, without_password
from zenocap.common.runtime.clock import Clock, RealClock
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.topics import HOST_FILM
from zenocap.common.video.v4l2.listing import FoundCamera, found_cameras
from zenocap.services.viewer.film.endpoint import FilmEndpoint, Permission
from zenocap.services.viewer.film.feeds import CameraFeed
from zenocap.services.viewer.film.parameters import LOOK_AGAIN_S

logger = logging.getLogger(__name__)

MOST_CAMERAS, MOST_MODES = 16, 48  # of one machine and one camera, as in `CameraHost`: they fit into one message


@dataclass(frozen=True)
class _Offered:
    """A camera with what is announced of it."""

    source: Device | Stream
    announced: HostCamera


def named_camera(text: str) -> tuple[str, Device | Stream]:
    """Name and source of NAME=SOURCE.  Raises UserError."""
    name, equals, where = text.partition("=")
    allowed = "NAME=SOURCE, such as cam01=rtsp://192.168.1.20/stream; of names: letters, digits, '.', '_' and '-'"
    shown = f"{name}{equals}{without_password(where)}"
    if not (equals and name and where) or plain_name(name) != name or name.startswith("."):
        raise UserError(f"--camera {shown}: allowed: {allowed}")
    try:
        source: Source = parse_source(where, Path())
    except UserError as error:
        raise UserError(f"--camera {shown}: allowed: {error}") from error
    if not isinstance(source, Device | Stream):
        raise UserError(f"--camera {shown}: no camera and no stream: allowed: {allowed}")
    return name, source


class CameraHostServer:
    """The cameras of one machine on the network, until `close`."""

    def __init__(
        self,
        session: FilmSession,
        machine: str,
        named: Mapping[str, Device | Stream],
        folder: Path,
        permission: Permission,
        clock: Clock,
        found: Callable[[], Sequence[FoundCamera]] = found_cameras,
    ) -> None:
        """named: cameras besides those of this machine.  folder: of the films.  found: raises UserError without cameras."""
        self._session, self._machine, self._folder = session, machine, folder
        self._permission, self._clock, self._found = permission, clock, found
        self._named = {
            name: _Offered(source, HostCamera(id=name, source=_shown(source), name=name)) for name, source in named.items()
        }
        self._offered: dict[str, _Offered] = {}
        self._endpoints: dict[str, tuple[FilmEndpoint, FilmServer]] = {}
        self.look()
        self._server = session.announce(machine, self.announcement)

    def look(self) -> None:
        """Look which cameras there are; a camera that is gone is no longer announced."""
        found: Sequence[FoundCamera] = ()
        with suppress(UserError):  # no camera is plugged in, or this is not Linux: the named ones are all
            found = self._found()
        offered = dict(self._named)
        for camera in found:
            id = plain_name(Path(camera.source).name).lstrip(".") or "camera"
            if camera.problem or id in offered or len(offered) >= MOST_CAMERAS:
                continue
            offered[id] = _Offered(_device(camera.source), _announced(id, camera))
        self._offered = offered
        for id, one in offered.items():
            if id not in self._endpoints:
                feed = CameraFeed(one.source)
                endpoint = FilmEndpoint(feed, None, self._folder, self._permission, self._clock, self._machine)
                key = HOST_FILM.format(machine=self._machine, camera=id)
                self._endpoints[id] = endpoint, self._session.serve(key, endpoint.answer, endpoint.check)

    def announcement(self) -> CameraHost:
        """The cameras that are announced."""
        return CameraHost(
            frame=0,
            captured_ns=self._clock.now_ns(),
            machine=self._machine,
            host=printable(socket.gethostname()),
            cameras=[one.announced for one in self._offered.values()],
        )

    def close(self) -> None:
        self._server.undeclare()
        for endpoint, server in self._endpoints.values():
            endpoint.close()
            server.undeclare()


def run_host(
    machine: str | None,
    named: Sequence[str],
    folder: Path,
    options: ZenohOptions,
    stopped: Callable[[], bool],
    *,
    allow_fetch: bool = False,
) -> int:
    """Announce and film the cameras of this machine until `stopped`; returns the exit status.

    machine: its name on the network; default: its host name.  named: NAME=SOURCE of further cameras.  Raises UserError.
    """
    name = machine or plain_name(socket.gethostname()).lstrip(".") or "machine"
    if plain_name(name) != name:
        raise UserError(f"--machine {name!r}: allowed: 1 to 64 letters, digits, '.', '_' and '-'")
    cameras = dict(map(named_camera, named))
    permission = Permission(film=True, read=allow_fetch, read_advice="--allow-fetch where the camera is")
    session = FilmSession.open(options, stopped)
    server = None
    try:
        server = CameraHostServer(session, name, cameras, folder, permission, RealClock())
        ids = ", ".join(one.id for one in server.announcement().cameras) or "no camera yet"
        logger.warning("%s announces %s; films go to %s", name, ids, folder.resolve())
        looked_s = time.monotonic()
        while not stopped():
            time.sleep(0.1)
            if time.monotonic() - looked_s > LOOK_AGAIN_S:
                server.look()
                looked_s = time.monotonic()
    finally:
        if server is not None:
            server.close()
        session.close()
    return 0


def _shown(source: Device | Stream) -> str:
    return without_password(source.url) if isinstance(source, Stream) else str(source.file)


def _device(source: str) -> Device:
    parsed = parse_source(source, Path())
    assert isinstance(parsed, Device)
    return parsed


def _announced(id: str, camera: FoundCamera) -> HostCamera:
    modes = [
        f"{mode.format} {mode.size[0]} x {mode.size[1]}: {', '.join(f'{rate:.4g}' for rate in mode.rates)} frames/s"
        for mode in camera.modes
    ]
    return HostCamera(
        id=id,
        source=camera.source,
        name=printable(camera.name),
        stable=camera.is_stable,
        modes=[printable(mode, 80) for mode in modes[:MOST_MODES]],
    )
