"""Tilt, roll and height of one camera, and the floor path of a person of known height.

With the vertical u of the world in the camera's frame, every ray has an elevation e above the horizon.  A person of
height h who stands at distance d from a camera at height c has the head at tan e1 = (h - c) / d and the feet at
tan e0 = -c / d, so

    d = h / (tan e1 - tan e0),   c = -d tan e0,

and c is equal at all instants for the right u only.  [Lv, Zhao and Nevatia 2006, Camera calibration from video of a walking
human, have the same from vanishing points.]
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import medfilt

from zenocap.common.arrays import Floats
from zenocap.tools.setup.calibration.silhouettes import Hulls
from zenocap.tools.setup.calibration.walk.parameters import HEIGHT_NOISE_M, ROLL_DEG, SMOOTHING, TILTS_DEG

Track: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]  # (n,) x + z i, m, NaN where unknown


@dataclass(frozen=True)
class Elevations:
    """Of n instants.  top, bottom: (n,) tangents of elevation, NaN where the person is cut there.

    ahead: (n, 2) horizontal direction of the person, unit vectors to the camera's right and back.  head: (n, 3) ray of the
    top, camera's frame.
    """

    top: Floats
    bottom: Floats
    ahead: Floats
    head: Floats


@dataclass(frozen=True)
class SingleView:
    """A camera over the floor below it.  rotation: (3, 3) from X right, Y up, Z back to the camera.  height_m.

    track: (n,) the person's place x + z i in this frame, m, NaN where unknown.
    """

    rotation: Floats
    height_m: float
    track: Track


def up_of(tilt: float, roll: float) -> Floats:
    """The vertical (3,) in the frame of a camera that looks up by `tilt`, rolled by `roll`, rad."""
    across = np.cos(tilt)
    return np.array([across * np.sin(roll), -across * np.cos(roll), np.sin(tilt)])


def level_frame(up: Floats) -> Floats:
    """Rotation (3, 3) from the frame X right, Y up, Z back of a camera to the camera's, given the vertical."""
    back = np.array([0.0, 0.0, -1.0])
    z = back - up * (up @ back)
    z /= np.linalg.norm(z)
    return np.stack([np.cross(up, z), up, z], axis=1)


def elevations(hulls: Hulls, up: Floats) -> Elevations:
    """Elevations of head and feet for a vertical (3,) in the camera's frame."""
    level = hulls.local @ level_frame(up)
    across = np.hypot(level[..., 0], level[..., 2])
    tangents = level[..., 1] / across
    known = np.isfinite(tangents)
    rows = np.arange(len(tangents))
    high, low = np.where(known, tangents, -np.inf).argmax(axis=1), np.where(known, tangents, np.inf).argmin(axis=1)
    sides = level[..., [0, 2]] / across[..., None]
    with np.errstate(invalid="ignore"):
        angles = np.arctan2(sides[..., 0], -sides[..., 1])  # to the right of straight ahead
    left, right = np.where(known, angles, np.inf).min(axis=1), np.where(known, angles, -np.inf).max(axis=1)
    middle = 0.5 * np.add(left, right, out=np.zeros(len(left)), where=known.any(axis=1))
    whole = ~hulls.cut[rows, high] & ~hulls.cut[rows, low] & known.any(axis=1)
    return Elevations(
        np.where(whole, tangents[rows, high], np.nan),
        np.where(whole, tangents[rows, low], np.nan),
        np.column_stack([np.sin(middle), -np.cos(middle)]),
        np.where(whole[:, None], hulls.local[rows, high], np.nan),
    )


def single_view(hulls: Hulls, height_m: float) -> SingleView | None:
    """Attitude, height and track of one camera; None where it sees too little.  height_m: of the head in a walk."""

    def off(values: Floats) -> Floats:
        seen = elevations(hulls, up_of(values[0], values[1]))
        heights = -height_m * seen.bottom / (seen.top - seen.bottom)
        apart = (heights - values[2]) / HEIGHT_NOISE_M
        return np.append(np.where(np.isfinite(apart), apart, 0.0), values[1] / np.radians(ROLL_DEG))

    best = None
    for tilt in np.radians(TILTS_DEG):
        seen = elevations(hulls, up_of(tilt, 0.0))
        heights = -height_m * seen.bottom / (seen.top - seen.bottom)
        if not np.isfinite(heights).any():
            return None
        start = np.array([tilt, 0.0, float(np.nanmedian(heights))])
        cost = float(np.log1p(off(start) ** 2).sum())
        if best is None or cost < best[0]:
            best = cost, start
    assert best is not None
    found = least_squares(off, best[1], loss="soft_l1", x_scale=[0.1, 0.1, 0.3])
    up = up_of(found.x[0], found.x[1])
    return SingleView(level_frame(up), float(found.x[2]), smooth(track_of(hulls, up, height_m), SMOOTHING))


def track_of(hulls: Hulls, up: Floats, height_m: float) -> Track:
    """Places (n,) x + z i of the person in the level frame of a camera with the vertical (3,), m; NaN where unknown."""
    seen = elevations(hulls, up)
    span = seen.top - seen.bottom
    away = np.where(span > 0, height_m / span, np.nan)
    track: Track = away * (seen.ahead[:, 0] + 1j * seen.ahead[:, 1])
    return track


def smooth(track: Track, window: int) -> Track:
    """Running median over an odd number of instants; NaN stays."""
    known = np.flatnonzero(np.isfinite(track))
    found = np.full(len(track), np.nan + 0j)
    if len(known) >= window:
        found[known] = medfilt(track[known].real, window) + 1j * medfilt(track[known].imag, window)
        found[known[0]], found[known[-1]] = track[known[0]], track[known[-1]]
    return found
