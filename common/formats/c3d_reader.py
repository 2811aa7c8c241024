"""C3D reader: named points in metres, in the file's axes."""

import json
import os
import re
import struct
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from importlib.util import find_spec
from math import prod
from pathlib import Path
from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError, pip_install, reading
from zenocap.common.formats.file_warnings import warn_of_file
from zenocap.common.formats.text_file import MAX_BYTES, read_apart
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import MAX_NUMBERS, SAME_RATE, leave_out_missing

METRES: Mapping[str, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
NOT_POSITIONS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")  # parameters of POINT that list other quantities
# Memory of the process that reads: 21 and 32 B a byte of the file were measured, damaged files took 12 GB; chosen by hand
READING_BYTES, READING_SHARE = 2 << 30, 64
BLOCK = 512  # bytes; a file ends with a whole one, or one more
MAGIC, INTEL = 0x50, 84  # second byte of a C3D file; fourth byte of its parameters, the kind of processor
# Number of the group; number of the group, offset of the next one, type 4 (of four bytes), dimensions, value, and length of
# the description of the parameter.
POINT = re.compile(rb"[\x05\xfb]([\x80-\xff])POINT", re.DOTALL)
FRAMES = re.compile(rb"[\x06\xfa](.)FRAMES..(\x04(?:\0|\x01\x01))(.{4})(.)", re.DOTALL)


def read_c3d(path: Path) -> Trajectories:
    """Read the labelled points of a C3D file, without angles, forces, moments and powers; missing points are NaN.

    Frame k of the file, which counts from 1, is frame k - 1; times are seconds since frame 0.  TRIAL:ACTUAL_START_FIELD is
    the first frame where it agrees with the number of rows, as the header ends at 65535.  More rows than POINT:FRAMES, or
    than 65535, are not read: a warning.  Raises UserError.
    """
    if find_spec("ezc3d") is None:
        raise UserError(f"{path}: .c3d needs ezc3d: {pip_install('export')}")
    size, intel, head = _header(path)
    labels, other, unit, rate, first, trial, long_frames, points, residuals = _content(path)
    count, counted = points.shape[1], int.from_bytes(head[2:4], "little")
    if intel and counted != count:  # each point would have coordinates of others
        raise UserError(f"{path}: POINT:USED = {count}, {counted} points in the header: allowed: equal numbers")
    width = 4 if int.from_bytes(head[14:16], "little") & 0x8000 else 2  # single precision where the scale is negative
    rows = int.from_bytes(head[8:10], "little") - int.from_bytes(head[6:8], "little") + 1  # ezc3d reads what is there
    needed = max(rows, points.shape[2]) * width * (4 * count + int.from_bytes(head[4:6], "little"))
    needed += 512 * (int.from_bytes(head[16:18], "little") - 1)
    if intel and size < needed:
        raise UserError(f"{path}: cut: {size} bytes: allowed: {needed} or more")
    rate = _rate(path, rate, struct.unpack("<f", head[20:24])[0] if intel else 0.0)
    if unit not in METRES:
        raise UserError(f"{path}: POINT:UNITS = {unit!r}: allowed: {', '.join(METRES)}")
    if len(labels) < count or any(labels[count:]):
        warn_of_file(path, f"POINT:LABELS has {len(labels)} names for {count} points: the last ones are left out")
    kept = [k for k, name in enumerate(labels[:count]) if name and not name.startswith("*") and name not in other]
    names = tuple(labels[k] for k in kept)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise UserError(f"{path}: POINT:LABELS: {twice[0]!r} more than once: allowed: different labels")
    if not names:
        raise UserError(f"{path}: POINT:LABELS: no labelled point: allowed: one or more")
    centres = points[:3, kept].transpose(2, 1, 0).copy()
    centres[(residuals[kept] < 0.0).T] = np.nan
    leave_out_missing(path, centres, METRES[unit])
    centres[~np.isfinite(centres).all(axis=2)] = np.nan
    stated = {"its parameters": long_frames}
    if intel and head[8:10] != b"\xff\xff":  # its end
        stated["the header"] = rows % (1 << 16)
    first = _first_frame(path, first, len(centres), trial)
    _warn_of_rows(path, len(centres), first, trial, stated, size - needed if intel else 0)
    frames = np.arange(first, first + len(centres), dtype=np.int64)
    times_s = frames / rate if rate > 0.0 else np.zeros(len(frames))
    return Trajectories(names, frames, times_s, centres * METRES[unit], rate)


def _rate(path: Path, rate: float, header: float) -> float:
    """Frames per second: `rate` of POINT:RATE, or that of the header where it has none; a contradiction is said."""
    if not 0.0 < header < np.inf or abs(header - rate) <= SAME_RATE * header:
        return rate
    used = rate if rate > 0.0 else header
    warn_of_file(path, f"{header:g} frames/s in the header, POINT:RATE = {rate:g}: {used:g} frames/s are used")
    return used


def _header(path: Path) -> tuple[int, bool, bytes]:
    """Size in bytes, whether numbers are those of Intel's processors, and the header, of 512 bytes.

    Raises UserError for what ezc3d would read at length or not at all.
    """
    with reading(path):
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(512)
            file.seek(512 * max(head[0] - 1, 0) if head else 0)
            intel = file.read(4)[3:] == bytes([INTEL])
    if size > MAX_BYTES:
        raise UserError(f"{path}: more than {MAX_BYTES >> 20} MiB: allowed: shorter C3D files")
    if len(head) < 512 or head[1] != MAGIC:
        raise UserError(f"{path}: not a C3D file: byte 2 is {head[1:2].hex() or 'missing'}: allowed: {MAGIC:02x}")
    if intel and int.from_bytes(head[2:4], "little") * 4 > MAX_NUMBERS:
        raise UserError(f"{path}: too many points: allowed: fewer")
    return size, intel, head


class _Content(NamedTuple):
    """labels: of the points, and `other` ones.  trial: first and last frame number of TRIAL.

    long_frames: number of rows of POINT:LONG_FRAMES, or of POINT:FRAMES where that is no whole number.
    points: (4, points, frames).  residuals: (points, frames).
    """

    labels: list[str]
    other: list[str]
    unit: str
    rate: float
    first: int
    trial: Sequence[int | None]
    long_frames: int | None
    points: Floats
    residuals: Floats


def _content(path: Path) -> _Content:
    """What ezc3d reads, in a process of its own, which a damaged file may end by a signal.  Raises UserError."""
    data = read_apart(path, "a C3D file", __name__)
    line = data.index(b"\n") + 1
    shape, labels, other, unit, rate, first, trial, long_frames = json.loads(data[:line])
    numbers, size = np.frombuffer(data, offset=line), prod(shape)
    points, residuals = numbers[:size].reshape(shape), numbers[size:].reshape(shape[1:])
    return _Content(labels, other, unit, rate, first, trial, long_frames, points, residuals)


def main() -> None:
    """Write the content of the file that is named on the command line to the standard output: JSON and two arrays."""
    import ezc3d

    if sys.platform != "win32":  # which has no such limits
        import resource

        most = READING_BYTES + READING_SHARE * os.path.getsize(sys.argv[1])
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # ezc3d writes warnings
        try:
            with ExitStack() as stack:
                readable, frames = with_whole_frames(Path(sys.argv[1]), stack)
                file = ezc3d.c3d(str(readable))
            point, first = file["parameters"]["POINT"], int(file["header"]["points"]["first_frame"])
            points = np.asarray(file["data"]["points"], dtype=np.float64)
            residuals = np.asarray(file["data"]["meta_points"]["residuals"], dtype=np.float64)[0]
            labels = [str(label).strip() for label in _listed(point, "LABELS")]
            other = [str(label).strip() for name in NOT_POSITIONS for label in _listed(point, name)]
            unit = " ".join(str(value) for value in _listed(point, "UNITS")[:1]).strip().lower()
            trial = [_field(file["parameters"].get("TRIAL", {}), f"ACTUAL_{end}_FIELD") for end in ("START", "END")]
            rate = float(point["RATE"]["value"][0])
            long_frames = next((int(value) for value in _numbers(point, "LONG_FRAMES")), frames)
        except (OSError, ValueError, RuntimeError, KeyError, IndexError, TypeError, MemoryError) as error:
            sys.exit(str(error).splitlines()[0] if str(error) else repr(error))
        out.write(f"{json.dumps((points.shape, labels, other, unit, rate, first, trial, long_frames))}\n".encode())
        out.write(points.tobytes())
        out.write(residuals.tobytes())


def with_whole_frames(path: Path, stack: ExitStack) -> tuple[Path, int | None]:
    """The file, or where POINT:FRAMES is no whole number a copy of `stack` in which it is one; and that number, or None.

    Long captures have it so, as more than 65535 have no room in two bytes.  ezc3d takes whole ones alone.
    """
    content = bytearray(np.fromfile(path, np.uint8, BLOCK * 256))  # header and parameters
    end = 512 * max(1, int.from_bytes(content[16:18], "little") - 1)
    group, found = POINT.search(content, 512, end), FRAMES.search(content, 512, end)
    if group is None or found is None or found[1][0] != 256 - group[1][0] or found[4][0] > 0xFD:
        return path, None
    (count,) = struct.unpack("<f", found[3])
    if content[512 * max(content[0] - 1, 0) + 3] != INTEL or not 0.0 <= count < 1 << 31:
        return path, None
    whole = struct.pack("<H", min(int(count), 0xFFFF))
    # Two bytes less: the description begins with two spaces.
    content[found.start(2) : found.end()] = b"\x02" + found[2][1:] + whole + bytes([found[4][0] + 2]) + b"  "
    copy = Path(stack.enter_context(tempfile.TemporaryDirectory())) / path.name
    copy.write_bytes(content + path.read_bytes()[len(content) :])
    return copy, int(count)


def _first_frame(path: Path, header: int, rows: int, trial: Sequence[int | None]) -> int:
    """Index of the first frame.  header: the same as the header has it.  trial: first and last number of the trial."""
    start, end = trial
    if start is None or start - 1 == header or start < 1:
        return header
    if end is not None and end - start + 1 == rows:
        warn_of_file(
            path, f"first frame {header + 1} in the header, TRIAL:ACTUAL_START_FIELD = {start}: the latter is used"
        )
        return start - 1
    warn_of_file(
        path, f"TRIAL:ACTUAL_START_FIELD = {start}, but first frame {header + 1} in the header: the latter is used"
    )
    return header


def _warn_of_rows(
    path: Path, rows: int, first: int, trial: Sequence[int | None], stated: Mapping[str, int | None], more: int
) -> None:
    """Warn of other numbers of rows, `stated` by their places, of another end of the trial, and of `more` bytes."""
    start, end = trial
    texts = [f"{count} in {place}" for place, count in stated.items() if count not in (None, 0, rows)]
    if end and start in (None, first + 1) and end != first + rows:
        texts.append(f"TRIAL:ACTUAL_END_FIELD = {end} of rows from {first + 1} on")
    if more > BLOCK:
        texts.append(f"{more} bytes behind them")
    if texts:
        warn_of_file(path, f"{rows} rows are read, but there are {', '.join(texts)}")


def _field(trial: Mapping[str, Mapping[str, object]], name: str) -> int | None:
    """Frame number of two words of 16 bits, the low one first; None without it."""
    words = _numbers(trial, name)
    return (int(words[0]) & 0xFFFF) + ((int(words[1]) & 0xFFFF) << 16) if len(words) == 2 else None


def _numbers(group: Mapping[str, Mapping[str, object]], name: str) -> list[float]:
    return [float(value) for value in _listed(group, name) if isinstance(value, (int, float, np.number))]


def _listed(point: Mapping[str, Mapping[str, object]], name: str) -> list[object]:
    """Values of a parameter and of its continuations: LABELS, LABELS2, LABELS3, ...; empty without it.

    Numbers are an array, texts a list.
    """
    found: list[object] = []
    number = 1
    while (key := name if number == 1 else f"{name}{number}") in point:
        value = point[key]["value"]
        found += list(value) if isinstance(value, (list, tuple, np.ndarray)) else []
        number += 1
    return found


if __name__ == "__main__":
    main()
