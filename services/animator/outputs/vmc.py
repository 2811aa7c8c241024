"""VMC output: the Virtual Motion Capture protocol (protocol.vmc.info) for programs that show avatars.

VMC is Open Sound Control (OSC) 1.0 over UDP.  This is the protocol's "performer", the receiver its "marionette".  The
model's root stays at the world origin on the ground; the hips carry the position.  Each pose is one or two OSC bundles,
none larger than a network packet.

Avatars use Unity's humanoid: X right, Y up, Z forward, left-handed.  This is the world frame with X mirrored, so a rotation
R becomes A R A^T.  The rest pose is a T-pose facing Z, in which every bone's rotation is the identity.
"""

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.rotations import matrix_to_quaternion
from zenocap.common.formats.bone_names import unity_name
from zenocap.common.formats.osc import osc_bundles, osc_message, osc_string
from zenocap.common.formats.skeleton import skeleton_of, turned_bones
from zenocap.common.formats.trajectories import MATRICES, convert
from zenocap.common.rig.animator import VmcTable
from zenocap.common.runtime.clock import Clock
from zenocap.services.animator.outputs.output import DatagramOutput
from zenocap.services.animator.parameters import MAX_DATAGRAM_BYTES
from zenocap.services.animator.states import ActorPose

OUR_WORLD_TO_UNITY = MATRICES["unity"]

LOADED, CALIBRATED, NORMAL_MODE = 1, 3, 0  # arguments of /VMC/Ext/OK
ROOT = osc_message("/VMC/Ext/Root/Pos", "root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
BONE_HEADER = osc_string("/VMC/Ext/Bone/Pos") + osc_string(",sfffffff")
NOT_LOADED = osc_message("/VMC/Ext/OK", 0, 0, 0, 0)


class Humanoid:
    """Unity humanoid of one body.

    names: bones in Unity's HumanBodyBones, parents first.  parents: index of each bone's parent, -1 for the hips.
    """

    def __init__(self, anatomy: Anatomy, body: Bdp) -> None:
        """Raises ValueError for an anatomy without a skeleton."""
        self._anatomy, self._body = anatomy, body
        self._skeleton = skeleton_of(anatomy, body)
        self.names = tuple(unity_name(name) for name in self._skeleton.names)
        self.parents = self._skeleton.parents
        self._offsets = convert(self._skeleton.offsets, "unity")

    def bones(self, pose: Pose) -> Floats:
        """Bones in their parent's frame, the hips in the world: (bones, 7) position (m) and quaternion x, y, z, w."""
        frames = part_frames(self._anatomy, self._body, pose)
        rotations = OUR_WORLD_TO_UNITY @ turned_bones(self._skeleton, frames[None])[0] @ OUR_WORLD_TO_UNITY.T
        positions = self._offsets.copy()
        positions[0] = convert(pose.position, "unity")
        return np.concatenate([positions, matrix_to_quaternion(rotations)], axis=1)


class VmcOutput(DatagramOutput):
    """Sends each pose to one receiver; while the person is lost, only the tracking status: avatars keep their pose."""

    def __init__(self, table: VmcTable) -> None:
        """Raises OutputError."""
        super().__init__("animator.vmc", table.host, table.port)
        self._humanoid: Humanoid | None = None
        self._body: Bdp | None = None
        self._bone_headers: list[bytes] = []
        self._start_ns: int | None = None

    def send(self, actor: ActorPose, posture: str | None) -> None:
        if self._humanoid is None or self._body is not actor.body:
            self._humanoid, self._body = Humanoid(actor.anatomy, actor.body), actor.body
            self._bone_headers = [BONE_HEADER + osc_string(name) for name in self._humanoid.names]
        if self._start_ns is None:
            self._start_ns = actor.captured_ns
        lost = "person" in actor.lost
        time_s = osc_message("/VMC/Ext/T", (actor.captured_ns - self._start_ns) / 1e9)
        messages = [osc_message("/VMC/Ext/OK", LOADED, CALIBRATED, NORMAL_MODE, int(not lost)), time_s]
        if not lost:
            numbers = self._humanoid.bones(actor.pose).astype(np.dtype(">f4"))
            messages.append(ROOT)
            messages += [header + row.tobytes() for header, row in zip(self._bone_headers, numbers, strict=True)]
        for bundle in osc_bundles(messages, MAX_DATAGRAM_BYTES):
            self._sender.send(bundle)

    def close(self) -> None:
        """Send "not loaded", so that the receiver shows that the stream has ended."""
        self._sender.send(NOT_LOADED)
        super().close()


def opened(table: VmcTable, rig: str, clock: Clock) -> VmcOutput:
    """The output of a rig.  Raises OutputError."""
    return VmcOutput(table)
