"""Corner files: the corners of a board in the film of one camera.  Every field is checked on reading.

See `zenocap.common.formats.model_files` for the header.  Arrays are little-endian: times and pixels float64, so that a
calibration from a corner file is that from the film, bit for bit.
"""

from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct

from zenocap.common.arrays import Floats, Ints
from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import reading
from zenocap.common.formats.model_files import ModelFormat, fail
from zenocap.tools.setup.calibration.board import DICTIONARIES, MAX_SPACING, MAX_SQUARE_M, MAX_SQUARES, MIN_SQUARE_M, Board
from zenocap.tools.setup.calibration.board_detection import is_view
from zenocap.tools.setup.calibration.board_views import View
from zenocap.tools.setup.calibration.detection import Detection
from zenocap.tools.setup.calibration.parameters import EDGE_PX, MAX_FRAMES, MAX_VIEWS, MIN_CORNERS

FORMAT = ModelFormat(b"zenocap corners\n", 1, "corner file", "zenocap calibrate detect", "detect the board again")
VARIANT = ("legacy", "inverted", "border")  # fields of a board that are found in the images

RANGES = {  # of numbers, by key
    "board.columns": (2, MAX_SQUARES),
    "board.rows": (2, MAX_SQUARES),
    "board.square_m": (MIN_SQUARE_M, MAX_SQUARE_M),
    "board.marker_m": (0.0, MAX_SQUARE_M),
    "board.spacing": (0.0, MAX_SPACING),
    "size.0": (16, 16384),
    "size.1": (16, 16384),
    "period_s": (1e-3, 1e4),
    "looks": (1, MAX_FRAMES),
}

Text = Annotated[str, Meta(min_length=1, max_length=200)]


class _Board(Struct, forbid_unknown_fields=True):
    """As described by the user."""

    kind: Literal["charuco", "chessboard", "aprilgrid"]
    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: Text
    spacing: float


class _Views(Struct, forbid_unknown_fields=True):
    """times: of the images with the board, (n,) float64 s.  counts: of their corners, (n,) uint16.

    ids: of all corners, uint16.  pixels: (..., 2) float64.
    """

    times: Annotated[bytes, Meta(max_length=8 * MAX_VIEWS)]
    counts: Annotated[bytes, Meta(max_length=2 * MAX_VIEWS)]
    ids: bytes
    pixels: bytes


class _Variant(Struct, forbid_unknown_fields=True):
    """probed: number of corners in the probed images."""

    legacy: bool
    inverted: bool
    border: int
    probed: Annotated[int, Meta(ge=0, le=1 << 32)]
    views: _Views | None


class _CornersFile(Struct, forbid_unknown_fields=True):
    camera: Text
    source: Text
    board: _Board
    size: tuple[int, int]
    period_s: float
    looks: int
    names: Annotated[list[Text], Meta(max_length=MAX_VIEWS)]
    variants: Annotated[list[_Variant], Meta(min_length=1, max_length=4)]


def write_corners(path: Path, detection: Detection, *, new: bool = False) -> None:
    """Write a file atomically, whose folder is created.  new: none is replaced.

    Raises OSError, and UserError for values that it cannot have.
    """
    data = packed(path, detection)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, data, new=new)


def packed(path: Path, detection: Detection) -> bytes:
    """Content of a corner file.  path: for errors.  Raises UserError."""
    variants = [
        {name: getattr(variant, name) for name in VARIANT}
        | {"probed": count, "views": _packed_views(detection.views[k]) if k in detection.views else None}
        for k, (variant, count) in enumerate(zip(detection.board.variants(), detection.counts, strict=True))
    ]
    content = {field.name: getattr(detection, field.name) for field in fields(detection)}
    content |= {
        "board": {name: value for name, value in asdict(detection.board).items() if name not in VARIANT},
        "names": list(detection.names),
        "variants": variants,
    }
    del content["counts"], content["views"]
    data = FORMAT.encoded(path, content, _CornersFile)
    parsed(path, data)
    return data


def _packed_views(views: tuple[View, ...]) -> dict[str, bytes]:
    return {
        "times": np.array([view.time_s for view in views], dtype="<f8").tobytes(),
        "counts": np.array([len(view.ids) for view in views], dtype="<u2").tobytes(),
        "ids": np.concatenate([view.ids for view in views]).astype("<u2").tobytes(),
        "pixels": np.concatenate([view.pixels for view in views]).astype("<f8").tobytes(),
    }


def read_corners(path: Path) -> Detection:
    """Read a corner file.  Raises UserError."""
    with reading(path):
        data = FORMAT.read(path)
    return parsed(path, data)


