"""Queries over Zenoh to programs that have cameras: films, announced cameras, assignments."""

import logging
from collections.abc import Callable
from typing import Self

import zenoh

from zenocap.common import codec
from zenocap.common.bus.zenoh_queries import ENCODING, R, replies
from zenocap.common.bus.zenoh_query_server import Q, QueryServer
from zenocap.common.bus.zenoh_session import ZenohOptions, close_session, open_session
from zenocap.common.closable import Closable
from zenocap.common.messages import AssignQuery, AssignReply, CameraHost, FilmQuery, FilmReply, Message
from zenocap.common.topics import HOST_ALIVE, HOST_CAMERAS, checked_name

logger = logging.getLogger(__name__)


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


def _sole(replies: list[R | str]) -> R | str:
    """The one reply on a key; an error text when several programs answer."""
    return replies[0] if len(replies) == 1 else f"{len(replies)} programs answer for this camera: allowed: one"


class FilmSession(Closable):
    """A connection of who films, or of a camera host.  To be closed: an open session keeps the process alive."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session

    @classmethod
    def open(cls, options: ZenohOptions, stopped: Callable[[], bool] = lambda: False) -> Self:
        """Raises BusError as `open_session` does."""
        return cls(open_session(options, stopped))

    def ask(self, expression: str, query: FilmQuery, timeout_s: float) -> dict[str, FilmReply | str]:
        """Replies by key; an error text where one is invalid or not the only one.  Raises BadMessage."""
        found = replies(self._session, expression, FilmReply, timeout_s, codec.encode(query))
        return {key: _sole(some) for key, some in found.items()}

    def hosts(self, timeout_s: float, machine: str = "*") -> list[CameraHost | str]:
        """Camera hosts of the network, also several of one name; an error text where a reply is invalid."""
        found = replies(self._session, HOST_CAMERAS.format(machine=machine), CameraHost, timeout_s)
        return [one for some in found.values() for one in some]

    def assign(self, key: str, query: AssignQuery, timeout_s: float) -> AssignReply | str | None:
        """Reply of a camera host; None without one, an error text as in `ask`.  Raises BadMessage."""
        found = replies(self._session, key, AssignReply, timeout_s, codec.encode(query)).get(key)
        return None if found is None else _sole(found)

    def serve(
        self, key: str, kind: type[Q], answer: Callable[[Q], Message], idle: Callable[[], None],
        first: Callable[[], str] = str,
    ) -> QueryServer[Q]:  # fmt: skip
        """See `QueryServer`."""
        return QueryServer(self._session, key, kind, answer, idle, first)

    def announce(self, machine: str, cameras: Callable[[], CameraHost]) -> HostServer:
        """See `HostServer`."""
        return HostServer(self._session, machine, cameras)

    def close(self) -> None:
        close_session(self._session)
