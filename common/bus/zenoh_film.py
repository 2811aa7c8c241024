"""Queries over Zenoh to programs that have cameras: films, announced cameras, assignments."""

import logging
from collections.abc import Callable
from typing import Self, TypeVar

import zenoh

from zenocap.common import codec
from zenocap.common.bus.zenoh_queries import ENCODING, MAX_REPLIES
from zenocap.common.bus.zenoh_query_server import Q, QueryServer
from zenocap.common.bus.zenoh_session import ZenohOptions, open_session
from zenocap.common.closable import Closable
from zenocap.common.messages import AssignQuery, AssignReply, CameraHost, FilmQuery, FilmReply, Message
from zenocap.common.topics import HOST_ALIVE, HOST_CAMERAS, checked_name

logger = logging.getLogger(__name__)

R = TypeVar("R", bound=Message)


class HostServer:
    """Announces a camera host until `undeclare`: a liveliness token, and a queryable for its cameras.

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


def _replies(
    session: zenoh.Session, expression: str, kind: type[R], timeout_s: float, payload: bytes = b""
) -> list[tuple[str, R | str]]:
    """Replies with their keys: of all who answer, also on one key."""
    found: list[tuple[str, R | str]] = []
    for reply in session.get(
        expression,
        payload=payload,
        encoding=ENCODING,
        timeout=timeout_s,
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        express=True,
    ):
        if reply.ok is None or len(found) >= MAX_REPLIES:
            continue
        key = str(reply.ok.key_expr)
        try:
            found.append((key, codec.decode(reply.ok.payload.to_bytes(), kind)))
        except codec.BadMessage as error:
            found.append((key, str(error)))
    return found


class FilmSession(Closable):
    """A connection of who films, or of a camera host.  To be closed: an open session keeps the process alive."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session

    @classmethod
    def open(cls, options: ZenohOptions, stopped: Callable[[], bool] = lambda: False) -> Self:
        """Raises BusError as `open_session` does."""
        return cls(open_session(options, stopped))

    def ask(self, expression: str, query: FilmQuery, timeout_s: float) -> dict[str, FilmReply | str]:
        """Replies by key; an error text where a reply is invalid.  Raises BadMessage for an invalid query."""
        return dict(_replies(self._session, expression, FilmReply, timeout_s, codec.encode(query)))

    def hosts(self, timeout_s: float, machine: str = "*") -> list[CameraHost | str]:
        """Camera hosts of the network, also several of one name; an error text where a reply is invalid."""
        return [one for _, one in _replies(self._session, HOST_CAMERAS.format(machine=machine), CameraHost, timeout_s)]

    def assign(self, key: str, query: AssignQuery, timeout_s: float) -> AssignReply | str | None:
        """Reply of a camera host; None without one, an error text where it is invalid.  Raises BadMessage."""
        replies = _replies(self._session, key, AssignReply, timeout_s, codec.encode(query))
        return next((one for _, one in replies), None)

    def serve(self, key: str, kind: type[Q], answer: Callable[[Q], Message], idle: Callable[[], None]) -> QueryServer[Q]:
        """See `QueryServer`."""
        return QueryServer(self._session, key, kind, answer, idle)

    def announce(self, machine: str, cameras: Callable[[], CameraHost]) -> HostServer:
        """See `HostServer`."""
        return HostServer(self._session, machine, cameras)

    def close(self) -> None:
        self._session.close()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
