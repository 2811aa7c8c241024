"""The cameras of a film that other programs have, together."""

import re
import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.rig.folder import plain_name
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import Announced
from zenocap.common.video.parameters import RESERVE_BYTES
from zenocap.tools.record.film.camera import Filmed
from zenocap.tools.record.film.parameters import LONG_S, ROUTER_S
from zenocap.tools.record.film.places import places_of
from zenocap.tools.record.film.remote import RemoteCamera


@dataclass
class RemoteFilm:
    """cameras: opened, started and ended at the same time.  secured: with certificates; else a stranger may be one."""

    cameras: Sequence[RemoteCamera] = ()
    secured: bool = False
    _reported: set[str] = field(default_factory=set)

    @property
    def not_ready(self) -> list[str]:
        """Names of the cameras without an image yet, except those that failed."""
        return [f"{one.name} on {one.host}" for one in self.cameras if not one.is_ready and not one.has_ended]

    @property
    def has_ended(self) -> bool:
        """Whether all films have ended or failed."""
        return all(one.has_ended for one in self.cameras)

    @property
    def of_running_rig(self) -> bool:
        """Whether the rig was running: the film need not begin with the empty scene."""
        return any(one.place.running for one in self.cameras)

    @property
    def failures(self) -> list[str]:
        return [one.failure for one in self.cameras if one.failure]

    def open(self) -> None:
        """Raises UserError when a camera cannot be filmed."""
        self._all(RemoteCamera.open)

    def start(self, begin_ns: int, duration_ns: int) -> None:
        """Record from a time of this machine's clock on.  duration_ns: 0 until `stop`."""
        self._all(lambda one: one.start(begin_ns, duration_ns))

    def stop(self) -> None:
        """End all films."""
        self._all(RemoteCamera.stop)
        for one in self.cameras:
            one.close()

    def filmed(self) -> list[Filmed]:
        return [one.filmed() for one in self.cameras]

    def describe(self) -> str:
        """Cameras that others film, for display."""
        return "".join(f"{', ' if k else '; '}{one.name} on {one.host}" for k, one in enumerate(self.cameras))

    def start_text(self, filmed: Sequence[Filmed]) -> str:
        """Beginnings by this machine's clock, and errors of the other clocks."""
        first = [one.first_ns for one in filmed if one.frames]
        known = [
            f"{one.host} {clock.offset_ns / 1e6:+.1f} ms, known within {clock.error_ns / 1e6:.1f} ms"
            for one in self.cameras
            if (clock := one.clock) is not None
        ]
        texts = "; ".join(dict.fromkeys(known)) or "unknown"
        return f"first frames within {(max(first) - min(first)) / 1e6:.1f} ms; clocks against this one: {texts}"

    def news(self) -> Iterator[str]:
        """Failures that were not reported yet."""
        for text in self.failures:
            if text not in self._reported:
                self._reported.add(text)
                yield f"{text}; the others go on"

    def disk_texts(self, passed_s: float, left_s: float | None) -> Iterator[str]:
        """Time that the disk of each lasts."""
        for one in self.cameras:
            if one.reply.frames and not one.failure:
                rate = one.reply.written_bytes / passed_s
                yield f"{one.name} on {one.host}: {disk_text(rate, one.reply.free_bytes, left_s)}"

    def _all(self, work: Callable[[RemoteCamera], None]) -> None:
        if not self.cameras:
            return
        with ThreadPoolExecutor(len(self.cameras)) as pool:
            list(pool.map(work, self.cameras))


NOBODY = RemoteFilm()


def disk_text(rate: float, free: int, left_s: float | None) -> str:
    """Time that a disk lasts.  rate: bytes/s.  free: bytes.  left_s: of the film, None for until it is stopped."""
    lasts_s = (free - RESERVE_BYTES) / max(rate, 1.0)
    short = "; that is less than --seconds" if left_s is not None and lasts_s < left_s else ""
    lasts = f"{lasts_s / 60:.0f} minutes" if lasts_s < LONG_S else f"{lasts_s / 3600:.0f} hours"
    return f"{rate * 60 / 1e6:.0f} MB a minute; the disk lasts for {lasts}{short}"


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
        yield [one for one in viewers if one.id not in places], RemoteFilm(remote, security is not None)
    finally:
        session.close()
