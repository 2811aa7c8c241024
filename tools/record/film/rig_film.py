"""Cameras of a rig for one film: own ones, and those of other programs."""

import re
import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import Announced
from zenocap.tools.record.film.parameters import ROUTER_S
from zenocap.tools.record.film.places import places_of
from zenocap.tools.record.film.remote import RemoteCamera
from zenocap.tools.record.film.remote_film import NOBODY, RemoteFilm


def film_name(folder: str, now: datetime) -> str:
    """Name of a film in the folders of other programs: that of the folder and the time, which is not there yet."""
    plain = re.sub(r"^\.+", "", plain_name(folder)) or "film"
    return f"{plain[:40]}-{now:%Y%m%dT%H%M%SZ}"


@contextmanager
def cameras_of(
    rig: Rig | None, viewers: Sequence[Viewer], options: ZenohOptions, folder: str, report: Callable[[str], None]
) -> Iterator[tuple[list[Viewer], RemoteFilm]]:
    """The viewers whose camera this program opens, and the film of the others.

    rig: None before there is one.  folder: name of the film's folder.
    report: receives why other programs cannot be asked.  Raises UserError.
    """
    security = options.security
    away = ", ".join(viewer.camera.name for viewer in viewers if isinstance(viewer.source, Announced))
    if security is not None and not security.certificate.is_file():
        certs = "`zenocap certs RIG --service operator`"
        missing = f"{security.certificate}: no such file"
        if away:
            raise UserError(f"{away}: on another machine: {missing}: allowed: after {certs}")
        report(f"note: {missing}: cameras of other programs are not filmed; {certs} makes it")
        yield list(viewers), NOBODY
        return
    end_s = time.monotonic() + ROUTER_S
    try:
        session = FilmSession.open(options, lambda: time.monotonic() > end_s)
    except BusError as error:
        if away:
            raise UserError(f"{away}: on another machine: {error}") from error
        report(f"note: cameras of other programs are not filmed: {error}")
        yield list(viewers), NOBODY
        return
    try:
        sender = secrets.token_hex(16)
        places = places_of(session, rig, viewers, sender)
        name = film_name(folder, datetime.now(UTC))
        remote = [RemoteCamera(session, one, places[one.id], sender, name) for one in viewers if one.id in places]
        yield [one for one in viewers if one.id not in places], RemoteFilm(remote)
    finally:
        session.close()
