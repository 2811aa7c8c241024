"""The room that the silhouettes leave: how far, and which way back, a place of the body is outside of them.

Rays pull the body's surface to the contours, but where no contour asks for it nothing keeps a limb from lying outside of a
silhouette; and a body there is as wrong as a contour that no part explains.  The paper has no such term.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Floats
from common.vision.background import Mask
from services.tracker.closest import Singles
from services.tracker.hull_views import Integers, Silhouettes
from services.tracker.lens import REACH, shifted
from services.tracker.model import Model

SIDE = 96  # px: longest side of a silhouette in its distance map
MARGIN = 24  # px of the map around it; further off the distance to the map's edge is added
ALONG = (0.5, 0.95)  # of every part's axis
DEPTH = 0.1  # m: nothing nearer to a camera is looked at


class Room(NamedTuple):
    """Distance maps of v views.

    maps: all of them, row by row, px of the image.  at: (v,) where each begins.  shape: (v, 2) rows, columns; 0 for a view
    that is absent.  corner: (v, 2) column and row of the image at the map's first pixel.  scale: (v,) image px per map px.
    lens, rotation, centre, size: as in `Silhouettes`.
    """

    maps: Singles
    at: Integers
    shape: Integers
    corner: Floats
    scale: Floats
    lens: Floats
    rotation: Floats
    centre: Floats
    size: Integers


def room_of(seen: Silhouettes) -> Room:
    """The room of silhouettes, dilated as they are there."""
    views = len(seen.lens)
    maps: list[NDArray[np.float32]] = []
    at, shape = np.zeros(views, dtype=np.int64), np.zeros((views, 2), dtype=np.int64)
    corner, scale = np.zeros((views, 2)), np.ones(views)
    length = 0
    for k in range(views):
        left, top, across, down = (int(value) for value in seen.box[k])
        at[k] = length
        if across == 0:
            continue
        crop = seen.pixels[seen.at[k] : seen.at[k] + across * down].reshape(down, across)
        one = _distances(crop)
        scale[k] = max(1.0, max(across, down) / SIDE)
        corner[k] = left - MARGIN * scale[k] + 0.5 * scale[k] - 0.5, top - MARGIN * scale[k] + 0.5 * scale[k] - 0.5
        shape[k] = one.shape
        maps.append((one * scale[k]).reshape(-1))
        length += one.size
    joined = np.concatenate(maps) if maps else np.empty(0, np.float32)
    return Room(joined.astype(np.float32), at, shape, corner, scale, seen.lens, seen.rotation, seen.centre, seen.size)


def no_room() -> Room:
    """Without any view, so that nothing is outside."""
    none, nowhere = np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64)
    lens, centre = np.zeros((0, REACH + 1)), np.zeros((0, 3))
    return Room(
        np.zeros(0, np.float32), none, nowhere, np.zeros((0, 2)), np.zeros(0), lens, np.zeros((0, 3, 3)), centre, nowhere
    )


def _distances(crop: Mask) -> NDArray[np.float32]:
    """(rows, columns) of a reduced silhouette with its margin: px of the map to the nearest one of the silhouette."""
    down, across = crop.shape
    factor = max(1.0, max(across, down) / SIDE)
    if factor > 1.0:
        small = (max(1, round(across / factor)), max(1, round(down / factor)))
        crop = np.asarray(cv2.resize(crop, small, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    free = cv2.copyMakeBorder((crop == 0).astype(np.uint8), MARGIN, MARGIN, MARGIN, MARGIN, cv2.BORDER_CONSTANT, value=1)
    return np.asarray(cv2.distanceTransform(free, cv2.DIST_L2, 5), dtype=np.float32)


@njit(cache=True, error_model="numpy")
def outside_at(room: Room, k: int, x: float, y: float, z: float, found: Floats) -> bool:
    """Whether a place in the world is outside of view k's silhouette.

    Writes found (4,): how far in metres, and the unit direction back (3,) in the world.
    """
    if room.shape[k, 0] == 0:
        return False
    dx, dy, dz = x - room.centre[k, 0], y - room.centre[k, 1], z - room.centre[k, 2]
    r = room.rotation[k]
    cx = r[0, 0] * dx + r[0, 1] * dy + r[0, 2] * dz
    cy = r[1, 0] * dx + r[1, 1] * dy + r[1, 2] * dz
    cz = r[2, 0] * dx + r[2, 1] * dy + r[2, 2] * dz
    if cz < DEPTH:
        return False
    px, py = cx / cz, cy / cz
    bx, by = px, py
    if room.lens[k, REACH] > 0.0:
        bx, by = shifted(room.lens, k, px, py)
    u = room.lens[k, 0] * bx + room.lens[k, 1] * by + room.lens[k, 2]
    v = room.lens[k, 3] * by + room.lens[k, 4]
    if u < 0.0 or v < 0.0 or u > room.size[k, 0] - 1 or v > room.size[k, 1] - 1:
        return False
    rows, columns = room.shape[k, 0], room.shape[k, 1]
    a, b = (u - room.corner[k, 0]) / room.scale[k], (v - room.corner[k, 1]) / room.scale[k]
    ca, cb = min(max(a, 0.0), columns - 1.001), min(max(b, 0.0), rows - 1.001)
    i, j = int(cb), int(ca)
    fb, fa = cb - i, ca - j
    base = room.at[k] + i * columns + j
    m00, m01 = room.maps[base], room.maps[base + 1]
    m10, m11 = room.maps[base + columns], room.maps[base + columns + 1]
    far = (1 - fb) * ((1 - fa) * m00 + fa * m01) + fb * ((1 - fa) * m10 + fa * m11)
    if far <= 0.0:
        return False
    gu = (1 - fb) * (m01 - m00) + fb * (m11 - m10)
    gv = (1 - fa) * (m10 - m00) + fa * (m11 - m01)
    norm = np.sqrt(gu * gu + gv * gv)
    if norm < 1e-9:
        return False
    # Off the map: to the map's edge, and from there on by its distance; the way back is along both together.
    gu, gv = far * gu / norm + (a - ca) * room.scale[k], far * gv / norm + (b - cb) * room.scale[k]
    far = np.sqrt(gu * gu + gv * gv)
    gu, gv = gu / far, gv / far
    found[0] = far * cz / room.lens[k, 0]
    wz = -(gu * px + gv * py)  # along the ray nothing changes
    length = np.sqrt(gu * gu + gv * gv + wz * wz)
    for row in range(3):
        found[1 + row] = -(r[0, row] * gu + r[1, row] * gv + r[2, row] * wz) / length
    return True


@njit(cache=True, error_model="numpy")
def outside(model: Model, frames: Floats, room: Room, limit: float) -> float:
    """Mean square over the body and the views of how far it is outside, each truncated at `limit` metres; m^2."""
    found = np.empty(4)
    total, count = 0.0, 0
    for part in range(frames.shape[0]):
        for n in range(len(ALONG)):
            x, y, z = place_on(model, frames[part], part, ALONG[n])
            for k in range(room.at.shape[0]):
                count += 1
                if outside_at(room, k, x, y, z, found):
                    total += min(found[0], limit) ** 2
    return float(total / max(count, 1))


@njit(cache=True, error_model="numpy")
def place_on(model: Model, f: Floats, part: int, share: float) -> tuple[float, float, float]:
    """A place on a part's axis, in the world."""
    b0, b1, b2 = model.bases[part, 0], model.bases[part, 1] + share * model.lengths[part], model.bases[part, 2]
    return (
        f[0, 3] + f[0, 0] * b0 + f[0, 1] * b1 + f[0, 2] * b2,
        f[1, 3] + f[1, 0] * b0 + f[1, 1] * b1 + f[1, 2] * b2,
        f[2, 3] + f[2, 0] * b0 + f[2, 1] * b1 + f[2, 2] * b2,
    )
