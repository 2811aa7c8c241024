"""VRChat output: trackers by OSC (docs.vrchat.com/docs/osc-trackers, read in 2026).

VRChat accepts eight trackers, for hip, chest, feet, knees and elbows (upper arms), and a head for alignment.  Each has two
messages, `/tracking/trackers/N/position` and `/rotation`, with three floats.  In VRChat's calibration every tracker is
attached to the nearest body part of the avatar, so the numbers have no meaning of their own; here they are fixed.

Axes are Unity's (X right, Y up, Z forward, left-handed), lengths are metres, rotations Euler angles in degrees.  Unity
applies Z first, then X, then Y, about fixed axes: R = R_Y R_X R_Z.  A tracker's rotation is 0 in the T-pose facing Z.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.rotations import matrix_to_euler
from zenocap.common.formats.osc import osc_bundles, osc_string
from zenocap.common.formats.skeleton import skeleton_of
from zenocap.common.formats.trajectories import MATRICES, convert
from zenocap.common.rig.animator import TRACKERS, VrchatTable
from zenocap.common.runtime.clock import Clock
from zenocap.services.animator.outputs.output import DatagramOutput
from zenocap.services.animator.parameters import MAX_DATAGRAM_BYTES
from zenocap.services.animator.states import ActorPose

OUR_WORLD_TO_UNITY = MATRICES["unity"]
HEAD = "head"
# Bones of our skeleton: the tracker's place is where the first begins, and it turns with the second.
BONES: Mapping[str, tuple[str, str]] = {
    "hip": ("Hips", "Hips"),
    "chest": ("Spine1", "Spine1"),
    "left_foot": ("LeftFoot", "LeftFoot"),
    "right_foot": ("RightFoot", "RightFoot"),
    "left_knee": ("LeftLeg", "LeftUpLeg"),
    "right_knee": ("RightLeg", "RightUpLeg"),
    "left_elbow": ("LeftForeArm", "LeftArm"),
    "right_elbow": ("RightForeArm", "RightArm"),
    HEAD: ("Head", "Head"),
}


class TrackerSet:
    """Trackers of one body, in the order of `names`: of TRACKERS, or HEAD."""

    def __init__(self, anatomy: Anatomy, body: Bdp, names: Sequence[str]) -> None:
        """Raises ValueError for an anatomy without a skeleton."""
        self._anatomy, self._body = anatomy, body
        self._skeleton = skeleton_of(anatomy, body)
        bones = [[self._skeleton.names.index(bone) for bone in BONES[name]] for name in names]
        self._places, self._turns = np.array(bones, dtype=np.int64).reshape(-1, 2).T

    def posed(self, pose: Pose) -> tuple[Floats, Floats]:
        """Positions (trackers, 3), metres, and Euler angles (trackers, 3) about X, Y and Z, degrees, in Unity's world."""
        skeleton = self._skeleton
        frames = part_frames(self._anatomy, self._body, pose)
        bone_to_world = (frames[:, :, :3] @ np.swapaxes(skeleton.part_to_rest, -1, -2))[skeleton.parts]
        origins = np.empty((len(skeleton.names), 3))
        for bone, parent in enumerate(skeleton.parents):
            origins[bone] = (
                pose.position if parent < 0 else origins[parent] + bone_to_world[parent] @ skeleton.offsets[bone]
            )
        rotations = OUR_WORLD_TO_UNITY @ bone_to_world[self._turns] @ OUR_WORLD_TO_UNITY.T
        yxz = matrix_to_euler("yxz", rotations, np.zeros((len(rotations), 3)))
        return convert(origins[self._places], "unity"), np.degrees(yxz[:, [1, 0, 2]])


class VrchatOutput(DatagramOutput):
    """Sends each pose to one VRChat; nothing while the person is lost."""

    def __init__(self, table: VrchatTable) -> None:
        """Raises OutputError."""
        super().__init__("animator.vrchat", table.host, table.port)
        self._names = [*table.trackers, *([HEAD] if table.head != "off" else [])]
        self._trackers: TrackerSet | None = None
        self._body: Bdp | None = None
        headers: list[tuple[bytes, bytes]] = []
        for name in self._names:
            address = f"/tracking/trackers/{name if name == HEAD else TRACKERS.index(name) + 1}"
            position, rotation = (osc_string(f"{address}/{kind}") + osc_string(",fff") for kind in ("position", "rotation"))
            headers.append((position, rotation))
        self._headers = headers
        self._sends_heading = table.head == "position-and-yaw"

    def send(self, actor: ActorPose, posture: str | None) -> None:
        if "person" in actor.lost:
            return
        if self._trackers is None or self._body is not actor.body:
            self._trackers, self._body = TrackerSet(actor.anatomy, actor.body, self._names), actor.body
        positions, angles = (rows.astype(np.dtype(">f4")) for rows in self._trackers.posed(actor.pose))
        messages: list[bytes] = []
        for name, (at_position, at_rotation), place, turn in zip(
            self._names, self._headers, positions, angles, strict=True
        ):
            messages.append(at_position + place.tobytes())
            if name != HEAD or self._sends_heading:
                messages.append(at_rotation + turn.tobytes())
        for bundle in osc_bundles(messages, MAX_DATAGRAM_BYTES):
            self._sender.send(bundle)


def opened(table: VrchatTable, rig: str, clock: Clock) -> VrchatOutput:
    """The output of a rig.  Raises OutputError."""
    return VrchatOutput(table)
