"""A few viewing lines of each view, and how many of them have support; also with one view's silhouette out of its time."""

from typing import NamedTuple

import numpy as np

from services.tracker.hull_contours import Contours
from services.tracker.hull_support import SUPPORTED, support
from services.tracker.hull_views import Floats, Integers, Silhouettes, viewing_lines
from services.tracker.lens import MATRIX

LAGS = 5  # frames either way
MARGIN = 0.15  # of an image's width and height, inside which a person is wholly or nearly in it

Moment = tuple[Contours, Silhouettes]  # as `hull.outlines` gives it


class Lines(NamedTuple):
    """view: (n,) whose.  directions: (n, 3) unit, in the world."""

    view: Integers
    directions: Floats


def lines_of(moment: Moment, each: int, check: int) -> Lines:
    """About `each` lines of every view, evenly along its contours; others at every check."""
    contours, seen = moment
    counts = np.bincount(contours.view, minlength=len(seen.lens))
    starts = np.cumsum(counts) - counts  # a view's points follow one another
    picked = []
    for start, count in zip(starts.tolist(), counts.tolist(), strict=True):
        apart = max(1, count // each)
        picked.append(np.arange(start + check % apart, start + count, apart))
    index = np.concatenate(picked)
    directions, _ = viewing_lines(contours.view[index], contours.points[index], contours.tangents[index], seen)
    return Lines(contours.view[index], directions)


def lagged_shares(recent: tuple[Moment, ...], view: int, each: int, check: int) -> Floats:
    """(2 * LAGS + 1,) share of all lines without support when what `view` shows now is paired with what the others showed
    `lag` frames before, lag = -LAGS ... LAGS; a view that is late has its least at a positive lag.

    recent: LAGS + 1 moments, the newest last.  NaN where a moment is without lines.
    """
    lines = [lines_of(moment, each, check) for moment in recent]
    shares = np.full(2 * LAGS + 1, np.nan)
    for k, lag in enumerate(range(-LAGS, LAGS + 1)):
        mine, others = LAGS - max(-lag, 0), LAGS - max(lag, 0)
        seen = mixed(recent[others][1], recent[mine][1], view)
        theirs, own = lines[others].view != view, lines[mine].view == view
        views = np.concatenate([lines[others].view[theirs], lines[mine].view[own]])
        directions = np.concatenate([lines[others].directions[theirs], lines[mine].directions[own]])
        if len(views) > 0:
            shares[k] = np.mean(support(views, directions, seen) != SUPPORTED)
    return shares


def in_sight(seen: Silhouettes) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(v,) whether the place where the viewing lines through the silhouettes' middles meet is well inside an image; False
    where fewer than two views see anybody."""
    views = np.flatnonzero(seen.box[:, 2])
    if len(views) < 2:
        return np.zeros(len(seen.box), dtype=np.bool_)
    middles = seen.box[views, :2] + 0.5 * seen.box[views, 2:]
    directions, _ = viewing_lines(views, middles, np.tile([1.0, 0.0], (len(views), 1)), seen)
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    where = np.linalg.lstsq(across.sum(axis=0), np.einsum("nij,nj->i", across, seen.centre[views]), rcond=None)[0]
    local = np.einsum("vij,vj->vi", seen.rotation, where - seen.centre)
    fx, skew, cx, fy, cy = seen.lens[:, :MATRIX].T
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
        u, v = (fx * x + skew * y + cx) / seen.size[:, 0], (fy * y + cy) / seen.size[:, 1]
        inside = (np.abs(u - 0.5) < 0.5 - MARGIN) & (np.abs(v - 0.5) < 0.5 - MARGIN)
    found: np.ndarray[tuple[int], np.dtype[np.bool_]] = inside & (local[:, 2] > 0)
    return found


def mixed(seen: Silhouettes, other: Silhouettes, view: int) -> Silhouettes:
    """`seen`, but one view as it is in `other`."""
    if seen is other:
        return seen
    box, at, bounds, whole = seen.box.copy(), seen.at.copy(), seen.bounds.copy(), seen.whole.copy()
    box[view], bounds[view], whole[view] = other.box[view], other.bounds[view], other.whole[view]
    at[view] = len(seen.pixels)
    start = int(other.at[view])
    pixels = np.concatenate([seen.pixels, other.pixels[start : start + int(box[view, 2] * box[view, 3])]])
    return seen._replace(box=box, at=at, bounds=bounds, whole=whole, pixels=pixels)