def parsed(path: Path, data: bytes) -> Detection:
    """Parse the content of a corner file.  path: for errors.  Raises UserError."""
    contents = FORMAT.decoded(path, data, _CornersFile)
    _check_values(path, contents)
    board = Board(**msgspec.structs.asdict(contents.board))
    variants = board.variants()
    found = [{name: getattr(one, name) for name in VARIANT} for one in contents.variants]
    allowed = [{name: getattr(one, name) for name in VARIANT} for one in variants]
    if found != allowed:
        fail(path, "variants", found, allowed)
    views = {
        k: _unpacked(path, f"variants[{k}].views", contents, variants[k], one.views)
        for k, one in enumerate(contents.variants)
        if one.views is not None
    }
    if not views:
        fail(path, "variants", "no views", "views of the board")
    return Detection(
        contents.camera, contents.source, board, contents.size, contents.period_s, contents.looks, tuple(contents.names),
        tuple(one.probed for one in contents.variants), views,
    )  # fmt: skip


def _check_values(path: Path, contents: _CornersFile) -> None:
    for key, (least, most) in RANGES.items():
        value: object = contents
        for part in key.split("."):
            value = value[int(part)] if isinstance(value, tuple) else getattr(value, part)
        if not (isinstance(value, int | float) and least <= value <= most):  # also where it is not a number
            fail(path, key, value, f"{least:g} to {most:g}")
    if contents.names and contents.period_s != 1.0:
        fail(path, "period_s", contents.period_s, "1, of pictures")
    if contents.board.dictionary not in DICTIONARIES:
        fail(path, "board.dictionary", repr(contents.board.dictionary), ", ".join(DICTIONARIES))
    names = [("camera", contents.camera), ("source", contents.source), *(("names", one) for one in contents.names)]
    for key, name in names:
        if not name.isprintable() or "/" in name or name.startswith("."):
            fail(path, key, repr(name), "a name without '/', '.' at its beginning and control characters")


def _unpacked(path: Path, key: str, contents: _CornersFile, board: Board, stored: _Views) -> tuple[View, ...]:
    """Views of one variant of the board; every array is checked before its values are used."""
    count = len(stored.times) // 8
    _check_length(path, f"{key}.times", stored.times, 8 * max(1, min(count, contents.looks)))
    _check_length(path, f"{key}.counts", stored.counts, 2 * count)
    counts = np.frombuffer(stored.counts, dtype="<u2").astype(np.int64)
    corners = int(np.prod(board.grid))
    if counts.min() < MIN_CORNERS or counts.max() > corners:
        fail(path, f"{key}.counts", f"{counts.min()} to {counts.max()}", f"{MIN_CORNERS} to {corners}")
    total = int(counts.sum())
    _check_length(path, f"{key}.ids", stored.ids, 2 * total)
    _check_length(path, f"{key}.pixels", stored.pixels, 16 * total)
    times = np.frombuffer(stored.times, dtype="<f8").astype(np.float64)
    _check_times(path, f"{key}.times", contents, times)
    pixels = np.frombuffer(stored.pixels, dtype="<f8").astype(np.float64).reshape(-1, 2)
    inside = (pixels >= -EDGE_PX) & (pixels <= np.array(contents.size) - 1 + EDGE_PX)
    if not inside.all():  # also where they are not finite
        width, height = contents.size
        fail(path, f"{key}.pixels", pixels[~inside.all(axis=1)][0].tolist(), f"in the image of {width} x {height} px")
    views = []
    ends = np.cumsum(counts)
    ids = np.frombuffer(stored.ids, dtype="<u2").astype(np.int64)
    for k, (begin, end) in enumerate(zip(ends - counts, ends, strict=True)):
        view = View(float(times[k]), ids[begin:end], pixels[begin:end], np.full((end - begin, 2), np.nan))
        _check_view(path, f"{key}[{k}]", board, corners, view.ids, view.pixels)
        views.append(view)
    return tuple(views)


def _check_length(path: Path, key: str, data: bytes, size: int) -> None:
    if len(data) != size:
        fail(path, key, f"{len(data)} bytes", f"{size} bytes")


def _check_times(path: Path, key: str, contents: _CornersFile, times: Floats) -> None:
    """Times increase from 0 on; those of pictures are their numbers."""
    last = len(contents.names) - 1 if contents.names else MAX_FRAMES * contents.period_s
    if not (np.isfinite(times).all() and times[0] >= 0.0 and times[-1] <= last and (np.diff(times) > 0.0).all()):
        fail(path, key, f"{times[0]} to {times[-1]}", f"increasing numbers from 0 to {last:g}")
    if contents.names and (times != np.floor(times)).any():
        fail(path, key, times[times != np.floor(times)][0], "numbers of the pictures")


def _check_view(path: Path, key: str, board: Board, corners: int, ids: Ints, pixels: Floats) -> None:
    if ids[-1] >= corners or (np.diff(ids) <= 0).any():
        fail(path, f"{key}.ids", ids.tolist()[:8], f"increasing numbers below {corners}")
    if not is_view(board, (ids, pixels)):
        fail(path, f"{key}.pixels", pixels[0].round(1).tolist(), "corners of a board that is seen from the front")


def check_board(path: Path, found: Board, board: Board) -> None:
    """Raises UserError where the corners of a file are of another board than the one that is calibrated with."""
    for name, value in asdict(board).items():
        if (other := getattr(found, name)) != value and name not in VARIANT:
            fail(path, f"board.{name}", other, f"{value}, as in the options; these are corners of another board ({found})")
