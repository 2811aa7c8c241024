"""Scene and coordinate frames for Foxglove: a cylinder or cone per part.

A `foxglove.CylinderPrimitive` has its axis along its own Z, centred, in a box of its size.  A part has its axis along its
own Y from its joint, the long radius along X and the short one along Z.  So the primitive's X, Y, Z are the part's X, -Z,
Y.  Both radii of a cone shrink by the same factor: the mean of the part's two.
"""

from collections.abc import Iterable

import foxglove.messages as fox
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.body.rotations import matrix_to_quaternion
from zenocap.common.body.segments import limbs_of
from zenocap.common.formats.foxglove.channels import PERSON, ROOT, WORLD, camera_frame
from zenocap.common.messages import CameraInfo

Placed = tuple[str, fox.Vector3, fox.Quaternion]  # name of a frame, and its origin and turn in another one
# Columns of a part's rotation, and their signs, in a primitive's.
_COLUMNS, _SIGNS = [0, 2, 1], np.array([1.0, -1.0, 1.0])
LEFT = fox.Color(r=1.0, g=0.59, b=0.24, a=1.0)  # orange, as in the overlays of `zenocap track`
RIGHT = fox.Color(r=0.24, g=0.75, b=1.0, a=1.0)  # blue
MIDDLE = fox.Color(r=0.43, g=0.86, b=0.43, a=1.0)  # green
LOST = fox.Color(r=0.5, g=0.5, b=0.5, a=1.0)  # a lost limb; transparency would apply to the whole entity
LIFETIME = fox.Duration(sec=1, nsec=0)  # the figure disappears when no pose follows; chosen by hand


class Figure:
    """Cylinders of one body; everything that does not depend on the pose is computed once."""

    def __init__(self, anatomy: Anatomy, bdp: Bdp) -> None:
        self.bdp = bdp
        self._middles = bdp.sizes[:, :1] / 2 * [0.0, 1.0, 0.0]
        tops = np.ones(len(bdp.sizes))
        if bdp.bases is not None:
            self._middles = self._middles + bdp.bases
        if bdp.tips is not None:
            tops = np.mean(bdp.tips / bdp.sizes[:, 1:], axis=1)
        # The box has the width of the wider end, which has scale 1.
        self._bottoms, self._tops = (np.minimum(scale, 1.0).tolist() for scale in (1.0 / tops, tops))
        widest = np.maximum(tops, 1.0)[:, None] * bdp.sizes[:, 1:]
        rows = np.column_stack([widest, bdp.sizes[:, 0]]).tolist()
        self._sizes = [vector(2 * across, 2 * deep, height) for across, deep, height in rows]
        self._colours = [_colour(part) for part in anatomy.parts]
        self._limbs = {limb.name: (limb.upper, limb.lower) for limb in limbs_of(anatomy)}

    def shown(self, part_to_world: Floats, lost: list[str], stamp: fox.Timestamp) -> fox.SceneUpdate:
        """Scene of a pose.  part_to_world: (parts, 3, 4).  lost: names of lost limbs, shown in grey."""
        centres = part_to_world[:, :, 3] + np.einsum("pij,pj->pi", part_to_world[:, :, :3], self._middles)
        turns = matrix_to_quaternion(part_to_world[:, :, _COLUMNS] * _SIGNS)
        colours = self._colours.copy()
        for name in lost:
            for part in self._limbs.get(name, ()):
                colours[part] = LOST
        cylinders = [
            fox.CylinderPrimitive(
                pose=fox.Pose(position=vector(*centre), orientation=quaternion(*turn)),
                size=size,
                bottom_scale=bottom,
                top_scale=top,
                color=colour,
            )
            for centre, turn, size, bottom, top, colour in zip(
                centres.tolist(), turns.tolist(), self._sizes, self._bottoms, self._tops, colours, strict=True
            )
        ]
        entity = fox.SceneEntity(timestamp=stamp, frame_id=WORLD, id=PERSON, lifetime=LIFETIME, cylinders=cylinders)
        return fox.SceneUpdate(entities=[entity])


def deletion(stamp: fox.Timestamp) -> fox.SceneUpdate:
    """Deletion of the figure, while the person is lost."""
    return fox.SceneUpdate(deletions=[fox.SceneEntityDeletion(timestamp=stamp, id=PERSON)])


def _colour(part: str) -> fox.Color:
    return LEFT if part.startswith("left") else RIGHT if part.startswith("right") else MIDDLE


# World Y up to map Z up: (x, y, z) -> (x, -z, y), a quarter turn about X.
WORLD_TO_ROOT = fox.Quaternion(x=np.sqrt(0.5), y=0.0, z=0.0, w=np.sqrt(0.5))
ORIGIN = fox.Vector3(x=0.0, y=0.0, z=0.0)


def vector(x: float, y: float, z: float) -> fox.Vector3:
    return fox.Vector3(x=x, y=y, z=z)


def quaternion(x: float, y: float, z: float, w: float) -> fox.Quaternion:
    return fox.Quaternion(x=x, y=y, z=z, w=w)


def timestamp(captured_ns: int) -> fox.Timestamp:
    """Timestamp of nanoseconds since the Unix epoch.  Raises OverflowError after the year 2106, Foxglove's limit."""
    return fox.Timestamp(sec=captured_ns // 10**9, nsec=captured_ns % 10**9)


def body_transforms(
    anatomy: Anatomy, offsets: Floats, part_to_world: Floats, stamp: fox.Timestamp
) -> list[fox.FrameTransform]:
    """Frame of every part in its parent part's frame, the first one in the world.

    offsets: (joints, 3) metres.  part_to_world: (parts, 3, 4), see `part_frames`.
    """
    parents = anatomy.tree[:, 0]
    rotations, origins = part_to_world[:, :, :3].copy(), offsets
    moved = parents >= 0
    rotations[moved] = part_to_world[parents[moved], :, :3].transpose(0, 2, 1) @ part_to_world[moved, :, :3]
    origins = np.where(moved[:, None], offsets, part_to_world[:, :, 3])
    return [
        fox.FrameTransform(
            timestamp=stamp,
            parent_frame_id=joint.parent or WORLD,
            child_frame_id=joint.part,
            translation=vector(*origin),
            rotation=quaternion(*turn),
        )
        for joint, origin, turn in zip(
            anatomy.joints, origins.tolist(), matrix_to_quaternion(rotations).tolist(), strict=True
        )
    ]


def placed(camera: CameraInfo) -> Placed:
    """Frame of a camera in the world."""
    camera_to_world = np.array(camera.rotation).reshape(3, 3).T
    centre = -camera_to_world @ np.array(camera.translation)
    turn = matrix_to_quaternion(camera_to_world[None])[0]
    return camera_frame(camera.viewer), vector(*centre.tolist()), quaternion(*turn.tolist())


def fixed_transforms(cameras: Iterable[Placed], stamp: fox.Timestamp) -> list[fox.FrameTransform]:
    """Frames of the world in ROOT and of every camera in the world."""
    return [_transform(stamp, ROOT, WORLD, ORIGIN, WORLD_TO_ROOT), *(_transform(stamp, WORLD, *one) for one in cameras)]


def _transform(
    stamp: fox.Timestamp, parent: str, child: str, origin: fox.Vector3, turn: fox.Quaternion
) -> fox.FrameTransform:
    return fox.FrameTransform(
        timestamp=stamp, parent_frame_id=parent, child_frame_id=child, translation=origin, rotation=turn
    )
