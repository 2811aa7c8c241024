"""TRC files (OpenSim, Pose2Sim): joint centres by name, one row per frame, tab separated."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.atomic_write import atomic_file
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.file_warnings import warn_of_file
from zenocap.common.formats.text_file import read_text
from zenocap.common.formats.trajectories import DIGITS, Axes, Trajectories, Unit, convert

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
HEADER = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
MAX_NUMBERS = 50_000_000  # of a table in memory, 400 MB: two hours of 23 markers at 100 Hz; chosen by hand
SAME_RATE = 0.02  # relative difference up to which two rates are equal, such as 29.97 and 30; chosen by hand
APART = 1.5  # rows that either Frame# or Time alone leaves out, from which there is a note; cameras jitter less; by hand
NINES = [10**digits - 1 for digits in range(4, 9)]  # a point of three times one of them, of either sign, is missing too
# Coordinate up to which three are a missing point, as rounded zeros; and metres from which one number three times is.
NOTHING, FAR_M = 1e-6, 1000.0


def write_trc(path: Path, data: Trajectories, *, axes: Axes = "y-up", unit: Unit = "m") -> None:
    """Write one row per frame with its number and time; a missing marker is "nan" three times.  Raises OSError.

    Lines of labels end with a tab, because older versions of Pose2Sim drop the last column; rows do not.  Missing cells
    are not blank: OpenSim and trc-data-reader drop blank cells at the end of a row and then reject the file.
    """
    count, first = len(data.frames), int(data.frames[0]) if len(data.frames) else 0
    rate = f"{data.rate:.6g}"
    values = [rate, rate, count, len(data.names), unit, rate, first, count]
    names = "\t\t\t".join(data.names)
    labels = "\t".join(f"{axis}{k}" for k in range(1, len(data.names) + 1) for axis in "XYZ")
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        HEADER,
        "\t".join(str(value) for value in values),
        f"Frame#\tTime\t{names}\t\t\t",
        f"\t\t{labels}\t",
        "",
    ]
    digits = DIGITS[unit]
    with atomic_file(path) as unfinished, unfinished.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join(lines) + "\n")
        for frame, time_s, row in zip(data.frames, data.times_s, convert(data.points, axes, unit), strict=True):
            cells = [f"{value:.{digits}f}" for value in row.ravel()]
            file.write("\t".join([str(int(frame)), f"{time_s:.6f}", *cells]) + "\n")


def read_trc(path: Path) -> Trajectories:
    """Read a TRC file in any of METRES' units; points are returned in metres.

    A point of three zeros, of infinity, or of three equal numbers of nines or far away, is missing.  Of DataRate and Time,
    and of Frame# and Time, the times decide; a contradiction is a warning.  Raises UserError.
    """
    lines = read_text(path, "a TRC file").splitlines()
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise UserError(f"{path}: line 1: allowed: PathFileType, then four more lines of a TRC file's header")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    unit = header.get("Units", "").strip().lower()
    if unit not in METRES:
        raise UserError(f"{path}: line 3: Units = {unit!r}: allowed: {', '.join(METRES)}")
    names = _names(path, lines)
    if (numbers := 3 * len(names) * (len(lines) - 5)) > MAX_NUMBERS:  # short rows are filled up
        allowed = f"{MAX_NUMBERS} coordinates"
        raise UserError(f"{path}: {len(names)} markers in {len(lines) - 5} rows, {numbers} coordinates: allowed: {allowed}")
    try:
        rate = float(header.get("DataRate", ""))
    except ValueError:
        raise UserError(f"{path}: line 3: DataRate = {header.get('DataRate')!r}: allowed: a number") from None
    rows = np.array(list(_rows(path, lines, len(names)))).reshape(-1, 2 + 3 * len(names))
    for key, count in (("NumMarkers", len(names)), ("NumFrames", len(rows))):
        if (given := header.get(key, "").strip()).isdigit() and int(given) != count:
            warn_of_file(path, f"{key} = {given}, but there are {count}: these are read")
    points = rows[:, 2:].reshape(len(rows), len(names), 3)
    leave_out_missing(path, points, METRES[unit])
    frames, times_s, order, rate = frame_times(path, rows[:, 0].astype(np.int64), rows[:, 1], rate)
    return Trajectories(names, frames, times_s, points[order] * METRES[unit], rate)


def leave_out_missing(path: Path, points: Floats, metres: float) -> None:
    """Make points (n, markers, 3) NaN that stand for missing ones, with a note.  metres: the unit of the file."""
    points[np.isinf(points)] = np.nan
    if zeros := int(np.count_nonzero(missing := (np.abs(points) <= NOTHING).all(axis=2))):
        points[missing] = np.nan
        warn_of_file(path, f"{zeros} points are 0 0 0: taken as missing")
    number = np.abs(points[:, :, 0])
    nines = np.isin(np.trunc(number), NINES) | (number * metres > FAR_M)
    nines &= (points == points[:, :, :1]).all(axis=2)
    if count := int(np.count_nonzero(nines)):
        warn_of_file(path, f"{count} points are three times {points[nines][0, 0]:.10g}: taken as missing")
        points[nines] = np.nan


def _names(path: Path, lines: Sequence[str]) -> tuple[str, ...]:
    """Names of the markers, one for each column of line 5.  Raises UserError: others would get their neighbour's points."""
    names = tuple(name.strip() for name in lines[3].split("\t")[2:] if name.strip())
    if not names or len(set(names)) != len(names):
        twice = next((f"{name} more than once: " for name in names if names.count(name) > 1), "")
        raise UserError(f"{path}: line 4: {twice}allowed: Frame#, Time and different names of markers")
    columns = sum(1 for label in lines[4].split("\t") if label.strip())
    if columns and columns != 3 * len(names):
        raise UserError(
            f"{path}: line 4: {len(names)} names of markers for {columns} columns in line 5: allowed: 3 for each"
        )
    return names


