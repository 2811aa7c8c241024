"""Places and attitudes as Foxglove has them: vectors, quaternions, frames in their parents."""

import foxglove.messages as fox
import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.quaternions import quaternions
from common.formats.foxglove.channels import ROOT, WORLD, camera_frame
from common.messages import CameraInfo

# World Y up to map Z up: x stays, y becomes z, z becomes -y.  A quarter turn about X.
WORLD_TO_ROOT = fox.Quaternion(x=np.sqrt(0.5), y=0.0, z=0.0, w=np.sqrt(0.5))
ORIGIN = fox.Vector3(x=0.0, y=0.0, z=0.0)


def vector(x: float, y: float, z: float) -> fox.Vector3:
    return fox.Vector3(x=x, y=y, z=z)


def quaternion(x: float, y: float, z: float, w: float) -> fox.Quaternion:
    return fox.Quaternion(x=x, y=y, z=z, w=w)


def timestamp(captured_ns: int) -> fox.Timestamp:
    """Raises OverflowError past the year 2106, which Foxglove cannot say."""
    return fox.Timestamp(sec=captured_ns // 10**9, nsec=captured_ns % 10**9)


def body_transforms(
    anatomy: Anatomy, offsets: Floats, part_to_world: Floats, stamp: fox.Timestamp
) -> list[fox.FrameTransform]:
    """Every part's frame in its parent part's, the first one's in the world.

    offsets: (joints, 3) metres.  part_to_world: (parts, 3, 4), as `part_frames` gives it.
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
        for joint, origin, turn in zip(anatomy.joints, origins.tolist(), quaternions(rotations).tolist(), strict=True)
    ]


def fixed_transforms(cameras: list[CameraInfo], stamp: fox.Timestamp) -> list[fox.FrameTransform]:
    """The world in the root frame, and every camera in the world."""
    transforms = [_transform(stamp, ROOT, WORLD, ORIGIN, WORLD_TO_ROOT)]
    for camera in cameras:
        camera_to_world = np.array(camera.rotation).reshape(3, 3).T
        centre = -camera_to_world @ np.array(camera.translation)
        turn = quaternions(camera_to_world[None])[0]
        transforms.append(
            _transform(stamp, WORLD, camera_frame(camera.viewer), vector(*centre.tolist()), quaternion(*turn.tolist()))
        )
    return transforms


def _transform(
    stamp: fox.Timestamp, parent: str, child: str, origin: fox.Vector3, turn: fox.Quaternion
) -> fox.FrameTransform:
    return fox.FrameTransform(
        timestamp=stamp, parent_frame_id=parent, child_frame_id=child, translation=origin, rotation=turn
    )
