"""ROS 2 output: `/tf` and a MarkerArray for nodes with rmw_zenoh_cpp."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module

from zenocap.common.bus.protocol import BusError, Envelope
from zenocap.common.bus.zenoh_ros import RosConnection
from zenocap.common.errors import pip_install
from zenocap.common.formats.rmw_zenoh import MARKER_ARRAY, NO_HASH, TF_MESSAGE, RosTopic, ros_name
from zenocap.common.rig.animator import RosTable
from zenocap.common.runtime.clock import Clock
from zenocap.services.animator.outputs.output import OutputError
from zenocap.services.animator.outputs.ros_messages import RosBody, no_markers
from zenocap.services.animator.parameters import MAX_ROS_AGE_NS
from zenocap.services.animator.states import ActorPose

NODE = "zenocap"
TF, MARKERS = 0, 1  # indices of the topics
TF_DEPTH, MARKERS_DEPTH = 100, 10  # of tf2's DynamicBroadcasterQoS; of rviz' subscriptions


class RosOutput:
    """Publishes each pose to a ROS 2 graph as the node NAMESPACE/zenocap; while the person is lost, no transforms.

    counts: messages `sent`; `unconnected`: not sent, because no router has been reached yet; `failed`.
    """

    def __init__(self, table: RosTable, rig: str, clock: Clock) -> None:
        """rig: its name, which is the default namespace.  Raises OutputError without the package xxhash."""
        namespace = f"/{ros_name(rig)}" if table.namespace is None else f"/{table.namespace.strip('/')}"
        self.title = f"animator.ros {table.connect} domain {table.domain}"
        self._world, self._prefix, self._clock = table.frame, f"{namespace}/".lstrip("/"), clock
        try:
            digest = import_module("xxhash").xxh3_128_digest
        except ImportError as error:
            raise OutputError(f"animator.ros: needs xxhash: {pip_install('ros')} ({error})") from error
        tf, markers = (replace(kind, hash=NO_HASH) if table.humble else kind for kind in (TF_MESSAGE, MARKER_ARRAY))
        topics = (RosTopic("/tf", tf, TF_DEPTH), RosTopic(f"{namespace.rstrip('/')}/skeleton", markers, MARKERS_DEPTH))
        self._connection = RosConnection(table.connect, table.domain, namespace, NODE, topics, digest)
        self._body: RosBody | None = None
        self._shown = False
        self._counts = Counter[str]()

    @property
    def connected(self) -> bool:
        """Whether the router has been reached."""
        return self._connection.connected

    def receive(self, envelope: Envelope) -> None:
        pass

    def send(self, actor: ActorPose, posture: str | None) -> None:
        now_ns = self._clock.now_ns()
        stamp_ns = actor.captured_ns if 0 <= now_ns - actor.captured_ns <= MAX_ROS_AGE_NS else now_ns
        if "person" in actor.lost:
            self._remove(stamp_ns, now_ns)
            return
        if self._body is None or self._body.body is not actor.body:
            self._body = RosBody(actor.anatomy, actor.body, self._world, self._prefix)
        self._shown = True
        self._put(TF, self._body.transforms(actor.pose, stamp_ns), now_ns)
        self._put(MARKERS, self._body.markers(actor.pose, actor.lost, posture, stamp_ns), now_ns)

    def counts(self) -> Mapping[str, int]:
        return self._counts

    def close(self) -> None:
        """Remove the figure and leave the graph."""
        now_ns = self._clock.now_ns()
        self._remove(now_ns, now_ns)
        self._connection.close()

    def _remove(self, stamp_ns: int, now_ns: int) -> None:
        if self._shown:
            self._shown = False
            self._put(MARKERS, no_markers(self._world, stamp_ns), now_ns)

    def _put(self, topic: int, data: bytes, now_ns: int) -> None:
        try:
            self._counts["sent" if self._connection.put(topic, data, now_ns) else "unconnected"] += 1
        except BusError:
            self._counts["failed"] += 1
