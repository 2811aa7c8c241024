"""Surfaces of body parts, and trails of hands and feet.

Sizes are those of the body; only ends are rounded.  The round end of a limb extends around the joint to the next part, so
that no gap opens when it bends.  Where no part follows, the round end is within the length of the part.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Bytes, Floats, Ints, Ints32
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.services.animator.parameters import TRAIL_RADIUS_M, TRAIL_SPACING_M

MIDDLE, LEFT, RIGHT, HEAD, VISOR, LOST = range(6)  # rows of a palette

TRAIL_SEGMENTS = 6  # around a trail
# Proportions for display, chosen by hand.
SEGMENTS, CAP_RINGS, WALL_RINGS = 28, 7, 4  # of a surface
TRUNK_CAP = 0.6  # height of the ends of the trunk, relative to its shorter radius
NECK = 0.6  # radius of the neck, relative to the shorter radius of the skull
SKULL_START = 0.26  # of a head part that includes the neck, relative to its height
JAW = 0.4  # extent below a head part without the neck, relative to its height
SHOULDER_BAR = 0.93  # radius of the bar between the shoulders, relative to that of the arms
VISOR_WIDE, VISOR_LOW, VISOR_HIGH, VISOR_OUT = np.radians(62.0), np.radians(-14.0), np.radians(17.0), 1.025


@dataclass(frozen=True)
class Surface:
    """Triangle mesh.

    points, normals: (n, 3), unit normals.  triangles: (m, 3) rows of points.  shades: (n,) rows of a palette.
    """

    points: Floats
    normals: Floats
    triangles: Ints32
    shades: Bytes


@dataclass(frozen=True)
class BodySurface:
    """Surfaces of all parts of a body, each in its part's frame.  parts: (n,) index of the part of each point."""

    surface: Surface
    parts: Ints


def body_surface(anatomy: Anatomy, body: Bdp) -> BodySurface:
    """Return the surfaces of a body, metres."""
    carrying = {joint.parent for joint in anatomy.joints}
    surfaces, parts = [], []
    for k, part in enumerate(anatomy.parts):
        size = body.sizes[k]
        tip = size[1:] if body.tips is None else body.tips[k]
        base = np.zeros(3) if body.bases is None else body.bases[k]
        shade = LEFT if part.startswith("left") else RIGHT if part.startswith("right") else MIDDLE
        own_shapes = _shapes(part, size, tip, shade, part in carrying, base)
        shapes = [(points + base, triangles, own) for points, triangles, own in own_shapes]
        for points, triangles, own in (*shapes, *_shoulder_bar(anatomy, body, part)):
            normals = _normals(points, triangles)
            surfaces.append(Surface(points, normals, triangles, np.full(len(points), own, dtype=np.uint8)))
            parts.append(np.full(len(points), k))
    return BodySurface(concatenated(surfaces), np.concatenate(parts))


def posed_surface(one: BodySurface, part_to_world: Floats, lost: Collection[int] = ()) -> Surface:
    """Return the surface in the world, metres.  part_to_world: (parts, 3, 4).  lost: indices of parts drawn as lost."""
    frames = part_to_world[one.parts]
    points = np.einsum("nij,nj->ni", frames[:, :, :3], one.surface.points) + frames[:, :, 3]
    normals = np.einsum("nij,nj->ni", frames[:, :, :3], one.surface.normals)
    shades = one.surface.shades
    if lost:
        shades = np.where(np.isin(one.parts, list(lost)), np.uint8(LOST), shades)
    return Surface(points, normals, one.surface.triangles, shades)


def concatenated(surfaces: list[Surface]) -> Surface:
    starts = np.cumsum([0, *(len(one.points) for one in surfaces[:-1])])
    return Surface(
        np.concatenate([one.points for one in surfaces]),
        np.concatenate([one.normals for one in surfaces]),
        np.concatenate([one.triangles + start for one, start in zip(surfaces, starts, strict=True)]).astype(np.int32),
        np.concatenate([one.shades for one in surfaces]),
    )


def tube(rows: Floats) -> tuple[Floats, Ints32]:
    """Return a surface around the Y axis, closed at both ends: points (n, 3) and triangles (m, 3).

    rows: (rings, 3) height, and radii along X and Z.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, SEGMENTS, endpoint=False)
    ring = np.stack([np.cos(turn), np.ones(SEGMENTS), np.sin(turn)], axis=1)
    points = np.concatenate([ring * [across, height, deep] for height, across, deep in rows])
    here = np.arange(SEGMENTS)
    after = (here + 1) % SEGMENTS
    triangles = []
    for low in range(0, len(points) - SEGMENTS, SEGMENTS):
        high = low + SEGMENTS
        triangles += [np.stack([low + here, high + here, low + after], axis=1)]
        triangles += [np.stack([low + after, high + here, high + after], axis=1)]
    ends = np.array([[0.0, rows[0, 0], 0.0], [0.0, rows[-1, 0], 0.0]])
    first, last = len(points), len(points) - SEGMENTS
    triangles += [np.stack([np.full(SEGMENTS, first), here, after], axis=1)]
    triangles += [np.stack([np.full(SEGMENTS, first + 1), last + after, last + here], axis=1)]
    return np.concatenate([points, ends]), np.concatenate(triangles).astype(np.int32)


def capsule(near: Floats, far: Floats, start: float, end: float, near_cap: float, far_cap: float) -> Floats:
    """Return rows of a `tube`: a wall from `start` to `end` with radii near and far (2,), and round caps beyond them."""
    away = np.linspace(0.5 * np.pi, 0.0, CAP_RINGS, endpoint=False)[1:]
    last = np.radians(88.0)  # the last ring has a radius; the point beyond it closes the cap
    below = [(start - near_cap * np.sin(a), *(near * np.cos(a))) for a in (last, *away)]
    share = np.linspace(0.0, 1.0, WALL_RINGS if end > start else 1)
    wall = [(start + s * (end - start), *(near + s * (far - near))) for s in share]
    above = [(end + far_cap * np.sin(a), *(far * np.cos(a))) for a in (*away[::-1], last)]
    return np.array([*below, *wall, *above])


def _shapes(
    part: str, size: Floats, tip: Floats, shade: int, carries: bool, base: Floats
) -> list[tuple[Floats, Ints32, int]]:
    """Return points relative to the part's base, triangles and shade of every surface of a part."""
    height, near, far = float(size[0]), size[1:], tip
    if part == "head":
        alone = bool(base.any())  # in an anatomy with a separate neck part
        low = -JAW * height if alone else SKULL_START * height
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


