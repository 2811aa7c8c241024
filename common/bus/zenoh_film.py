"""Film queries over Zenoh: to the programs that have cameras, and the cameras of camera hosts.

Answers are made on a thread of their own, not on Zenoh's: they open files and cameras.
"""

import logging
import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Self, TypeVar

import zenoh

from zenocap.common import codec
from zenocap.common.bus.zenoh_queries import ENCODING, MAX_REPLIES
from zenocap.common.bus.zenoh_session import ZenohOptions, open_session
from zenocap.common.messages import CameraHost, FilmQuery, FilmReply, Message
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.topics import HOST_ALIVE, HOST_CAMERAS, checked_name

logger = logging.getLogger(__name__)

WAITING = 32  # queries that wait for their answer; more are not answered; chosen by hand
IDLE_S = 0.25  # between calls of `idle`; chosen by hand

R = TypeVar("R", bound=Message)


class FilmServer:
    """Answers the film queries on one key until `close`.

    answer, idle: called on one thread; idle every IDLE_S s at least.
    """

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        answer: Callable[[FilmQuery], FilmReply],
        idle: Callable[[], None] = lambda: None,
    ) -> None:
        self._answer, self._idle, self._key = answer, idle, key
        self._queue: queue.Queue[zenoh.Query] = queue.Queue(WAITING)
        self._stop = threading.Event()
        self._log_once = OncePerSource(logger)
        self._thread = threading.Thread(target=self._work, name=f"film {key}", daemon=True)
        self._thread.start()
        self._queryable = session.declare_queryable(key, self._enqueue, complete=True)

    def undeclare(self) -> None:
        self._queryable.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
        self._stop.set()
        self._thread.join(5.0)

    def _enqueue(self, query: zenoh.Query) -> None:
        try:
            self._queue.put_nowait(query)
        except queue.Full:
            query.drop()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"

    def _work(self) -> None:
        while not self._stop.is_set():
            try:
                with suppress(queue.Empty), self._queue.get(timeout=IDLE_S) as query:
                    self._reply(query)
                self._idle()
            except Exception as error:  # one bad query must not end the answers: a film could not be stopped any more
                self._log_once.warn(self._key, "failed", f"{self._key}: {type(error).__name__}: {error}", trace=True)

    def _reply(self, query: zenoh.Query) -> None:
        payload, limit = query.payload, codec.size_limit(FilmQuery)
        if payload is not None and len(payload) > limit:
            self._log_once.warn(self._key, "size", f"{self._key}: {len(payload)} bytes, more than {limit}")
            return
        try:
            data = payload.to_bytes() if payload else b""
            reply = codec.encode(self._answer(codec.decode(data, FilmQuery)))
        except codec.BadMessage as error:
            self._log_once.warn(self._key, "invalid", f"{self._key}: {error}")
            return
        try:
            query.reply(self._key, reply, encoding=ENCODING)
        except zenoh.ZError as error:
            logger.debug("%s: the querying process is gone: %s", self._key, error)


class HostServer:
    """Announces a camera host until `undeclare`: a liveliness token, and a queryable that tells its cameras.

    cameras: called on Zenoh's thread.
    """

    def __init__(self, session: zenoh.Session, machine: str, cameras: Callable[[], CameraHost]) -> None:
        key = HOST_CAMERAS.format(machine=checked_name("machine", machine))

        def reply(query: zenoh.Query) -> None:
            with query:
                try:
                    query.reply(key, codec.encode(cameras()), encoding=ENCODING)
                except (codec.BadMessage, zenoh.ZError) as error:
                    logger.debug("%s: not answered: %s", key, error)

        self._queryable = session.declare_queryable(key, reply, complete=True)
        self._token = session.liveliness().declare_token(HOST_ALIVE.format(machine=machine))

    def undeclare(self) -> None:
        self._token.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
        self._queryable.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"


def query_films(session: zenoh.Session, expression: str, query: FilmQuery, timeout_s: float) -> dict[str, FilmReply | str]:
    """Replies by key; an error text where a reply is invalid.  Raises BadMessage for an invalid query."""
    return _replies(session, expression, FilmReply, timeout_s, codec.encode(query))


def query_hosts(session: zenoh.Session, timeout_s: float) -> dict[str, CameraHost | str]:
    """Camera hosts of the network by key; an error text where a reply is invalid."""
    return _replies(session, HOST_CAMERAS.format(machine="*"), CameraHost, timeout_s)


def _replies(
    session: zenoh.Session, expression: str, kind: type[R], timeout_s: float, payload: bytes = b""
) -> dict[str, R | str]:
    found: dict[str, R | str] = {}
    for reply in session.get(
        expression,
        payload=payload,
        encoding=ENCODING,
        timeout=timeout_s,
        consolidation=zenoh.ConsolidationMode.NONE,
        express=True,
    ):
        if reply.ok is None or len(found) >= MAX_REPLIES:
            continue
        key = str(reply.ok.key_expr)
        try:
            found[key] = codec.decode(reply.ok.payload.to_bytes(), kind)
        except codec.BadMessage as error:
            found[key] = str(error)
    return found


class FilmSession:
    """A connection of who films, or of a camera host.  To be closed: an open session keeps the process alive."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session

    @classmethod
    def open(cls, options: ZenohOptions, stopped: Callable[[], bool] = lambda: False) -> Self:
        """Raises BusError as `open_session` does."""
        return cls(open_session(options, stopped))

    def ask(self, expression: str, query: FilmQuery, timeout_s: float) -> dict[str, FilmReply | str]:
        """See `query_films`."""
        return query_films(self._session, expression, query, timeout_s)

    def hosts(self, timeout_s: float) -> dict[str, CameraHost | str]:
        """See `query_hosts`."""
        return query_hosts(self._session, timeout_s)

    def serve(self, key: str, answer: Callable[[FilmQuery], FilmReply], idle: Callable[[], None]) -> FilmServer:
        """See `FilmServer`."""
        return FilmServer(self._session, key, answer, idle)

    def announce(self, machine: str, cameras: Callable[[], CameraHost]) -> HostServer:
        """See `HostServer`."""
        return HostServer(self._session, machine, cameras)

    def close(self) -> None:
        self._session.close()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
