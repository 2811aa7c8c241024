"""CSV: the csv module reads the track's values back, and every heading names its unit."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from tests.support.pose_tracks import NAMES, moving
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.tables import write_csv
from zenocap.common.formats.trajectories import MATRICES, PER_METRE, Angle, Axes, Unit, convert


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file, strict=True))


@pytest.mark.parametrize("axes", list(MATRICES))
@pytest.mark.parametrize(("unit", "angle"), [("m", "deg"), ("cm", "rad"), ("mm", "deg")])
def test_written_files_are_read_back(axes: Axes, unit: Unit, angle: Angle, tmp_path: Path) -> None:
    track = moving(9, first=5, lost=(4,))
    write_csv(tmp_path / "a.csv", ExportRequest(track, axes, unit, angle))
    rows = read(tmp_path / "a.csv")
    assert [int(row["frame"]) for row in rows] == list(track.frames)
    points = np.array([[[float(row[f"{n}.{a}_{unit}"] or "nan") for a in "xyz"] for n in NAMES] for row in rows])
    expected = convert(track.trajectories().points, axes)
    np.testing.assert_allclose(points / PER_METRE[unit], expected, atol=1e-6)
    angles = np.array([[float(row[f"{name}_{angle}"] or "nan") for name in track.anatomy.angles] for row in rows])
    np.testing.assert_allclose(angles, np.degrees(track.angles) if angle == "deg" else track.angles, atol=1e-6)
    np.testing.assert_allclose([float(row["score.1"]) for row in rows], track.scores["1"], atol=1e-4)
    assert {row["view.1"] for row in rows} == {"facade"}
    assert {row["score.2"] for row in rows} == {""}
    assert [row["lost"] for row in rows] == list(track.lost)


def test_every_heading_names_its_unit(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", ExportRequest(moving()))
    headings = read(tmp_path / "a.csv")[0].keys()
    without = [name for name in headings if not re.search(r"_(s|m|deg)$", name)]
    assert without == ["frame", "view.1", "score.1", "view.2", "score.2", "lost"]
