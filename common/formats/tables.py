"""Tables of poses, a row per frame: CSV, Apache Parquet with the same columns, and NPZ with arrays.

Parquet and NPZ carry what a column name cannot say - axes, units, joint convention, smoothing, program - as metadata: JSON
under the key `zenocap` of the Parquet schema, and the array `metadata` of the NPZ.  Time is in seconds since frame 0; joint
angles are the model's, the navel's relative to the Y-up world.
"""

import csv
import json
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from math import isnan
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.joint_conventions import TITLES
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.trajectories import DIGITS, axis_directions, convert

LAYOUT = ("axes", "unit", "angle", "joints", "min_confidence", "smoothing", "spine")  # of a request, as metadata
Column = Floats | Ints | tuple[str, ...]


def write_csv(path: Path, request: ExportRequest) -> None:
    """Write a CSV file, units in the headings, blank cells for missing values.  Raises OSError."""
    columns = table_columns(request)
    cells = [_cells(name, values, DIGITS[request.unit]) for name, values in columns.items()]
    with atomic_file(path) as unfinished, unfinished.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*cells, strict=True))


def _cells(name: str, values: Column, digits: int) -> Iterable[str]:
    """Texts of a column.  digits: of positions."""
    if isinstance(values, tuple):
        return values
    if name == "frame":
        return map(str, values)
    if name.startswith(("score.", "confidence.")):
        digits = 4
    elif unit_of(name) not in DIGITS:
        digits = 6
    return ("" if isnan(value) else f"{value:.{digits}f}" for value in values)


def write_parquet(path: Path, request: ExportRequest) -> None:
    """Write the columns of `write_csv` as Parquet; missing values are null.  Raises OSError.

    Needs pyarrow.  Every column has its unit in the metadata of its field too.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = table_columns(request)
    fields = []
    for name, values in columns.items():
        kind = pa.int64() if name == "frame" else pa.string() if isinstance(values, tuple) else pa.float64()
        unit = unit_of(name)
        fields.append(pa.field(name, kind, metadata={"unit": unit} if unit else None))
    schema = pa.schema(fields, metadata={"zenocap": json.dumps(metadata(request))})
    arrays = [
        pa.array(values, field.type, from_pandas=True) for field, values in zip(fields, columns.values(), strict=True)
    ]
    table = pa.Table.from_arrays(arrays, schema=schema)
    with atomic_file(path) as unfinished, unfinished.open("wb") as file:
        pq.write_table(table, file)


def write_npz(path: Path, request: ExportRequest) -> None:
    """Write arrays, compressed, without pickles; missing values are NaN.  Raises OSError.

    frame (n,), time_s (n,), navel_UNIT (n, 3), angles_ANGLE (n, angles) and angle_names, joint_centres_UNIT (n, joints, 3)
    and joint_names, score (n, viewers), view (n, viewers) and viewers, confidence (n, limbs) and limbs, lost (n,) and
    metadata.
    """
    track, centres, count = request.track, request.points(), len(request.track.frames)
    arrays = {
        "frame": track.frames,
        "time_s": track.times_s,
        f"navel_{request.unit}": convert(track.positions, request.axes, request.unit),
        f"angles_{request.angle}": _angles(request),
        "angle_names": np.array(track.anatomy.angles),
        f"joint_centres_{request.unit}": convert(centres.points, request.axes, request.unit),
        "joint_names": np.array(centres.names),
        "viewers": np.array(list(track.views), dtype=np.str_),
        "view": np.array(list(track.views.values()), dtype=np.str_).reshape(len(track.views), count).T,
        "score": np.array([track.scores[v] for v in track.views]).reshape(len(track.views), count).T,
        "limbs": np.array(list(track.limbs), dtype=np.str_),
        "confidence": np.array(list(track.limbs.values())).reshape(len(track.limbs), count).T,
        "lost": np.array(track.lost, dtype=np.str_),
        "metadata": np.array(json.dumps(metadata(request))),
    }
    with atomic_file(path) as unfinished, unfinished.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def table_columns(request: ExportRequest) -> dict[str, Column]:
    """Columns (n,) by name, in order: frame, time, navel, angles, views and scores, joint centres, confidences, lost."""
    track, centres, unit = request.track, request.points(), request.unit
    positions, points = convert(track.positions, request.axes, unit), convert(centres.points, request.axes, unit)
    angles = _angles(request)
    columns: dict[str, Column] = {"frame": track.frames, "time_s": track.times_s}
    columns |= {f"navel.{axis}_{unit}": positions[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"{name}_{request.angle}": angles[:, k] for k, name in enumerate(track.anatomy.angles)}
    for viewer, views in track.views.items():
        columns |= {f"view.{viewer}": views, f"score.{viewer}": track.scores[viewer]}
    for j, name in enumerate(centres.names):
        columns |= {f"{name}.{axis}_{unit}": points[:, j, k] for k, axis in enumerate("xyz")}
    return columns | {f"confidence.{limb}": values for limb, values in track.limbs.items()} | {"lost": track.lost}


def unit_of(column: str) -> str:
    """Unit at the end of a column's name, "" if it has none."""
    ending = column.rpartition("_")[2]
    return ending if ending in ("m", "cm", "mm", "deg", "rad", "s") else ""


def metadata(request: ExportRequest) -> Mapping[str, object]:
    """Axes, units, convention and smoothing of the columns, for JSON."""
    return (
        {name: getattr(request, name) for name in LAYOUT}
        | {
            "program": f"zenocap {version('zenocap')}",
            "body": request.track.anatomy.name,
            "joint_convention": TITLES[request.joints],
            "axis_directions": dict(zip("xyz", axis_directions(request.axes), strict=True)),
            "handedness": "left" if request.axes in ("unity", "unreal") else "right",
            "rate_hz": request.track.rate,
        }
        | ({} if request.measured else {"body_sizes": request.sizes})
    )


def _angles(request: ExportRequest) -> Floats:
    return np.degrees(request.track.angles) if request.angle == "deg" else request.track.angles
