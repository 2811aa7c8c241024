"""UDP output: one datagram with one line of JSON for each pose, for programs of your own."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from zenocap.common.body.kinematics import joint_centres
from zenocap.common.conversion import angles_by_name
from zenocap.common.rig.animator import UdpTable
from zenocap.common.runtime.clock import Clock
from zenocap.services.animator.outputs.output import DatagramOutput
from zenocap.services.animator.states import ActorPose, Source

METRES_DIGITS, RADIANS_DIGITS = 4, 5  # after the point

Point = tuple[float, float, float]


class PoseLine(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One pose.  Metres and radians; right-handed, Y up, origin on the ground; left and right are the person's own."""

    zenocap: Annotated[Literal[1], Meta(description="Version of this schema.")] = 1
    rig: Annotated[str, Meta(description="Name of the rig.")]
    frame: Annotated[int, Meta(ge=0, description="Frame number.")]
    captured_ns: Annotated[int, Meta(ge=0, description="Capture time, nanoseconds since the Unix epoch.")]
    source: Annotated[Source, Meta(description="What estimated the pose: the two-view system or the tracker.")]
    lost: Annotated[bool, Meta(description="The person is being localized; position, joints and angles are null.")]
    searched: Annotated[list[str], Meta(description="Limbs that are being localized.")]
    posture: Annotated[str | None, Meta(description="Recognized posture; null when there is none.")]
    position: Annotated[Point | None, Meta(description="Position of the navel joint, metres.")]
    joints: Annotated[dict[str, Point] | None, Meta(description="Joint centres by HALPE name, metres.")]
    angles: Annotated[dict[str, float] | None, Meta(description="Joint angles, joint.axis, radians.")]


_encode = msgspec.json.Encoder().encode


def pose_line(rig: str, actor: ActorPose, posture: str | None) -> bytes:
    """Return the JSON line of one pose, newline included."""
    lost = "person" in actor.lost
    position: Point | None = None
    joints: dict[str, Point] | None = None
    angles: dict[str, float] | None = None
    if not lost:
        rows = joint_centres(actor.anatomy, actor.body, actor.pose).round(METRES_DIGITS).tolist()
        joints = {marker.name: (x, y, z) for marker, (x, y, z) in zip(actor.anatomy.markers, rows, strict=True)}
        x, y, z = actor.pose.position.round(METRES_DIGITS).tolist()
        position = x, y, z
        angles = angles_by_name(actor.anatomy, actor.pose.angles.round(RADIANS_DIGITS))
    line = PoseLine(
        rig=rig, frame=actor.frame, captured_ns=actor.captured_ns, source=actor.source, lost=lost,
        searched=[limb for limb in actor.lost if limb != "person"], posture=posture, position=position, joints=joints,
        angles=angles,
    )  # fmt: skip
    return _encode(line) + b"\n"


class UdpOutput(DatagramOutput):
    """Sends every pose to one receiver."""

    def __init__(self, table: UdpTable, rig: str) -> None:
        """Raises OutputError."""
        super().__init__("animator.udp", table.host, table.port)
        self._rig = rig

    def send(self, actor: ActorPose, posture: str | None) -> None:
        self._sender.send(pose_line(self._rig, actor, posture))


def opened(table: UdpTable, rig: str, clock: Clock) -> UdpOutput:
    """The output of a rig.  Raises OutputError."""
    return UdpOutput(table, rig)
