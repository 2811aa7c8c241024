"""Body parts that a model ignores: their columns are 0."""

from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.errors import UserError
from zenocap.services.recognizer.features import NAMES
from zenocap.services.recognizer.motion_rows import ANGLES, HEIGHT, JOINTS, POINTS

Part = Literal["arms", "legs", "head"]
PARTS: tuple[Part, ...] = get_args(Part)
LIMBS: Mapping[Part, tuple[str, ...]] = {
    "arms": ("shoulder", "elbow", "wrist"),
    "legs": ("hip", "knee", "ankle"),
    "head": ("head",),
}


def parts_of(text: str) -> tuple[Part, ...]:
    """Parts by their names, separated by commas.  Raises UserError for another name."""
    found: list[Part] = []
    for name in filter(None, map(str.strip, text.split(","))):
        part = next((one for one in PARTS if one == name), None)
        if part is None:
            raise UserError(f"ignored = {name!r}: allowed: {', '.join(PARTS)}")
        found.append(part)
    return tuple(found)


def columns_of(parts: Sequence[Part]) -> Ints:
    """Columns of `motion_rows` that describe these parts of the body, rising.

    Of the legs also the height of the hips over the ankles.  Trunk, way and heading of the person belong to none.
    """
    limbs = [limb for part in parts for limb in LIMBS[part]]
    angles = [ANGLES.start + k for k, name in enumerate(NAMES) if any(limb in name for limb in limbs)]
    joints = [k for k, name in enumerate(JOINTS) if any(limb in name for limb in limbs)]
    points = [POINTS.start + 3 * k + axis for k in joints for axis in range(3)]
    return np.array([*angles, *points, *([HEIGHT] if "legs" in parts else [])], dtype=np.int64)


def without_parts(rows: Floats, parts: Sequence[Part]) -> Floats:
    """Rows (..., WIDTH, or ten angles) with 0 for these parts; rows that are not finite stay so."""
    if not parts:
        return rows
    columns = columns_of(parts)
    columns = columns[columns < rows.shape[-1]]
    left = rows.copy()
    left[..., columns] = np.where(np.isfinite(rows).all(axis=-1, keepdims=True), 0.0, rows[..., columns])
    return left
