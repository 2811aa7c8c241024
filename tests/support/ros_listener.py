"""A node of ROS 2 on a real Zenoh session, whose decoder is rosbags."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import zenoh
from rosbags.typesys import Stores, get_typestore

from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.formats.rmw_zenoh import MARKER_ARRAY, NO_HASH, TF_MESSAGE

STORE = get_typestore(Stores.ROS2_JAZZY)
WAIT_S = 150.0


@dataclass(frozen=True)
class Received:
    """A decoded message.  message: as rosbags has it.  attachment: its bytes."""

    kind: str
    key: str
    message: object
    attachment: bytes


def session_at(endpoint: str, mode: str) -> zenoh.Session:
    """Configured as rmw_zenoh configures its sessions: no multicast; a peer listens on this machine."""
    config = zenoh.Config()
    config.insert_json5("mode", f'"{mode}"')
    config.insert_json5("scouting/multicast/enabled", "false")
    if mode == "router":
        config.insert_json5("listen/endpoints", f'["{endpoint}"]')
    else:
        config.insert_json5("connect/endpoints", f'["{endpoint}"]')
        config.insert_json5("listen/endpoints", '["tcp/localhost:0"]')
    return zenoh.open(config)


class RosListener:
    """Subscribes to the topics of one domain, as a peer of the router at `endpoint`.  humble: without type hashes."""

    def __init__(self, endpoint: str, domain: int, *, humble: bool = False) -> None:
        self.session = session_at(endpoint, "peer")
        self._changed = threading.Condition()
        self._received: list[Received] = []
        for kind in (TF_MESSAGE, MARKER_ARRAY):
            hash = NO_HASH if humble else kind.hash
            self.session.declare_subscriber(f"{domain}/**/{kind.dds_name}/{hash}", self._receiver(kind.name))

    def _receiver(self, kind: str) -> Callable[[zenoh.Sample], None]:
        def receive(sample: zenoh.Sample) -> None:
            message = STORE.deserialize_cdr(sample.payload.to_bytes(), kind)
            attachment = sample.attachment.to_bytes() if sample.attachment is not None else b""
            with self._changed:
                self._received.append(Received(kind, str(sample.key_expr), message, attachment))
                self._changed.notify_all()

        return receive

    def received(
        self, kind: str, count: int = 1, wanted: Callable[[object], bool] = lambda _: True, wait_s: float = WAIT_S
    ) -> list[Received]:
        """At least `count` messages of a type, for which `wanted` is true; waits for them."""

        def found() -> list[Received]:
            return [one for one in self._received if one.kind == kind and wanted(one.message)]

        with self._changed:
            assert self._changed.wait_for(lambda: len(found()) >= count, wait_s), f"{len(found())} {kind}"
            return found()

    def tokens(self, domain: int, count: int) -> set[str]:
        """Tokens of nodes and publishers in the domain, once there are `count` of them."""
        end_s = time.monotonic() + WAIT_S
        while True:
            replies = self.session.liveliness().get(f"@ros2_lv/{domain}/**")
            found = {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}
            if len(found) == count or time.monotonic() > end_s:
                return found
            time.sleep(0.05)

    def close(self) -> None:
        self.session.close()


@contextmanager
def ros_network(domain: int) -> Iterator[tuple[str, RosListener]]:
    """Endpoint of a router, and a listener that it serves."""
    endpoint = f"tcp/127.0.0.1:{free_ports(1)[0]}"
    with session_at(endpoint, "router"):
        listener = RosListener(endpoint, domain)
        try:
            yield endpoint, listener
        finally:
            listener.close()
