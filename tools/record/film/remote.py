"""A camera that another program films: its queries, its clock, and its state."""

import threading
import time
from dataclasses import dataclass, field
from typing import Literal

import msgspec

from zenocap.common.bus.protocol import RoundTrip
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.codec import BadMessage
from zenocap.common.errors import UserError
from zenocap.common.messages import FilmQuery, FilmReply
from zenocap.common.rig.rig import Viewer
from zenocap.common.runtime.clock_offset import ClockFilter, Offset, observe, offset_at
from zenocap.common.runtime.foreign_text import printable
from zenocap.tools.record.film.camera import Filmed
from zenocap.tools.record.film.parameters import LOST_S, POLL_S, QUERY_S, STOP_S, TRIPS
from zenocap.tools.record.film.places import Place, camera_settings

What = Literal["state", "open", "start", "stop", "files", "read", "detect"]


class Unanswered(UserError):
    """A query had no answer in time."""


class Restarted(UserError):
    """The program does not know the film any more."""


@dataclass
class RemoteCamera:
    """One camera.  reply: the last one that obeyed.  failure: why it is given up."""

    session: FilmSession
    viewer: Viewer
    place: Place
    sender: str
    film: str
    reply: FilmReply = field(init=False)
    failure: str = ""
    _trips: ClockFilter = field(default_factory=ClockFilter)
    _queries: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _stop: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread | None = None

    def __post_init__(self) -> None:
        self.reply = self.place.reply

    @property
    def name(self) -> str:
        return self.viewer.camera.name

    @property
    def host(self) -> str:
        return printable(self.reply.host)

    @property
    def clock(self) -> Offset | None:
        """Its clock minus this machine's."""
        own = offset_at(self._trips, time.time_ns())  # this machine's clock minus its
        return None if own is None else Offset(-own.offset_ns, own.error_ns)

    @property
    def is_ready(self) -> bool:
        return self.reply.state != "opening"

    @property
    def has_ended(self) -> bool:
        return bool(self.failure) or self.reply.state == "ended"

    def ask(self, what: What, timeout_s: float = QUERY_S, **fields: object) -> FilmReply:
        """The reply to one query.  Raises Unanswered, UserError with the reason when it is not obeyed."""
        with self._lock:
            return self._ask(what, timeout_s, fields)

    def _ask(self, what: What, timeout_s: float, fields: dict[str, object]) -> FilmReply:
        self._queries += 1
        sent_ns = time.time_ns()
        query = FilmQuery(frame=self._queries, captured_ns=sent_ns, what=what, sender=self.sender, film=self.film)
        query = msgspec.structs.replace(query, camera=self.name, **fields)
        try:
            reply = self.session.ask(self.place.key, query, timeout_s).get(self.place.key)
        except BadMessage as error:
            raise UserError(f"{self.name}: {error}") from error
        received_ns = time.time_ns()
        if reply is None:
            raise Unanswered(f"{self.name} on {self.host}: no answer")
        if isinstance(reply, str):
            raise UserError(f"{self.name} on {self.host}: {printable(reply)}")
        if reply.film != self.film and what != "open":
            raise Restarted(f"{self.name} on {self.host}: the program was started again; its film ended")
        if reply.frame == query.frame and what == "state":
            self._trips = observe(self._trips, RoundTrip(sent_ns, reply.captured_ns, received_ns))
        if reply.refused:
            raise UserError(f"{self.name} on {self.host}: {printable(reply.refused)}")
        self.reply = reply
        return reply

    def open(self) -> None:
        """Begin to take images, and to ask for the state until `close`.  Raises UserError."""
        viewer = self.viewer
        self.ask("open", size=viewer.calibrated_size, fps=float(viewer.fps), settings=camera_settings(viewer))
        for _ in range(TRIPS):  # the shortest round trip gives the clock
            self.ask("state")
        self._thread = threading.Thread(target=self._poll, name=f"film-{self.viewer.id}", daemon=True)
        self._thread.start()

    def start(self, begin_ns: int, duration_ns: int) -> None:
        """Record from a time of this machine's clock on.  A failure is kept in `failure`."""
        clock = self.clock
        try:
            if clock is None:
                raise UserError(f"{self.name} on {self.host}: its clock is not known")
            self.ask("start", begin_ns=begin_ns + clock.offset_ns, duration_ns=duration_ns)
        except UserError as error:
            self.failure = f"{error}"

    def stop(self) -> None:
        """End the film; a failure is kept in `failure`."""
        try:
            if self.reply.state != "ended":
                self.ask("stop", STOP_S)
        except UserError as error:
            self.failure = self.failure or f"{error}"

    def close(self) -> None:
        """End the thread of `open`."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(2 * QUERY_S)

    def filmed(self) -> Filmed:
        """Recordings, with times by this machine's clock."""
        reply, clock = self.reply, self.clock
        offset_ns = clock.offset_ns if clock else 0
        first_ns, last_ns = (max(0, one - offset_ns) for one in (reply.first_ns, reply.last_ns))
        return Filmed(self.name, reply.frames, first_ns, last_ns, reply.lost, reply.away)

    def _poll(self) -> None:
        """Keep the film alive, and follow its state and clock."""
        answered_s = time.monotonic()
        while not self._stop.wait(POLL_S / 5 if self.reply.state == "opening" else POLL_S):
            try:
                if self.ask("state").failure and not self.failure:
                    self.failure = f"{self.name} on {self.host}: {printable(self.reply.failure)}"
                answered_s = time.monotonic()
            except Restarted as error:
                self.failure = self.failure or f"{error}"
            except UserError as error:
                if time.monotonic() - answered_s > LOST_S and not self.failure:
                    self.failure = f"{error} for {LOST_S:.0f} s"
