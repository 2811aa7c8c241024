"""A body drawn as text for terminals: bones in braille dots, seen from the front and from the right."""

from collections.abc import Mapping

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.formats.trajectories import Trajectories

BONES = (
    ("Head", "Neck"), ("Neck", "Hip"), ("RShoulder", "LShoulder"), ("RHip", "LHip"),
    ("RShoulder", "RElbow"), ("RElbow", "RWrist"), ("LShoulder", "LElbow"), ("LElbow", "LWrist"),
    ("RHip", "RKnee"), ("RKnee", "RAnkle"), ("LHip", "LKnee"), ("LKnee", "LAnkle"),
)  # fmt: skip
COLUMNS, ROWS = 22, 12  # characters of one view
DOTS = (2, 4)  # of a character, across and down
BRAILLE = 0x2800
BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
HEIGHT, BELOW = 2.15, 0.05  # metres, height of a view, and the part of it below the floor
SOLE_M = 0.08  # below an ankle


def pictures(data: Trajectories, start_s: float, end_s: float, per_s: float) -> list[str]:
    """Text pictures from `start_s` to `end_s`, `per_s` per second, seen relative to the first heading of the body."""
    rows = np.flatnonzero((data.times_s >= start_s) & (data.times_s <= end_s))
    some: Bools = np.asarray(np.isfinite(data.points[rows]).all(axis=2))
    rows = rows[some.any(axis=1)]
    if not len(rows):
        return []
    wanted = np.arange(data.times_s[rows[0]], data.times_s[rows[-1]] + 1e-9, 1.0 / per_s)
    chosen = rows[np.clip(np.searchsorted(data.times_s[rows], wanted), 0, len(rows) - 1)]
    first = _instant(data, int(rows[0]))
    turn = facing(first)
    ankles = [data.names.index(name) for name in ("RAnkle", "LAnkle")]
    floor = float(np.nanmin(data.points[rows][:, ankles, 1])) - SOLE_M
    made = []
    for row in chosen:
        now = _instant(data, int(row))
        origin = np.array([now["Hip"][0], floor, now["Hip"][2]])
        lines = figure(now, turn, origin)
        made.append("\n".join([captions(), *lines, f"{data.times_s[row] - start_s:6.2f} s of {end_s - start_s:.2f} s"]))
    return made


def _instant(data: Trajectories, row: int) -> dict[str, Floats]:
    return dict(zip(data.names, data.points[row], strict=True))


def facing(centres: Mapping[str, Floats]) -> Floats:
    """(3, 3) rotation about Y from the world to the frame in which the body faces +Z; centres: (3,) metres."""
    across = centres["LHip"] - centres["RHip"] + centres["LShoulder"] - centres["RShoulder"]
    x = np.array([across[0], 0.0, across[2]])
    length = float(np.linalg.norm(x))
    if not length > 1e-9:
        return np.eye(3)
    x /= length
    return np.array([x, [0.0, 1.0, 0.0], [-x[2], 0.0, x[0]]])


def figure(centres: Mapping[str, Floats], turn: Floats, origin: Floats) -> list[str]:
    """Lines of text: the body seen from the front and, beside it, from its right.

    centres: by name (3,) metres in the world, Y up, NaN or left out where unknown.  turn: see `facing`.
    origin: (3,) place on the floor that is drawn in the middle.
    """
    local = {name: turn @ (point - origin) for name, point in centres.items()}
    # From the front its left is on the right; from its right side its front is on the right.
    views = [_drawn(local, across=0), _drawn(local, across=2)]
    return ["   ".join(lines) for lines in zip(*views, strict=True)]


def captions() -> str:
    return f"{'from the front':^{COLUMNS}}   {'from the right':^{COLUMNS}}"


def _drawn(centres: Mapping[str, Floats], across: int) -> list[str]:
    """Draw one view.  across: the coordinate that is drawn from left to right."""
    wide, high = COLUMNS * DOTS[0], ROWS * DOTS[1]
    scale = high / HEIGHT
    dots = np.zeros((high, wide), dtype=bool)
    for one, other in BONES:
        if one not in centres or other not in centres:
            continue
        ends = np.array([centres[one], centres[other]])[:, [across, 1]]
        if np.isfinite(ends).all():
            _line(dots, wide / 2 + scale * ends[:, 0], high - scale * (ends[:, 1] + BELOW))
    cells = dots.reshape(ROWS, DOTS[1], COLUMNS, DOTS[0]).transpose(0, 2, 1, 3)
    codes = (cells * BITS).sum(axis=(2, 3))
    return ["".join(chr(BRAILLE + int(code)) for code in row) for row in codes]


def _line(dots: Bools, x: Floats, y: Floats) -> None:
    steps = int(max(abs(x[1] - x[0]), abs(y[1] - y[0]))) + 2
    columns = np.floor(np.linspace(x[0], x[1], steps)).astype(int)
    rows = np.floor(np.linspace(y[0], y[1], steps)).astype(int)
    inside = (columns >= 0) & (columns < dots.shape[1]) & (rows >= 0) & (rows < dots.shape[0])
    dots[rows[inside], columns[inside]] = True