def _shoulder_bar(anatomy: Anatomy, body: Bdp, part: str) -> list[tuple[Floats, Ints32, int]]:
    """Return the bar from shoulder to shoulder in the part's frame, if the part has both."""
    joints = [joint for joint in anatomy.joints if joint.parent == part and joint.name.endswith("_shoulder")]
    if len(joints) != 2:
        return []
    (one, other), arm = (body.offsets[anatomy.index[joint.name]] for joint in joints), anatomy.index[joints[0].part]
    radii = SHOULDER_BAR * body.sizes[arm, 1:]
    length = float(np.linalg.norm(other - one))
    points, triangles = tube(capsule(radii, radii, 0.0, length, float(radii[0]), float(radii[0])))
    along = (other - one) / length
    deep = np.cross(along, [0.0, 1.0, 0.0])
    deep = deep / np.linalg.norm(deep)
    axes = np.stack([np.cross(along, deep), along, deep])
    return [(points @ axes + one, triangles, MIDDLE)]


def _visor(radii: Floats, middle: float, half: float) -> tuple[Floats, Ints32]:
    """Return a band on the front of an ellipsoid, which shows the direction of the head."""
    columns, rows = np.linspace(-VISOR_WIDE, VISOR_WIDE, 17), np.linspace(VISOR_LOW, VISOR_HIGH, 7)
    side, up = (grid.ravel() for grid in np.meshgrid(columns, rows))
    unit = np.stack([np.cos(up) * np.sin(side), np.sin(up), np.cos(up) * np.cos(side)], axis=1)
    out = VISOR_OUT * unit * [radii[0], half, radii[1]]
    corners = np.arange(len(out)).reshape(len(rows), len(columns))
    a, b, c, d = (corners[r, s].ravel() for r in (slice(-1), slice(1, None)) for s in (slice(-1), slice(1, None)))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])
    return out + np.array([0.0, middle, 0.0]), triangles.astype(np.int32)


def _normals(points: Floats, triangles: Ints32) -> Floats:
    """Return unit normals (n, 3), averaged over the faces around each point; outward by the order of the corners."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    length: Floats = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: Floats = normals / np.maximum(length, 1e-12)
    return unit


def trails(paths: dict[str, Floats]) -> Surface | None:
    """Return tubes along paths, or None if all are too short.

    paths: by joint centre such as "LWrist", (n, 3) metres, oldest first, NaN for unknown positions.
    """
    surfaces = []
    for name, path in paths.items():
        points = _rounded(_thinned(path[np.isfinite(path).all(axis=1)]))
        if len(points) > 1:
            surfaces.append(_tube(points, LEFT if name.startswith("L") else RIGHT))
    return concatenated(surfaces) if surfaces else None


def _thinned(path: Floats) -> Floats:
    kept: list[Floats] = []
    for point in path[::-1]:  # the newest point is kept
        if not kept or float(np.linalg.norm(point - kept[-1])) >= TRAIL_SPACING_M:
            kept.append(point)
    return np.array(kept[::-1]).reshape(-1, 3)


def _rounded(path: Floats) -> Floats:
    """Round the corners of a path by two steps of Chaikin's corner cutting; the ends are kept."""
    for _ in range(2 if len(path) > 2 else 0):
        quarters = [0.75 * path[:-1] + 0.25 * path[1:], 0.25 * path[:-1] + 0.75 * path[1:]]
        path = np.concatenate([path[:1], np.stack(quarters, axis=1).reshape(-1, 3), path[-1:]])
    return path


def _tube(path: Floats, shade: int) -> Surface:
    """Return a tube along a path (n, 3), from radius 0 to TRAIL_RADIUS_M."""
    along = np.gradient(path, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    helper = np.where(np.abs(along[:, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    side = np.cross(along, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    turn = np.linspace(0.0, 2.0 * np.pi, TRAIL_SEGMENTS, endpoint=False)
    normals = side[:, None] * np.cos(turn)[None, :, None] + other[:, None] * np.sin(turn)[None, :, None]
    radius = TRAIL_RADIUS_M * np.linspace(0.0, 1.0, len(path)) ** 0.7
    points = path[:, None] + radius[:, None, None] * normals
    here = np.arange((len(path) - 1) * TRAIL_SEGMENTS).reshape(-1, TRAIL_SEGMENTS)
    after = np.roll(here, -1, axis=1)
    next_here, next_after = here + TRAIL_SEGMENTS, after + TRAIL_SEGMENTS
    quads = [np.stack([here, after, next_here], axis=-1), np.stack([after, next_after, next_here], axis=-1)]
    triangles = np.concatenate([quad.reshape(-1, 3) for quad in quads]).astype(np.int32)
    shades = np.full(points.shape[0] * TRAIL_SEGMENTS, shade, dtype=np.uint8)
    return Surface(points.reshape(-1, 3), normals.reshape(-1, 3), triangles, shades)
