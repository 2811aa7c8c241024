"""Widths of edges: of the room for the focus, of the moving person for motion blur."""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Bools, Floats, Floats32, Image, Ints, Mask
from zenocap.services.viewer import parameters as p

GREEN = 1  # channel that stands for the brightness
LEAST_REACH = 6  # px
STILL_PX = 1.0  # per frame, from which an edge counts as moving a little
SHARP_PX = 2.0  # width of a sharp edge, where none stands still


@dataclass(frozen=True)
class EdgeOutline:
    """Edges of a person in some rows.  rows: (n,).  sides: (2, n) first and last column of the silhouette, -1 for none.

    widths: (2, n) px, NaN where the contrast is too low.  height: of the person, px.
    """

    rows: Ints
    sides: Ints
    widths: Floats
    height: float


@dataclass(frozen=True)
class Blur:
    """Edges of one image.  moved: (m,) px since the frame before.  widths: (m,) px.  height: of the person, px."""

    moved: Floats
    widths: Floats
    height: float


def widths_of(profiles: Floats) -> Floats:
    """(n,) widths in px of edges in the middle of profiles (n, 2 k + 1): difference of the ends over the steepest slope.

    NaN where the ends differ by less than EDGE_LEVELS.
    """
    ends = max(2, profiles.shape[1] // 4)
    across = np.abs(profiles[:, -ends:].mean(axis=1) - profiles[:, :ends].mean(axis=1))
    slope = np.abs(np.diff(profiles, axis=1)).max(axis=1)
    widths: Floats = np.where(across >= p.EDGE_LEVELS, across / np.maximum(slope, 1e-6), np.nan)
    return widths


def room_edge_px(room: Floats32) -> float | None:
    """Width in px of the sharpest vertical edges of a room (height, width, 3) without noise; None without any."""
    height, width = room.shape[:2]
    rows = np.asarray(room[:: max(1, height // p.ADVICE_ROWS), :, GREEN], dtype=np.float64)
    reach = max(LEAST_REACH, height // p.EDGE_REACH_ROWS)
    steps = np.abs(np.diff(rows, axis=1))
    inner = steps[:, reach : width - reach - 1]
    if inner.shape[1] == 0:
        return None
    at = np.argmax(inner, axis=1) + reach
    columns = at[:, None] + np.arange(-reach, reach + 1)
    widths = widths_of(np.take_along_axis(rows, columns, axis=1))
    known = widths[np.isfinite(widths)]
    return float(np.quantile(known, p.SHARPEST)) if len(known) else None


def outline_of(image: Image, room: Floats32, gain: float, mask: Mask, top: int, bottom: int) -> EdgeOutline:
    """Edges of a silhouette (height, width) of rows `top` to `bottom`; gain: of the green of the image over the room."""
    rows = np.unique(np.linspace(top, bottom, p.ADVICE_ROWS).astype(np.int64))
    sides = _sides(mask, rows)
    reach = max(LEAST_REACH, (bottom - top) // p.EDGE_REACH_ROWS)
    widths = np.full(sides.shape, np.nan)
    steps = np.arange(-reach, reach + 1)
    for side in (0, 1):
        columns = sides[side]
        inside = (columns >= reach) & (columns < mask.shape[1] - reach)
        place = rows[inside, None], columns[inside, None] + steps
        profiles = image[(*place, GREEN)].astype(np.float64) - gain * room[(*place, GREEN)]
        widths[side, inside] = widths_of(profiles)
    return EdgeOutline(rows, sides, widths, float(bottom - top + 1))


def _sides(mask: Mask, rows: Ints) -> Ints:
    lines = mask[rows] != 0
    some: Bools = lines.any(axis=1)
    first = np.argmax(lines, axis=1)
    last = mask.shape[1] - 1 - np.argmax(lines[:, ::-1], axis=1)
    return np.asarray(np.where(some, np.stack([first, last]), -1), dtype=np.int64)


def moved_since(outline: EdgeOutline, mask: Mask) -> Blur:
    """The edges of an image with how far they have moved in the next one, whose silhouette is `mask`."""
    sides = _sides(mask, outline.rows)
    moved = np.abs(sides - outline.sides).astype(np.float64)
    known = (sides >= 0) & (outline.sides >= 0) & np.isfinite(outline.widths) & (moved < p.JUMP_SHARE * outline.height)
    return Blur(moved[known], outline.widths[known], outline.height)


def blur_percent(found: list[Blur]) -> float | None:
    """Length of the motion blur of what moves fast, % of the person's height; None where too little moves."""
    if not found:
        return None
    moved = np.concatenate([one.moved / one.height for one in found])
    pixels = np.concatenate([one.moved for one in found])
    widths = np.concatenate([one.widths for one in found])
    moving = (moved >= p.MOVING_SHARE) & (pixels > 2.0 * STILL_PX)
    if np.count_nonzero(moving) < p.MOVING_ROWS:
        return None
    still = widths[pixels <= STILL_PX]
    sharp = float(np.median(still)) if len(still) >= p.MOVING_ROWS else SHARP_PX
    exposed = max(0.0, float(np.median((widths[moving] - sharp) / pixels[moving])))  # share of the frame period
    return 100.0 * exposed * float(np.quantile(moved[moving], 0.9))
