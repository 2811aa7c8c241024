"""TRC files (OpenSim, Pose2Sim): joint centres by name, one row per frame, tab separated."""

from pathlib import Path

import numpy as np

from zenocap.common.atomic_write import atomic_file
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.text_file import MAX_BYTES
from zenocap.common.formats.trajectories import DIGITS, Axes, Trajectories, Unit, convert

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
HEADER = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
MAX_NUMBERS = 50_000_000  # of a table in memory, 400 MB: two hours of 23 markers at 100 Hz; chosen by hand


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
    """Read a TRC file in any of METRES' units; points are returned in metres.  Raises UserError."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UserError(f"{path}: more than {MAX_BYTES >> 20} MiB: allowed: shorter TRC files")
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not a TRC file: {error}") from error
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise UserError(f"{path}: line 1: allowed: PathFileType, then four more lines of a TRC file's header")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    unit = header.get("Units", "").strip().lower()
    if unit not in METRES:
        raise UserError(f"{path}: line 3: Units = {unit!r}: allowed: {', '.join(METRES)}")
    names = tuple(name.strip() for name in lines[3].split("\t")[2:] if name.strip())
    if not names or len(set(names)) != len(names):
        raise UserError(f"{path}: line 4: allowed: Frame#, Time and different names of markers")
    if (numbers := 3 * len(names) * (len(lines) - 5)) > MAX_NUMBERS:  # short rows are filled up
        allowed = f"{MAX_NUMBERS} coordinates"
        raise UserError(f"{path}: {len(names)} markers in {len(lines) - 5} rows, {numbers} coordinates: allowed: {allowed}")
    rows: dict[int, tuple[float, list[float]]] = {}
    for number, line in enumerate(lines[5:], start=6):
        cells = line.split("\t")
        if not cells[0].strip():
            continue
        try:
            values = [_number(cell) for cell in cells[2 : 2 + 3 * len(names)]]
            rows[int(float(cells[0]))] = (_number(cells[1]), values + [np.nan] * (3 * len(names) - len(values)))
        except (ValueError, IndexError, OverflowError):
            raise UserError(f"{path}: line {number}: {line[:40]!r}: allowed: numbers between tabs") from None
    frames = sorted(rows)
    points = np.array([rows[frame][1] for frame in frames]).reshape(len(frames), len(names), 3) * METRES[unit]
    times_s = np.array([rows[frame][0] for frame in frames])
    try:
        rate = float(header.get("DataRate", ""))
    except ValueError:
        raise UserError(f"{path}: line 3: DataRate = {header.get('DataRate')!r}: allowed: a number") from None
    return Trajectories(names, np.array(frames, dtype=np.int64), times_s, points, rate)


def _number(cell: str) -> float:
    text = cell.strip()
    return float(text) if text else np.nan


def export(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    write_trc(path, request.points(), axes=request.axes, unit=request.unit)
