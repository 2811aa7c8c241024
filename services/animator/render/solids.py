"""The body's parts as closed smooth surfaces, made once for a body and moved with its parts.

Sizes are the body's own; only ends are rounded.  A limb's end reaches round the joint that the next part turns in, so
that the two stay closed while they bend; where nothing follows, the round end lies within the part's length.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp

Triangles = NDArray[np.int32]
Shades = NDArray[np.uint8]

MIDDLE, LEFT, RIGHT, HEAD, VISOR, SEARCHED = range(6)  # rows of a palette

AROUND, CAP_RINGS, WALL_RINGS = 28, 7, 4
TRUNK_CAP = 0.6  # how far a trunk's end bulges, in its shorter radius
NECK = 0.6  # radius of a neck below the skull, in the skull's shorter one
SKULL_FROM = 0.26  # where the skull begins in a head that stands on the shoulders, in its height
JAW = 0.4  # how far it reaches below a head that is the skull alone
YOKE = 0.93  # radius of the shoulders between the arms, in theirs
VISOR_WIDE, VISOR_LOW, VISOR_HIGH, VISOR_OUT = np.radians(62.0), np.radians(-14.0), np.radians(17.0), 1.025


@dataclass(frozen=True)
class Surface:
    """points, normals: (n, 3), the latter of unit length.  triangles: (m, 3).  shades: (n,) rows of a palette."""

    points: Floats
    normals: Floats
    triangles: Triangles
    shades: Shades


@dataclass(frozen=True)
class Solids:
    """All parts of a body, each in its own frame.  parts: (n,) the part that each point belongs to."""

    surface: Surface
    parts: NDArray[np.int64]


def solids(anatomy: Anatomy, body: Bdp) -> Solids:
    """The solids of one body, metres."""
    carrying = {joint.parent for joint in anatomy.joints}
    surfaces, parts = [], []
    for k, part in enumerate(anatomy.parts):
        size = body.sizes[k]
        tip = size[1:] if body.tips is None else body.tips[k]
        base = np.zeros(3) if body.bases is None else body.bases[k]
        shade = LEFT if part.startswith("left") else RIGHT if part.startswith("right") else MIDDLE
        shapes = [
            (points + base, triangles, own)
            for points, triangles, own in _shapes(part, size, tip, shade, part in carrying, base)
        ]
        for points, triangles, own in (*shapes, *_yoke(anatomy, body, part)):
            normals = _normals(points, triangles)
            surfaces.append(Surface(points, normals, triangles, np.full(len(points), own, dtype=np.uint8)))
            parts.append(np.full(len(points), k))
    return Solids(joined(surfaces), np.concatenate(parts))


def posed(one: Solids, part_to_world: Floats, searched: Collection[int] = ()) -> Surface:
    """The surface in the world, metres.  part_to_world: (parts, 3, 4).  searched: parts that are shown as such."""
    frames = part_to_world[one.parts]
    points = np.einsum("nij,nj->ni", frames[:, :, :3], one.surface.points) + frames[:, :, 3]
    normals = np.einsum("nij,nj->ni", frames[:, :, :3], one.surface.normals)
    shades = one.surface.shades
    if searched:
        shades = np.where(np.isin(one.parts, list(searched)), np.uint8(SEARCHED), shades)
    return Surface(points, normals, one.surface.triangles, shades)


def joined(surfaces: list[Surface]) -> Surface:
    """Several surfaces as one."""
    starts = np.cumsum([0, *(len(one.points) for one in surfaces[:-1])])
    return Surface(
        np.concatenate([one.points for one in surfaces]),
        np.concatenate([one.normals for one in surfaces]),
        np.concatenate([one.triangles + start for one, start in zip(surfaces, starts, strict=True)]).astype(np.int32),
        np.concatenate([one.shades for one in surfaces]),
    )


def tube(rows: Floats) -> tuple[Floats, Triangles]:
    """A surface round the Y axis, closed at both ends: points (n, 3) and triangles (m, 3).

    rows: (rings, 3) height, and half extents along X and Z.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    ring = np.stack([np.cos(turn), np.ones(AROUND), np.sin(turn)], axis=1)
    points = np.concatenate([ring * [across, height, deep] for height, across, deep in rows])
    here = np.arange(AROUND)
    after = (here + 1) % AROUND
    triangles = []
    for low in range(0, len(points) - AROUND, AROUND):
        high = low + AROUND
        triangles += [np.stack([low + here, high + here, low + after], axis=1)]
        triangles += [np.stack([low + after, high + here, high + after], axis=1)]
    ends = np.array([[0.0, rows[0, 0], 0.0], [0.0, rows[-1, 0], 0.0]])
    first, last = len(points), len(points) - AROUND
    triangles += [np.stack([np.full(AROUND, first), here, after], axis=1)]
    triangles += [np.stack([np.full(AROUND, first + 1), last + after, last + here], axis=1)]
    return np.concatenate([points, ends]), np.concatenate(triangles).astype(np.int32)


