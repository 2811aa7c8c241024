"""Places and attitudes as Foxglove has them: vectors, quaternions, frames in their parents."""

import foxglove.messages as fox
import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.formats.foxglove.channels import ROOT, WORLD, camera_frame
from common.messages import CameraInfo

# World Y up to map Z up: x stays, y becomes z, z becomes -y.  A quarter turn about X.
WORLD_TO_ROOT = fox.Quaternion(x=np.sqrt(0.5), y=0.0, z=0.0, w=np.sqrt(0.5))
ORIGIN = fox.Vector3(x=0.0, y=0.0, z=0.0)


def _outer_products() -> tuple[Floats, Floats]:
    """4 q q^T of a rotation matrix R is linear in R: (9, 16) factors of R row by row, and (16,) added; q as x, y, z, w."""
    factors, added = np.zeros((3, 3, 4, 4)), np.eye(4)
    for i in range(3):
        for k in range(4):  # the diagonal: 4 x^2 = 1 + R00 - R11 - R22, and 4 w^2 = 1 + trace
            factors[i, i, k, k] = 1.0 if k in (i, 3) else -1.0
        j, k = (i + 1) % 3, (i + 2) % 3
        for row, column in ((j, k), (k, j)):  # 4 y z = R12 + R21
            factors[j, k, row, column] = factors[k, j, row, column] = 1.0
        for row, column in ((i, 3), (3, i)):  # 4 x w = R21 - R12
            factors[k, j, row, column], factors[j, k, row, column] = 1.0, -1.0
    return factors.reshape(9, 16), added.ravel()


_FACTORS, _ADDED = _outer_products()


def quaternions(rotations: Floats) -> Floats:
    """(n, 4) unit quaternions x, y, z, w of rotation matrices (n, 3, 3); their largest component is positive."""
    products = (rotations.reshape(-1, 9) @ _FACTORS + _ADDED).reshape(-1, 4, 4)
    rows = np.arange(len(products))
    largest = np.argmax(products[:, (0, 1, 2, 3), (0, 1, 2, 3)], axis=1)
    found = products[rows, largest]
    unit: Floats = found / np.sqrt(np.sum(found * found, axis=1, keepdims=True))
    return unit


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
