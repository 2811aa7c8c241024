"""UDP with JSON lines: one datagram for each pose, one line of JSON, for programs that one writes oneself."""

from collections.abc import Mapping
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from common.body.kinematics import joint_centres
from common.bus.protocol import Envelope
from common.conversion import angles_by_name
from common.runtime.animator_table import UdpTable
from services.animator.outputs.datagrams import Datagrams
from services.animator.snapshot import Actor, Source

METRES_DECIMALS, RADIANS_DECIMALS = 4, 5

Point = tuple[float, float, float]


class PoseLine(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One pose.  Metres and radians; right-handed, Y up, the origin on the ground; the person's own left and right."""

    zenocap: Annotated[Literal[1], Meta(description="Version of this schema.")] = 1
    rig: Annotated[str, Meta(description="Name of the rig.")]
    frame: Annotated[int, Meta(ge=0, description="Frame number.")]
    captured_ns: Annotated[int, Meta(ge=0, description="When it was captured, nanoseconds since the Unix epoch.")]
    source: Annotated[Source, Meta(description="Who found the pose.")]
    lost: Annotated[bool, Meta(description="The person is being searched for; position, joints and angles are null.")]
    searched: Annotated[list[str], Meta(description="Limbs that are being searched for.")]
    posture: Annotated[str | None, Meta(description="Recognised posture; null when there is none.")]
    position: Annotated[Point | None, Meta(description="Of the navel joint, metres.")]
    joints: Annotated[dict[str, Point] | None, Meta(description="Joint centres by HALPE name, metres.")]
    angles: Annotated[dict[str, float] | None, Meta(description="Joint angles, joint.axis, radians.")]


_encode = msgspec.json.Encoder().encode


def pose_line(rig: str, actor: Actor, posture: str | None) -> bytes:
    """The line of one pose, its end included."""
    lost = "person" in actor.lost
    position: Point | None = None
    joints: dict[str, Point] | None = None
    angles: dict[str, float] | None = None
    if not lost:
        rows = joint_centres(actor.anatomy, actor.body, actor.pose).round(METRES_DECIMALS).tolist()
        joints = {marker.name: (x, y, z) for marker, (x, y, z) in zip(actor.anatomy.markers, rows, strict=True)}
        x, y, z = actor.pose.position.round(METRES_DECIMALS).tolist()
        position = x, y, z
        angles = angles_by_name(actor.anatomy, actor.pose.angles.round(RADIANS_DECIMALS))
    line = PoseLine(
        rig=rig,
        frame=actor.frame,
        captured_ns=actor.captured_ns,
        source=actor.source,
        lost=lost,
        searched=[limb for limb in actor.lost if limb != "person"],
        posture=posture,
        position=position,
        joints=joints,
        angles=angles,
    )
    return _encode(line) + b"\n"


class UdpOutput:
    """Sends every pose as it comes."""

    def __init__(self, table: UdpTable, rig: str) -> None:
        """Raises OutputError."""
        self._to = Datagrams("animator.udp", table.host, table.port)
        self._rig = rig

    @property
    def title(self) -> str:
        return self._to.title

    def hear(self, envelope: Envelope) -> None:
        pass

    def send(self, actor: Actor, posture: str | None) -> None:
        self._to.send(pose_line(self._rig, actor, posture))

    def counts(self) -> Mapping[str, int]:
        return self._to.counts

    def close(self) -> None:
        self._to.close()
