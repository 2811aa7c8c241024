"""Between messages, which name things, and arrays, which order them by an anatomy."""

from collections.abc import Mapping

import numpy as np

from common.body.anatomy import ANATOMIES, Anatomy, Floats
from common.body.definition import Bdp
from common.camera.pinhole import Camera
from common.messages import MOST_POINTS, Body, CameraInfo, ScenePoints

FARTHEST_MM = 32767  # 16 bits
LEAST_FOCAL_PX, NOT_TURNED = 1e-3, 1e-3
DISTORTIONS = (0, 4, 5, 8, 12, 14)  # how many numbers OpenCV knows


def body_of(anatomy: Anatomy, bdp: Bdp) -> Body:
    """The message's form of a body definition."""
    sizes = {part: _triple(bdp.sizes[k]) for k, part in enumerate(anatomy.parts)}
    offsets = {joint.name: _triple(bdp.offsets[k]) for k, joint in enumerate(anatomy.joints)}
    tips = {} if bdp.tips is None else {part: _pair(bdp.tips[k]) for k, part in enumerate(anatomy.parts)}
    bases = {} if bdp.bases is None else {part: _triple(bdp.bases[k]) for k, part in enumerate(anatomy.parts)}
    return Body(anatomy=anatomy.name, sizes=sizes, offsets=offsets, tips=tips, bases=bases)


def bdp_of(anatomy: Anatomy, body: Body) -> Bdp:
    """A message's body definition as arrays.  Raises ValueError when it is of another anatomy."""
    if body.anatomy != anatomy.name:
        raise ValueError(f"body: anatomy is {body.anatomy!r}; this service knows {anatomy.name!r}")
    missing = [part for part in anatomy.parts if part not in body.sizes]
    missing += [joint.name for joint in anatomy.joints if joint.name not in body.offsets]
    shapes: tuple[Mapping[str, object], ...] = (body.tips, body.bases)
    missing += [part for shape in shapes if shape for part in anatomy.parts if part not in shape]  # all of them or none
    if missing:
        raise ValueError(f"body: {', '.join(missing)} missing; an anatomy {anatomy.name!r} has them")
    return Bdp(
        sizes=np.array([body.sizes[part] for part in anatomy.parts]),
        offsets=np.array([body.offsets[joint.name] for joint in anatomy.joints]),
        tips=np.array([body.tips[part] for part in anatomy.parts]) if body.tips else None,
        bases=np.array([body.bases[part] for part in anatomy.parts]) if body.bases else None,
    )


def anatomy_of(body: Body) -> Anatomy:
    """The anatomy that a body definition names.  Raises ValueError when there is none of that name."""
    if body.anatomy not in ANATOMIES:
        raise ValueError(f"body: anatomy {body.anatomy!r}: allowed: {', '.join(ANATOMIES)}")
    return ANATOMIES[body.anatomy]


def angles_by_name(anatomy: Anatomy, angles: Floats) -> dict[str, float]:
    return {name: float(angles[k]) for k, name in enumerate(anatomy.angles)}


def angles_of(anatomy: Anatomy, named: Mapping[str, float], others: Floats) -> Floats:
    """The angles of a message in the anatomy's order; those it does not name are taken from `others` (angles,)."""
    angles = others.copy()
    for name, value in named.items():
        if name not in anatomy.index:
            raise ValueError(f"joint angle {name!r} is not one of anatomy {anatomy.name!r}")
        angles[anatomy.index[name]] = value
    return angles


def packed_points(points: Floats) -> bytes:
    """(n, 3) metres, for a `ScenePoints`: to the millimetre.  At most MOST_POINTS; those beyond 32 m are left out."""
    millimetres = np.round(1000.0 * points)
    near = millimetres[(np.abs(millimetres) <= FARTHEST_MM).all(axis=1)][:MOST_POINTS]
    return near.astype("<i2").tobytes()


def points_of(message: ScenePoints) -> Floats:
    """(n, 3) metres.  Raises ValueError for bytes that are no whole points."""
    if len(message.points) % 6:
        raise ValueError(f"points: {len(message.points)} bytes; allowed: a multiple of 6")
    points: Floats = np.frombuffer(message.points, dtype="<i2").reshape(-1, 3) / 1000.0
    return points


def camera_of(info: CameraInfo) -> Camera:
    """The camera that a viewer says it has.  Raises ValueError for numbers that no camera can have."""
    matrix, rotation = np.array(info.matrix).reshape(3, 3), np.array(info.rotation).reshape(3, 3)
    if min(info.size) < 1:
        raise ValueError(f"camera {info.name}: size: {info.size}; allowed: from 1 px")
    if min(matrix[0, 0], matrix[1, 1]) < LEAST_FOCAL_PX or matrix[1, 0] or not np.array_equal(matrix[2], [0.0, 0.0, 1.0]):
        raise ValueError(
            f"camera {info.name}: matrix: {info.matrix}; allowed: fx, 0, cx, 0, fy, cy, 0, 0, 1, fx and fy positive"
        )
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=NOT_TURNED) or np.linalg.det(rotation) < 0:
        raise ValueError(f"camera {info.name}: rotation: {info.rotation}; allowed: a rotation")
    if len(info.distortions) not in DISTORTIONS:
        raise ValueError(f"camera {info.name}: {len(info.distortions)} distortions; allowed: {DISTORTIONS}")
    return Camera(info.name, info.size, matrix, np.array(info.distortions), rotation, np.array(info.translation))


def _pair(row: Floats) -> tuple[float, float]:
    return float(row[0]), float(row[1])


def _triple(row: Floats) -> tuple[float, float, float]:
    return float(row[0]), float(row[1]), float(row[2])
