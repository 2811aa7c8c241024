"""Tables of poses for notebooks: Apache Parquet with the columns of CSV, and NPZ with arrays.

Both carry what a column name cannot say - axes, units, joint convention, smoothing, program - as metadata: JSON under the
key `zenocap` of the Parquet schema, and the array `metadata` of the NPZ.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.joint_conventions import TITLES, Convention
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.trajectories import Angle, Axes, Unit, axis_directions, convert


@dataclass(frozen=True)
class TableLayout:
    """axes, unit: of positions and joint centres.  angle: unit of the joint angles, which are the model's.

    joints: convention of the joint centres; those of a limb below min_confidence are missing.  smoothing: what was done,
    see `smoothing.description`.  spine: with the joints of the spine.
    """

    axes: Axes = "y-up"
    unit: Unit = "m"
    angle: Angle = "deg"
    joints: Convention = "zenocap"
    min_confidence: float = 0.0
    smoothing: str = "none"
    spine: bool = False


def write_parquet(path: Path, track: PoseTrack, layout: TableLayout) -> None:
    """Write the columns of `write_csv` as Parquet; missing values are null.  Raises OSError.

    Needs pyarrow.  Every column has its unit in the metadata of its field too.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = table_columns(track, layout)
    fields = []
    for name, values in columns.items():
        kind = pa.int64() if name == "frame" else pa.string() if isinstance(values, tuple) else pa.float64()
        unit = unit_of(name)
        fields.append(pa.field(name, kind, metadata={"unit": unit} if unit else None))
    schema = pa.schema(fields, metadata={"zenocap": json.dumps(metadata(track, layout))})
    arrays = [
        pa.array(values, field.type, from_pandas=True) for field, values in zip(fields, columns.values(), strict=True)
    ]
    table = pa.Table.from_arrays(arrays, schema=schema)
    with atomic_file(path) as unfinished, unfinished.open("wb") as file:
        pq.write_table(table, file)


def write_npz(path: Path, track: PoseTrack, layout: TableLayout) -> None:
    """Write arrays, compressed, without pickles; missing values are NaN.  Raises OSError.

    frame (n,), time_s (n,), navel_UNIT (n, 3), angles_ANGLE (n, angles) and angle_names, joint_centres_UNIT (n, joints, 3)
    and joint_names, score (n, viewers), view (n, viewers) and viewers, confidence (n, limbs) and limbs, lost (n,) and
    metadata.
    """
    centres, count = track.trajectories(layout.joints, layout.min_confidence, spine=layout.spine), len(track.frames)
    arrays = {
        "frame": track.frames,
        "time_s": track.times_s,
        f"navel_{layout.unit}": convert(track.positions, layout.axes, layout.unit),
        f"angles_{layout.angle}": _angles(track, layout),
        "angle_names": np.array(track.anatomy.angles),
        f"joint_centres_{layout.unit}": convert(centres.points, layout.axes, layout.unit),
        "joint_names": np.array(centres.names),
        "viewers": np.array(list(track.views), dtype=np.str_),
        "view": np.array(list(track.views.values()), dtype=np.str_).reshape(len(track.views), count).T,
        "score": np.array([track.scores[v] for v in track.views]).reshape(len(track.views), count).T,
        "limbs": np.array(list(track.limbs), dtype=np.str_),
        "confidence": np.array(list(track.limbs.values())).reshape(len(track.limbs), count).T,
        "lost": np.array(track.lost, dtype=np.str_),
        "metadata": np.array(json.dumps(metadata(track, layout))),
    }
    with atomic_file(path) as unfinished, unfinished.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def table_columns(track: PoseTrack, layout: TableLayout) -> dict[str, Floats | Ints | tuple[str, ...]]:
    """Columns (n,) by the names and in the order of CSV."""
    centres = track.trajectories(layout.joints, layout.min_confidence, spine=layout.spine)
    positions = convert(track.positions, layout.axes, layout.unit)
    points, angles = convert(centres.points, layout.axes, layout.unit), _angles(track, layout)
    columns: dict[str, Floats | Ints | tuple[str, ...]] = {"frame": track.frames, "time_s": track.times_s}
    columns |= {f"navel.{axis}_{layout.unit}": positions[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"{name}_{layout.angle}": angles[:, k] for k, name in enumerate(track.anatomy.angles)}
    for viewer, views in track.views.items():
        columns |= {f"view.{viewer}": views, f"score.{viewer}": track.scores[viewer]}
    for j, name in enumerate(centres.names):
        columns |= {f"{name}.{axis}_{layout.unit}": points[:, j, k] for k, axis in enumerate("xyz")}
    return columns | {f"confidence.{limb}": values for limb, values in track.limbs.items()} | {"lost": track.lost}


def unit_of(column: str) -> str:
    """Unit at the end of a column's name, "" if it has none."""
    ending = column.rpartition("_")[2]
    return ending if ending in ("m", "cm", "mm", "deg", "rad", "s") else ""


def metadata(track: PoseTrack, layout: TableLayout) -> Mapping[str, object]:
    """Axes, units, convention and smoothing of the columns, for JSON."""
    directions = dict(zip("xyz", axis_directions(layout.axes), strict=True))
    return asdict(layout) | {
        "program": f"zenocap {version('zenocap')}",
        "body": track.anatomy.name,
        "joint_convention": TITLES[layout.joints],
        "axis_directions": directions,
        "handedness": "left" if layout.axes in ("unity", "unreal") else "right",
        "rate_hz": track.rate,
    }


def _angles(track: PoseTrack, layout: TableLayout) -> Floats:
    return np.degrees(track.angles) if layout.angle == "deg" else track.angles


def export_parquet(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    write_parquet(path, request.track, _layout(request))


def export_npz(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    write_npz(path, request.track, _layout(request))


def _layout(request: ExportRequest) -> TableLayout:
    return TableLayout(
        request.axes, request.unit, request.angle, request.joints, request.min_confidence, request.smoothing, request.spine
    )
