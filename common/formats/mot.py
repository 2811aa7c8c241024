"""Motion files of OpenSim (.mot): generalized coordinates by name, one row per time, tab separated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import atomic_file
from zenocap.common.errors import UserError
from zenocap.common.formats.file_warnings import warn_of_file
from zenocap.common.formats.text_file import read_text

END_OF_HEADER = "endheader"
DEGREES = {"yes": True, "no": False}
DIGITS = 8  # decimals written, as OpenSim


@dataclass(frozen=True)
class Mot:
    """times_s: (n,) seconds, rising.  columns: by coordinate, (n,) in the file's units: rotations in degrees or radians.

    rate: rows per second, from the median interval; 0 for one row.
    """

    times_s: Floats
    columns: Mapping[str, Floats]
    in_degrees: bool
    rate: float


def write_mot(path: Path, times_s: Floats, columns: Mapping[str, Floats], notes: Sequence[str] = ()) -> None:
    """Write coordinates.  times_s: (n,) seconds.  columns: (n,) degrees and metres.  notes: lines of the header.

    Raises OSError.
    """
    lines = ["Coordinates", "version=1", f"nRows={len(times_s)}", f"nColumns={len(columns) + 1}", "inDegrees=yes", ""]
    lines += ["Units are S.I. units (second, meters, Newtons, ...)", "Angles are in degrees.", "", *notes, END_OF_HEADER]
    with atomic_file(path) as unfinished, unfinished.open("w", encoding="ascii", newline="\n") as file:
        file.write("\n".join([*lines, "\t".join(["time", *columns])]) + "\n")
        for row in np.stack([times_s, *columns.values()], axis=1):
            file.write("\t".join(f"{value + 0.0:.{DIGITS}f}" for value in row) + "\n")


def read_mot(path: Path) -> Mot:
    """Read a .mot file with coordinates; rows of zeros are missing.  Raises UserError."""
    lines = read_text(path, "a .mot file").splitlines()
    words = [line.strip().lower() for line in lines]
    if END_OF_HEADER not in words:
        raise UserError(f"{path}: no line {END_OF_HEADER!r}: allowed: a .mot file of OpenSim with its header")
    end = words.index(END_OF_HEADER)
    header = {key.strip(): value.strip() for key, _, value in (word.partition("=") for word in words[:end])}
    given = header.get("indegrees", "")
    if given not in DEGREES:
        raise UserError(f"{path}: header: inDegrees = {given!r}: allowed: {' or '.join(DEGREES)}")
    numbered = [(k, line) for k, line in enumerate(lines[end + 1 :], start=end + 2) if line.strip()]
    names = tuple(name.strip() for name in numbered[0][1].strip().split("\t")) if numbered else ()
    if len(names) < 2 or names[0].lower() != "time" or len(set(names)) != len(names):
        where = f"line {numbered[0][0]}" if numbered else "the end"
        raise UserError(f"{path}: {where}: allowed: time and different names of coordinates, between tabs")
    values = np.array([_row(path, number, line, names) for number, line in numbered[1:]]).reshape(-1, len(names))
    for key, found in (("nrows", len(values)), ("ncolumns", len(names))):
        if header.get(key, str(found)) != str(found):
            raise UserError(f"{path}: header: {key} = {header[key]}, but there are {found}: allowed: as many")
    if not len(values):
        raise UserError(f"{path}: no rows: allowed: one or more after the names of the columns")
    steps = np.diff(values[:, 0])
    if (steps <= 0).any():
        number, _ = numbered[2 + int(np.argmax(steps <= 0))]
        raise UserError(f"{path}: line {number}: time does not rise: allowed: a later time than in the row before")
    zero = (values[:, 1:] == 0.0).all(axis=1)
    if "pelvis_ty" in names and 0 < (count := int(np.count_nonzero(zero))) < len(values):
        warn_of_file(path, f"{count} rows are 0 in all columns: taken as missing")
        values = values[~zero]
    steps = np.diff(values[:, 0])
    rate = round(1.0 / float(np.median(steps)), 3) if len(steps) else 0.0
    columns = {name: values[:, k] for k, name in enumerate(names) if k}
    return Mot(values[:, 0], columns, DEGREES[given], rate)


def _row(path: Path, number: int, line: str, names: tuple[str, ...]) -> list[float]:
    cells = line.strip().split("\t")
    if len(cells) != len(names):
        raise UserError(f"{path}: line {number}: {len(cells)} cells: allowed: {len(names)}, one for each column")
    row = []
    for name, cell in zip(names, cells, strict=True):
        try:
            value = float(cell)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise UserError(f"{path}: line {number}: {name} = {cell.strip()!r}: allowed: a finite number")
        row.append(value)
    return row
