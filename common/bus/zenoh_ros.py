"""Node on the network of ROS 2 with rmw_zenoh: session, liveliness tokens, publishers.

The session is a client of a Zenoh router, which forwards to all nodes of ROS, on whichever machine they run.  It is opened
on a thread of its own, because a client waits for its router.
"""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import zenoh

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_session import ZenohOptions, close_session, open_session
from zenocap.common.formats.rmw_zenoh import RosNode, RosTopic, attachment, gid_of

logger = logging.getLogger(__name__)


class _Publisher:
    """One topic: its token on the ROS graph, and its messages."""

    def __init__(
        self, session: zenoh.Session, node: RosNode, id: int, topic: RosTopic, digest: Callable[[bytes], bytes]
    ) -> None:
        token = node.publisher_token(id, topic)
        self._session = session
        self._gid = gid_of(token, digest)
        self._publisher = session.declare_publisher(
            topic.key(node.domain), congestion_control=zenoh.CongestionControl.DROP, express=True
        )
        self._token = session.liveliness().declare_token(token)
        self._number = 0

    def put(self, data: bytes, sent_ns: int) -> None:
        self._number += 1
        self._publisher.put(
            data, attachment=attachment(self._number, sent_ns, self._gid), timestamp=self._session.new_timestamp()
        )

    def undeclare(self) -> None:
        self._token.undeclare()  # type: ignore[no-untyped-call]
        self._publisher.undeclare()  # type: ignore[no-untyped-call]


@dataclass(frozen=True)
class _Graph:
    """Declarations on an open session."""

    session: zenoh.Session
    token: zenoh.LivelinessToken
    publishers: tuple[_Publisher, ...]


class RosConnection:
    """Publishers of one node.  `put` and `close` are for one thread; neither waits for a router that hangs."""

    def __init__(
        self, connect: str, domain: int, namespace: str, name: str, topics: Sequence[RosTopic],
        digest: Callable[[bytes], bytes],
    ) -> None:  # fmt: skip
        """Begin to connect to the router at the endpoint `connect`.

        namespace, name: of the node.  digest: XXH3-128 in canonical form, see `gid_of`.
        """
        self._options = ZenohOptions("client", (connect,), multicast_scouting=False)
        self._domain, self._namespace, self._name = domain, namespace, name
        self._topics, self._digest = topics, digest
        self._lock = threading.Lock()
        self._closed = False
        self._graph: _Graph | None = None
        threading.Thread(target=self._open, name="ros", daemon=True).start()

    @property
    def connected(self) -> bool:
        """Whether the router has been reached; Zenoh itself reconnects after that."""
        return self._graph is not None

    def put(self, index: int, data: bytes, sent_ns: int) -> bool:
        """Send a message of the topic with this index; whether there is a session.  sent_ns: time of this machine.

        Raises BusError.
        """
        graph = self._graph
        if graph is None:
            return False
        try:
            graph.publishers[index].put(data, sent_ns)
        except zenoh.ZError as error:
            raise BusError(f"{self._topics[index].name} cannot be published: {error}") from error
        return True

    def close(self) -> None:
        with self._lock:
            self._closed = True
            graph, self._graph = self._graph, None
        if graph is not None:
            close_session(graph.session, (*graph.publishers, graph.token))

    def _open(self) -> None:
        try:
            session = open_session(self._options, lambda: self._closed)
        except BusError as error:
            if not self._closed:
                logger.error("ROS: %s", error)
            return
        node = RosNode(self._domain, self._namespace, self._name, str(session.zid()))
        with self._lock:
            if self._closed:
                close_session(session)
                return
            publishers = tuple(
                _Publisher(session, node, id, topic, self._digest) for id, topic in enumerate(self._topics, start=1)
            )
            self._graph = _Graph(session, session.liveliness().declare_token(node.token()), publishers)
        logger.info("ROS: connected as node %s", "/".join([self._namespace.rstrip("/"), self._name]))
