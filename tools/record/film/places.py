"""Program that has the camera of a viewer: running viewer, camera host, or none."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.errors import UserError
from zenocap.common.messages import CameraHost, FilmQuery, FilmReply
from zenocap.common.rig.hosted import settings_text
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import Announced, Device
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.topics import FILM, HOST_FILM, is_name
from zenocap.tools.record.film.parameters import FIND_S, QUERY_S
from zenocap.tools.setup.cameras.hosts import host_problem


@dataclass(frozen=True)
class Place:
    """key: that answers film queries of the camera.  reply: its first one.  running: whether it is a viewer of the rig."""

    key: str
    reply: FilmReply
    running: bool


def places_of(session: FilmSession, rig: Rig | None, viewers: Sequence[Viewer], sender: str) -> dict[str, Place]:
    """Places of the viewers whose camera another program has, by id of the viewer; waits FIND_S for them.

    rig: None before there is one.  Raises UserError when a camera may not be filmed, two programs offer it, or one of
    another machine is not announced.
    """
    end_s = time.monotonic() + FIND_S
    found: dict[str, Place] = {}
    while True:
        if rig is not None:
            found |= _running(session, rig, viewers, sender)
        missing = [viewer for viewer in viewers if viewer.id not in found]
        found |= _hosted(session, missing, sender)
        if len(found) == len(viewers) or time.monotonic() > end_s:
            break
        time.sleep(0.1)
    away = {one.camera.name: one.source for one in viewers if one.id not in found and isinstance(one.source, Announced)}
    if away:
        hosts = [host for host in session.hosts(QUERY_S) if isinstance(host, CameraHost)]
        for name, source in away.items():
            problem = host_problem(source, hosts) or f"{source.machine} does not answer"
            raise UserError(f"camera {name}: {problem}")
    for id, place in found.items():
        if not place.reply.may_film:
            raise UserError(
                f"viewer {id} runs on {printable(place.reply.host)} and has the camera: allowed: film = true in the rig "
                "file when it starts, or to end it first"
            )
    return found


def _running(session: FilmSession, rig: Rig, viewers: Sequence[Viewer], sender: str) -> dict[str, Place]:
    """Viewers of the rig that are running."""
    keys = {FILM.format(rig=rig.name, viewer=viewer.id): viewer.id for viewer in viewers}
    replies = session.ask(FILM.format(rig=rig.name, viewer="*"), _state(sender), QUERY_S)
    found = {}
    for key, reply in replies.items():
        if isinstance(reply, str) and key in keys:
            raise UserError(f"viewer {keys[key]}: {printable(reply)}")
        if isinstance(reply, FilmReply) and key in keys:
            found[keys[key]] = Place(key, reply, running=True)
    return found


def _hosted(session: FilmSession, viewers: Sequence[Viewer], sender: str) -> dict[str, Place]:
    """Viewers whose camera a camera host announces: under the name of the camera, or with its stable source."""
    if not viewers:
        return {}
    hosts = [host for host in session.hosts(QUERY_S) if isinstance(host, CameraHost)]
    found: dict[str, Place] = {}
    for viewer in viewers:
        keys = matching(viewer, hosts)
        if len(keys) > 1:
            names = ", ".join(printable(host) for host in keys.values())
            raise UserError(f"camera {viewer.camera.name}: announced by several machines: {names}: allowed: one")
        for key in keys:
            reply = session.ask(key, _state(sender), QUERY_S).get(key)
            if isinstance(reply, FilmReply):
                found[viewer.id] = Place(key, reply, running=False)
    return found


def matching(
    viewer: Viewer, hosts: Sequence[CameraHost], here: Callable[[Device], bool] = lambda source: source.file.exists()
) -> Mapping[str, str]:
    """Machine by key of the camera hosts' cameras that are that of a viewer.  here: whether this machine has a camera.

    A camera is announced under the camera's name in the rig, or is a USB camera with the same stable name.
    """
    source = viewer.source
    if isinstance(source, Announced):
        own = [host for host in hosts if host.machine == source.machine and not host_problem(source, hosts)]
        return {HOST_FILM.format(machine=source.machine, camera=source.camera): host.machine for host in own}
    stable = str(source.link) if isinstance(source, Device) and source.link is not None and not here(source) else None
    return {
        HOST_FILM.format(machine=host.machine, camera=camera.id): host.machine
        for host in hosts
        for camera in host.cameras
        if is_name(camera.id) and (camera.id == viewer.camera.name or (camera.stable and camera.source == stable))
    }


def camera_settings(viewer: Viewer) -> dict[str, str]:
    """The camera settings of a viewer, for a camera host."""
    return settings_text(viewer.source.settings) if isinstance(viewer.source, Device | Announced) else {}


def _state(sender: str) -> FilmQuery:
    return FilmQuery(frame=0, captured_ns=time.time_ns(), what="state", sender=sender)