def capsule(near: Floats, far: Floats, start: float, end: float, near_cap: float, far_cap: float) -> Floats:
    """Rows of a `tube`: a wall from `start` to `end` with radii near and far (2,), and round caps so long beyond them."""
    away = np.linspace(0.5 * np.pi, 0.0, CAP_RINGS, endpoint=False)[1:]
    below = [(start - near_cap * np.sin(a), *(near * np.cos(a))) for a in (*_ends(), *away)]
    share = np.linspace(0.0, 1.0, WALL_RINGS if end > start else 1)
    wall = [(start + s * (end - start), *(near + s * (far - near))) for s in share]
    above = [(end + far_cap * np.sin(a), *(far * np.cos(a))) for a in (*away[::-1], *_ends())]
    return np.array([*below, *wall, *above])


def _ends() -> tuple[float]:
    return (np.radians(88.0),)  # the last ring has a width, and the point beyond it closes it


def _shapes(
    part: str, size: Floats, tip: Floats, shade: int, carries: bool, base: Floats
) -> list[tuple[Floats, Triangles, int]]:
    """Points from the part's base, triangles and shade of what a part is made of."""
    height, near, far = float(size[0]), size[1:], tip
    if part == "head":
        alone = bool(base.any())  # of an anatomy whose neck is a part of its own
        low = -JAW * height if alone else SKULL_FROM * height
        middle, half = 0.5 * (low + height), 0.5 * (height - low)
        skull = tube(capsule(near, far, middle, middle, half, half))
        neck = np.full(2, NECK * near.min())
        below = tube(capsule(neck, neck, -float(base[1]), middle, 0.5 * neck[0], 0.0))
        return [(*skull, HEAD), (*_visor(0.5 * (near + far), middle, half), VISOR), (*below, HEAD)]
    if shade == MIDDLE:
        near_cap, far_cap = TRUNK_CAP * near.min(), TRUNK_CAP * far.min()
        return [(*tube(capsule(near, far, 0.0, height, near_cap, far_cap)), shade)]
    near_cap, far_cap = float(near.mean()), float(far.mean())
    if part.endswith("foot"):
        return [(*tube(capsule(near, far, near_cap, height - far_cap, near_cap, far_cap)), shade)]
    end = height if carries else height - far_cap
    return [(*tube(capsule(near, far, 0.0, end, near_cap, far_cap)), shade)]


def _yoke(anatomy: Anatomy, body: Bdp, part: str) -> list[tuple[Floats, Triangles, int]]:
    """From shoulder to shoulder, where the part carries both; in the part's frame."""
    joints = [joint for joint in anatomy.joints if joint.parent == part and joint.name.endswith("_shoulder")]
    if len(joints) != 2:
        return []
    (one, other), arm = (body.offsets[anatomy.index[joint.name]] for joint in joints), anatomy.index[joints[0].part]
    radii = YOKE * body.sizes[arm, 1:]
    length = float(np.linalg.norm(other - one))
    points, triangles = tube(capsule(radii, radii, 0.0, length, float(radii[0]), float(radii[0])))
    along = (other - one) / length
    deep = np.cross(along, [0.0, 1.0, 0.0])
    deep = deep / np.linalg.norm(deep)
    axes = np.stack([np.cross(along, deep), along, deep])
    return [(points @ axes + one, triangles, MIDDLE)]


def _visor(radii: Floats, middle: float, half: float) -> tuple[Floats, Triangles]:
    """A band on the front of an ellipsoid, by which one sees where the head looks."""
    columns, rows = np.linspace(-VISOR_WIDE, VISOR_WIDE, 17), np.linspace(VISOR_LOW, VISOR_HIGH, 7)
    side, up = (grid.ravel() for grid in np.meshgrid(columns, rows))
    unit = np.stack([np.cos(up) * np.sin(side), np.sin(up), np.cos(up) * np.cos(side)], axis=1)
    out = VISOR_OUT * unit * [radii[0], half, radii[1]]
    corners = np.arange(len(out)).reshape(len(rows), len(columns))
    a, b, c, d = (corners[r, s].ravel() for r in (slice(-1), slice(1, None)) for s in (slice(-1), slice(1, None)))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])
    return out + np.array([0.0, middle, 0.0]), triangles.astype(np.int32)


def _normals(points: Floats, triangles: Triangles) -> Floats:
    """Unit normals (n, 3), means of the faces around each point; faces turn so that they point out."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    length: Floats = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: Floats = normals / np.maximum(length, 1e-12)
    return unit
