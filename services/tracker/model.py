"""The body as compiled code has it: its tree, its tapered parts, and the range of its coordinates."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Bdp
from common.body.rotation_vectors import rotation_of

Ints = NDArray[np.int64]
WIDEST = 2.0  # rad: no coordinate of a ball joint turns further from the middle of its range


class Model(NamedTuple):
    """One person's body.  d coordinates, p parts.

    parent: (p,) part or -1.  first: (p,) a part's first coordinate or -1.  kind: (p,) 3 ball, 1 hinge, 0 rigid or root.
    axis: (p,) of a hinge, 0 x, 1 y, 2 z.  reference: (p, 3, 3), see `Coordinates`.  offsets: (p, 3) joint in its parent.
    bases: (p, 3) where the axis begins, in the part.  lengths: (p,) of the axis, without the round cap of a free end.
    free: (p,) 1 where nothing hangs on the part, 0 elsewhere.
    radii: (p, 4) long and short radius at the base, then at the far end, metres.
    low, high: (d,) range of the coordinates.  [Hybrid Eq. 41]
    """

    parent: Ints
    first: Ints
    kind: Ints
    axis: Ints
    reference: Floats
    offsets: Floats
    bases: Floats
    lengths: Floats
    free: Floats
    radii: Floats
    low: Floats
    high: Floats


def model_of(anatomy: Anatomy, bdp: Bdp) -> Model:
    """The model of one person."""
    coordinates = coordinates_of(anatomy)
    parts = len(anatomy.parts)
    parent = anatomy.tree[:, 0].copy()
    tips = bdp.sizes[:, 1:] if bdp.tips is None else bdp.tips
    bases = np.zeros((parts, 3)) if bdp.bases is None else bdp.bases
    free = np.array([k not in set(parent.tolist()) for k in range(parts)])
    lengths = bdp.sizes[:, 0] - np.where(free, tips.mean(axis=1), 0.0)
    kind = np.array([len(j.axes) if k and j.axes else 0 for k, j in enumerate(anatomy.joints)], dtype=np.int64)
    low, high = _ranges(anatomy)
    return Model(
        parent=parent,
        first=coordinates.first,
        kind=kind,
        axis=np.maximum(anatomy.tree[:, 2], 0),
        reference=coordinates.reference,
        offsets=np.ascontiguousarray(bdp.offsets, dtype=np.float64),
        bases=np.ascontiguousarray(bases, dtype=np.float64),
        lengths=np.maximum(lengths, 0.01),
        free=free.astype(np.float64),
        radii=np.concatenate([bdp.sizes[:, 1:], tips], axis=1),
        low=low,
        high=high,
    )


def _ranges(anatomy: Anatomy) -> tuple[Floats, Floats]:
    """(d,) lowest and highest coordinates: a hinge's limits; a ball joint's are the same all around."""
    coordinates = coordinates_of(anatomy)
    low, high = np.full(coordinates.dimension, -WIDEST), np.full(coordinates.dimension, WIDEST)
    for k, joint in enumerate(anatomy.joints):
        start = int(coordinates.first[k])
        if start < 0:
            continue
        if len(joint.axes) == 1:
            low[start], high[start] = joint.limits[0]
        elif np.array_equal(coordinates.reference[k], np.eye(3)):
            for axis, (lowest, highest) in zip(joint.axes, joint.limits, strict=True):
                low[start + "xyz".index(axis)], high[start + "xyz".index(axis)] = lowest, highest
    return low, high


@njit(cache=True, error_model="numpy")
def place(model: Model, position: Floats, rotation: Floats, values: Floats, frames: Floats) -> None:
    """Write frames (p, 3, 4), part to world, of a root position (3,), orientation (3, 3) and coordinates (d,)."""
    turn, local = np.empty((3, 3)), np.empty((3, 3))
    for k in range(model.parent.shape[0]):
        up = model.parent[k]
        out = frames[k]
        if up < 0:
            for row in range(3):
                out[row, 3] = position[row]
                for column in range(3):
                    out[row, column] = rotation[row, column]
            continue
        for row in range(3):
            out[row, 3] = frames[up, row, 3]
            for column in range(3):
                out[row, 3] += frames[up, row, column] * model.offsets[k, column]
        kind = model.kind[k]
        if kind == 0:
            for row in range(3):
                for column in range(3):
                    out[row, column] = frames[up, row, column]
            continue
        local_rotation(model, k, values, turn, local)
        for row in range(3):
            for column in range(3):
                total = 0.0
                for inner in range(3):
                    total += frames[up, row, inner] * local[inner, column]
                out[row, column] = total


@njit(cache=True, error_model="numpy")
def local_rotation(model: Model, part: int, values: Floats, turn: Floats, local: Floats) -> None:
    """Write local (3, 3), part to parent, of a moving part; turn: (3, 3) scratch."""
    start = model.first[part]
    if model.kind[part] == 1:
        vector = np.zeros(3)
        vector[model.axis[part]] = values[start]
        rotation_of(vector, local)
        return
    rotation_of(values[start : start + 3], turn)
    for row in range(3):
        for column in range(3):
            total = 0.0
            for inner in range(3):
                total += model.reference[part, row, inner] * turn[inner, column]
            local[row, column] = total
