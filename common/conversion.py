"""Conversion between messages, which are keyed by names, and arrays, which are ordered by an anatomy."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import ANATOMIES, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import MOST_POINTS, Body, CameraInfo, ScenePoints, Silhouette, TrackerPose, UniversalBap
from zenocap.common.vision.mask_codec import unpack

Bap: TypeAlias = UniversalBap | TrackerPose

MAX_POINT_MM = 32767  # 16 bits
MIN_FOCAL_PX = 1e-3  # chosen by hand
ROTATION_TOLERANCE = 1e-3  # of the elements of R R^T; chosen by hand
DISTORTION_COUNTS = (0, 4, 5, 8, 12, 14)  # numbers of coefficients of OpenCV's lens models, or none


def body_of(anatomy: Anatomy, bdp: Bdp) -> Body:
    """Message of a body definition."""
    sizes = {part: _triple(bdp.sizes[k]) for k, part in enumerate(anatomy.parts)}
    offsets = {joint.name: _triple(bdp.offsets[k]) for k, joint in enumerate(anatomy.joints)}
    tips = {} if bdp.tips is None else {part: _pair(bdp.tips[k]) for k, part in enumerate(anatomy.parts)}
    bases = {} if bdp.bases is None else {part: _triple(bdp.bases[k]) for k, part in enumerate(anatomy.parts)}
    return Body(anatomy=anatomy.name, sizes=sizes, offsets=offsets, tips=tips, bases=bases)


def bdp_of(anatomy: Anatomy, body: Body) -> Bdp:
    """Body definition of a message.  Raises ValueError for another anatomy and for missing parts or joints."""
    if body.anatomy != anatomy.name:
        raise ValueError(f"body: anatomy is {body.anatomy!r}; this service uses {anatomy.name!r}")
    missing = [part for part in anatomy.parts if part not in body.sizes]
    missing += [joint.name for joint in anatomy.joints if joint.name not in body.offsets]
    shapes: tuple[Mapping[str, object], ...] = (body.tips, body.bases)
    missing += [part for shape in shapes if shape for part in anatomy.parts if part not in shape]  # all parts or none
    if missing:
        raise ValueError(f"body: {', '.join(missing)} missing; required by anatomy {anatomy.name!r}")
    return Bdp(
        sizes=np.array([body.sizes[part] for part in anatomy.parts]),
        offsets=np.array([body.offsets[joint.name] for joint in anatomy.joints]),
        tips=np.array([body.tips[part] for part in anatomy.parts]) if body.tips else None,
        bases=np.array([body.bases[part] for part in anatomy.parts]) if body.bases else None,
    )


def anatomy_of(body: Body) -> Anatomy:
    """Anatomy named by a body definition.  Raises ValueError for an unknown name."""
    if body.anatomy not in ANATOMIES:
        raise ValueError(f"body: anatomy {body.anatomy!r}: allowed: {', '.join(ANATOMIES)}")
    return ANATOMIES[body.anatomy]


def angles_by_name(anatomy: Anatomy, angles: Floats) -> dict[str, float]:
    """Joint angles (angles,) by name."""
    return {name: float(angles[k]) for k, name in enumerate(anatomy.angles)}


def angles_of(anatomy: Anatomy, named: Mapping[str, float], others: Floats) -> Floats:
    """Joint angles (angles,) of a message; angles without value are taken from `others` (angles,).

    Raises ValueError for an unknown angle.
    """
    angles = others.copy()
    for name, value in named.items():
        if name not in anatomy.index:
            raise ValueError(f"joint angle {name!r} is not one of anatomy {anatomy.name!r}")
        angles[anatomy.index[name]] = value
    return angles


def pose_of(anatomy: Anatomy, bap: Bap) -> Pose:
    """Return a BAP as arrays; missing angles are those of the neutral pose.

    Raises ValueError for an angle that the anatomy does not have.
    """
    return Pose(np.array(bap.position, dtype=np.float64), angles_of(anatomy, bap.angles, anatomy.neutral))


def is_lost(bap: Bap) -> bool:
    """Whether the person is lost, so that the pose is invalid."""
    return bap.lost if isinstance(bap, TrackerPose) else "person" in bap.lost


def lost_parts(pose: Bap) -> Sequence[str]:
    """Names of the lost limbs of a pose, or "person"."""
    if isinstance(pose, TrackerPose):
        return ["person"] if pose.lost else pose.lost_limbs
    return pose.lost


def packed_points(points: Floats) -> bytes:
    """Points (n, 3), metres, in millimetres for a `ScenePoints`.  At most MOST_POINTS; points beyond 32 m are left out."""
    millimetres = np.round(1000.0 * points)
    near = millimetres[(np.abs(millimetres) <= MAX_POINT_MM).all(axis=1)][:MOST_POINTS]
    return near.astype("<i2").tobytes()


def points_of(message: ScenePoints) -> Floats:
    """Points (n, 3) of a message, metres.  Raises ValueError for an incomplete point."""
    if len(message.points) % 6:
        raise ValueError(f"points: {len(message.points)} bytes; allowed: a multiple of 6")
    points: Floats = np.frombuffer(message.points, dtype="<i2").reshape(-1, 3) / 1000.0
    return points


def camera_of(info: CameraInfo) -> Camera:
    """Camera of a viewer's message.  Raises ValueError for invalid intrinsics or rotation."""
    matrix, rotation = np.array(info.matrix).reshape(3, 3), np.array(info.rotation).reshape(3, 3)
    if min(info.size) < 1:
        raise ValueError(f"camera {info.name}: size: {info.size}; allowed: from 1 px")
    if min(matrix[0, 0], matrix[1, 1]) < MIN_FOCAL_PX or matrix[1, 0] or not np.array_equal(matrix[2], [0.0, 0.0, 1.0]):
        raise ValueError(
            f"camera {info.name}: matrix: {info.matrix}; allowed: fx, 0, cx, 0, fy, cy, 0, 0, 1, fx and fy positive"
        )
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=ROTATION_TOLERANCE) or np.linalg.det(rotation) < 0:
        raise ValueError(f"camera {info.name}: rotation: {info.rotation}; allowed: a rotation")
    if len(info.distortions) not in DISTORTION_COUNTS:
        raise ValueError(f"camera {info.name}: {len(info.distortions)} distortions; allowed: {DISTORTION_COUNTS}")
    return Camera(info.name, info.size, matrix, np.array(info.distortions), rotation, np.array(info.translation))


def _pair(row: Floats) -> tuple[float, float]:
    return float(row[0]), float(row[1])


def _triple(row: Floats) -> tuple[float, float, float]:
    return float(row[0]), float(row[1]), float(row[2])


def silhouette_mask(silhouette: Silhouette, size: tuple[int, int] | None = None) -> Mask:
    """Mask (height, width) of a silhouette.  Raises ValueError for a damaged one, or one that is not of `size`."""
    if size is not None and tuple(silhouette.size) != size:
        raise ValueError(f"viewer {silhouette.viewer}: silhouettes of {silhouette.size}, its camera has {size}")
    return unpack(silhouette.size, silhouette.region, silhouette.data)
