"""ROS 2 messages of a pose: TFMessage, and MarkerArray with bones, joints and posture.

Axes are those of REP 103, X forward, Y left, Z up: a vector of our world or of a body part is multiplied by A, a rotation
R becomes A R A^T.  A part's frame so has Z along the part, from its joint on; an upright torso has X to the front.
"""

from collections.abc import Sequence

import numpy as np

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import joint_centres, part_frames
from zenocap.common.body.rotations import matrix_to_quaternion
from zenocap.common.formats.cdr import CdrWriter
from zenocap.common.formats.trajectories import MATRICES, convert
from zenocap.services.animator import parameters as p

OUR_WORLD_TO_ROS = MATRICES["ros"]
LINE_LIST, SPHERE_LIST, TEXT_VIEW_FACING = 5, 7, 9  # types of visualization_msgs/Marker
ADD, DELETE = 0, 2  # actions
BONES_ID, JOINTS_ID, POSTURE_ID = 0, 1, 2
# Pairs of joint centres, and the limb they belong to.
BONES = (
    ("Hip", "Neck", ""), ("Neck", "Head", ""),
    ("Neck", "RShoulder", ""), ("RShoulder", "RElbow", "right_arm"), ("RElbow", "RWrist", "right_arm"),
    ("Neck", "LShoulder", ""), ("LShoulder", "LElbow", "left_arm"), ("LElbow", "LWrist", "left_arm"),
    ("Hip", "RHip", ""), ("RHip", "RKnee", "right_leg"), ("RKnee", "RAnkle", "right_leg"),
    ("Hip", "LHip", ""), ("LHip", "LKnee", "left_leg"), ("LKnee", "LAnkle", "left_leg"),
)  # fmt: skip
LIMB_OF = {end: limb for _, end, limb in BONES if limb}
Colour = tuple[float, float, float, float]  # red, green, blue, alpha, as in Foxglove and on pictures
LEFT, RIGHT, MIDDLE = (1.0, 0.59, 0.24, 1.0), (0.24, 0.75, 1.0, 1.0), (0.43, 0.86, 0.43, 1.0)
JOINT, TEXT, LOST = (1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0), (0.5, 0.5, 0.5, 0.3)
ORIGIN = (0.0, 0.0, 0.0)


class RosBody:
    """Messages of one body.  world: name of the frame of the world.  prefix: of the names of the parts' frames."""

    def __init__(self, anatomy: Anatomy, body: Bdp, world: str, prefix: str) -> None:
        self.body = body
        self._anatomy, self._world = anatomy, world
        self._children = [f"{prefix}{part}" for part in anatomy.parts]
        self._parents = [f"{prefix}{joint.parent}" if joint.parent else world for joint in anatomy.joints]
        self._offsets = convert(body.offsets, "ros")
        self._names = [marker.name for marker in anatomy.markers]

    def transforms(self, pose: Pose, stamp_ns: int) -> bytes:
        """TFMessage: every part's frame in that of its parent part, the first one in the frame of the world."""
        frames = part_frames(self._anatomy, self.body, pose)
        parents = self._anatomy.tree[:, 0]
        rotations, moved = frames[:, :, :3].copy(), parents >= 0
        rotations[moved] = frames[parents[moved], :, :3].transpose(0, 2, 1) @ frames[moved, :, :3]
        origins = np.where(moved[:, None], self._offsets, convert(frames[:, :, 3], "ros"))
        turns = matrix_to_quaternion(OUR_WORLD_TO_ROS @ rotations @ OUR_WORLD_TO_ROS.T)
        out = CdrWriter()
        out.uint32(len(self._children))
        rows = np.column_stack([origins, turns]).tolist()
        for parent, child, row in zip(self._parents, self._children, rows, strict=True):
            _header(out, stamp_ns, parent)
            out.string(child)
            out.float64(row)
        return out.data()

    def markers(self, pose: Pose, lost: Sequence[str], posture: str | None, stamp_ns: int) -> bytes:
        """MarkerArray: lines of the bones, spheres of the joint centres, and the posture above the head.

        lost: limbs that are drawn pale.  posture: None for none; its text is then removed.
        """
        rows = convert(joint_centres(self._anatomy, self.body, pose), "ros").tolist()
        centres = dict(zip(self._names, rows, strict=True))
        ends = [centres[name] for start, end, _ in BONES for name in (start, end)]
        bones = [LOST if limb in lost else _colour(end) for _, end, limb in BONES for _ in (0, 1)]
        joints = [LOST if LIMB_OF.get(name) in lost else JOINT for name in self._names]
        out = CdrWriter()
        out.uint32(3)
        _marker(
            out, stamp_ns, self._world, BONES_ID, LINE_LIST, scale=(p.ROS_BONE_WIDTH_M, 0.0, 0.0), points=ends,
            colours=bones,
        )  # fmt: skip
        _marker(
            out, stamp_ns, self._world, JOINTS_ID, SPHERE_LIST, scale=(p.ROS_JOINT_DIAMETER_M,) * 3, points=rows,
            colours=joints,
        )  # fmt: skip
        above = [*centres["Head"][:2], centres["Head"][2] + p.ROS_TEXT_ABOVE_HEAD_M]
        _marker(
            out, stamp_ns, self._world, POSTURE_ID, TEXT_VIEW_FACING, action=DELETE if posture is None else ADD,
            position=above, scale=(0.0, 0.0, p.ROS_TEXT_HEIGHT_M), text=(posture or "")[:p.MAX_ROS_TEXT],
        )  # fmt: skip
        return out.data()


def no_markers(world: str, stamp_ns: int) -> bytes:
    """MarkerArray that removes the figure."""
    out = CdrWriter()
    out.uint32(3)
    for id, kind in ((BONES_ID, LINE_LIST), (JOINTS_ID, SPHERE_LIST), (POSTURE_ID, TEXT_VIEW_FACING)):
        _marker(out, stamp_ns, world, id, kind, action=DELETE)
    return out.data()


def _colour(name: str) -> Colour:
    """Colour of a bone that ends at the joint centre `name`."""
    return LEFT if name.startswith("L") else RIGHT if name.startswith("R") else MIDDLE


def _header(out: CdrWriter, stamp_ns: int, frame: str) -> None:
    out.time(stamp_ns)
    out.string(frame)


def _marker(
    out: CdrWriter, stamp_ns: int, frame: str, id: int, kind: int, *, action: int = ADD,
    position: Sequence[float] = ORIGIN, scale: Sequence[float] = ORIGIN, points: Sequence[Sequence[float]] = (),
    colours: Sequence[Colour] = (), text: str = "",
) -> None:  # fmt: skip
    """A visualization_msgs/Marker.  position, scale, points: metres.  colours: one for each point."""
    _header(out, stamp_ns, frame)
    out.string("person")  # namespace
    out.int32(id, kind, action)
    out.float64((*position, 0.0, 0.0, 0.0, 1.0, *scale))  # position, orientation, scale
    out.float32(TEXT)
    out.time(p.ROS_LIFETIME_NS)
    out.bool(False)  # frame_locked
    out.uint32(len(points))
    for point in points:
        out.float64(point)
    out.uint32(len(colours))
    for colour in colours:
        out.float32(colour)
    out.string("")  # texture_resource
    _header(out, 0, "")  # texture: header, format, data
    out.string("")
    out.uint32(0)
    out.uint32(0)  # uv_coordinates
    out.string(text)
    out.string("")  # mesh_resource
    out.string("")  # mesh_file: filename, data
    out.uint32(0)
    out.bool(False)  # mesh_use_embedded_materials
