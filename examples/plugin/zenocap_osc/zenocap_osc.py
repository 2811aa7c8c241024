"""Joint centres by OSC, for Unreal, TouchDesigner, Max and others: `[animator.osc]`."""

from zenocap.common.body.kinematics import joint_centres
from zenocap.common.formats.osc import osc_message
from zenocap.common.rig.animator import Host, OutputTable, Port
from zenocap.common.rig.outputs import OutputKind
from zenocap.common.runtime.clock import Clock
from zenocap.services.animator.outputs.output import DatagramOutput
from zenocap.services.animator.states import ActorPose


class OscTable(OutputTable, frozen=True, kw_only=True):
    """host, port: of the program that receives.  root: first part of the addresses, before the name of the joint."""

    host: Host = "127.0.0.1"
    port: Port = 8000
    root: str = "/zenocap"


class OscOutput(DatagramOutput):
    def __init__(self, table: OscTable) -> None:
        """Raises OutputError."""
        super().__init__("animator.osc", table.host, table.port)
        self._root = table.root

    def send(self, actor: ActorPose, posture: str | None) -> None:
        """x, y and z of each joint (m), unless the person is lost."""
        if "person" in actor.lost:
            return
        centres = joint_centres(actor.anatomy, actor.body, actor.pose)
        for marker, centre in zip(actor.anatomy.markers, centres.tolist(), strict=True):
            self._sender.send(osc_message(f"{self._root}/{marker.name}", *centre))


def opened(table: OscTable, rig: str, clock: Clock) -> OscOutput:
    return OscOutput(table)


OSC = OutputKind("osc", OscTable, "zenocap_osc:opened")
