"""Closed tubes of elliptic rings, the elements of the simulated person's surface."""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Ints32


@dataclass(frozen=True)
class Ring:
    """One section of a tube.

    centre: (3,) metres at rest.  half: half extents along the section's first and second axis.
    weights: skinning weights by bone.  bgr: its colour.
    """

    centre: tuple[float, float, float]
    half: tuple[float, float]
    weights: dict[int, float]
    bgr: tuple[float, float, float]


@dataclass(frozen=True)
class Tube:
    """points, normals: (n, 3) metres at rest.  weights: (n, bones).  bgr: (n, 3).  triangles: (m, 3)."""

    points: Floats
    normals: Floats
    weights: Floats
    bgr: Floats
    triangles: Ints32


def tube(rings: list[Ring], bones: int, around: int, axes: str = "xz", power: float = 2.0) -> Tube:
    """Surface through `rings` in order, closed at both ends.

    around: points per ring.  axes: the world axes of a ring's two half extents at rest.
    power: exponent of the superellipse, 2 for an ellipse, larger for a fuller section.
    """
    first, second = ("xyz".index(a) for a in axes)
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    section = np.stack([np.sign(c) * np.abs(c) ** (2.0 / power), np.sign(s) * np.abs(s) ** (2.0 / power)], axis=1)
    count = len(rings)
    points = np.zeros((count * around + 2, 3))
    weights = np.zeros((len(points), bones))
    bgr = np.zeros((len(points), 3))
    for k, ring in enumerate(rings):
        rows = slice(k * around, (k + 1) * around)
        points[rows] = ring.centre
        points[rows, first] += section[:, 0] * ring.half[0]
        points[rows, second] += section[:, 1] * ring.half[1]
        bgr[rows] = ring.bgr
        for bone, weight in ring.weights.items():
            weights[rows, bone] = weight
    for row, k in ((-2, 0), (-1, count - 1)):
        points[row], bgr[row] = rings[k].centre, rings[k].bgr
        weights[row] = weights[k * around]
    triangles = _triangles(count, around)
    return Tube(points, point_normals(points, triangles), weights, bgr, triangles)


def _triangles(count: int, around: int) -> Ints32:
    rows = []
    here = np.arange(around)
    after = (here + 1) % around
    for k in range(count - 1):
        low, high = k * around, (k + 1) * around
        rows.append(np.stack([low + here, low + after, high + here], axis=1))
        rows.append(np.stack([low + after, high + after, high + here], axis=1))
    top, bottom = count * around, count * around + 1
    last = (count - 1) * around
    rows.append(np.stack([np.full(around, top), after, here], axis=1))
    rows.append(np.stack([np.full(around, bottom), last + here, last + after], axis=1))
    return np.concatenate(rows).astype(np.int32)


def point_normals(points: Floats, triangles: Ints32) -> Floats:
    """Outward unit normals (n, 3) of a closed surface, for either orientation of its triangles."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    volume = float(np.einsum("ij,ij->", a - points.mean(axis=0), faces))
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    normals *= 1.0 if volume >= 0.0 else -1.0
    length: Floats = np.linalg.norm(normals, axis=1, keepdims=True)
    scaled: Floats = normals / np.maximum(length, 1e-12)
    return scaled


def merge_meshes(tubes: list[Tube]) -> Tube:
    """Merge several tubes into one surface."""
    starts = np.cumsum([0] + [len(t.points) for t in tubes[:-1]])
    return Tube(
        np.concatenate([t.points for t in tubes]),
        np.concatenate([t.normals for t in tubes]),
        np.concatenate([t.weights for t in tubes]),
        np.concatenate([t.bgr for t in tubes]),
        np.concatenate([t.triangles + start for t, start in zip(tubes, starts, strict=True)]).astype(np.int32),
    )