def _rows(path: Path, lines: Sequence[str], markers: int) -> Iterator[list[float]]:
    """Number, time and coordinates of each row.  Raises UserError."""
    for number, line in enumerate(lines[5:], start=6):
        cells = line.rstrip().split("\t")
        if not line.strip():
            continue
        if len(cells) > 2 + 3 * markers:
            allowed = f"up to {2 + 3 * markers}, for the {markers} markers of line 4"
            raise UserError(f"{path}: line {number}: {len(cells)} cells: allowed: {allowed}")
        try:
            values = [_number(cell) for cell in cells[2:]]
            yield [int(float(cells[0])), _number(cells[1]), *values, *[np.nan] * (3 * markers - len(values))]
        except (ValueError, IndexError, OverflowError):
            raise UserError(f"{path}: line {number}: {line[:40]!r}: allowed: numbers between tabs") from None


def frame_times(path: Path, numbers: Ints, times_s: Floats, rate: float) -> tuple[Ints, Floats, Ints, float]:
    """Frame numbers (n,), rising, times (n,), order of the rows (n,) and rate of rows with numbers and times.

    Where both contradict each other the times decide, unless they do not rise.  path: for warnings.  Raises UserError
    where neither rises.
    """
    order = np.arange(len(numbers))
    if not (np.diff(times_s) > 0.0).all():  # also of times that are not numbers
        order = np.argsort(numbers, kind="stable")
        numbers, times_s = numbers[order], times_s[order]
    timed, numbered = bool((np.diff(times_s) > 0.0).all()), bool((np.diff(numbers) > 0).all())
    if not timed and not (numbered and rate > 0.0):
        raise UserError(f"{path}: neither Frame# nor Time rises from row to row: allowed: one of them")
    if not timed:
        warn_of_file(path, f"Time does not rise: taken from Frame# and {rate:g} frames/s")
        return numbers, numbers / rate, order, rate
    if len(times_s) > 1:
        rates = [1.0 / float(np.median(np.diff(times_s)))]  # of the rows, and of the numbers, which may leave some out
        if numbered:
            rates.append(float(numbers[-1] - numbers[0]) / float(times_s[-1] - times_s[0]))
            steps, passed_s = np.diff(numbers), np.diff(times_s)
            if np.abs(steps - passed_s * np.median(steps / passed_s)).max() > APART * np.median(steps):
                warn_of_file(path, "Frame# and Time do not leave out the same rows: the times are used")
        if all(abs(own - rate) > SAME_RATE * own for own in rates):
            warn_of_file(path, f"DataRate = {rate:g}, but Time has {rates[0]:.5g} rows/s: these are used")
            rate = round(rates[0], 3)
    if not numbered:
        warn_of_file(path, "Frame# does not rise: counted from Time")
        numbers = np.round(times_s * rate).astype(np.int64)
        numbers = np.maximum.accumulate(numbers - np.arange(len(numbers))) + np.arange(len(numbers))
    return numbers, times_s, order, rate


def _number(cell: str) -> float:
    text = cell.strip()
    return float(text) if text else np.nan


def export(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    write_trc(path, request.points(), axes=request.axes, unit=request.unit)
