"""Results as JSON, CSV and tables."""

import csv
import io
import json
from dataclasses import replace

import pytest
from rich.console import Console

from zenocap.tools.measure.latency import EDGES_MS, Figures
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.ramp import Ramp
from zenocap.tools.measure.report import COLUMNS, csv_of_soak, csv_text, report
from zenocap.tools.measure.resources import Cost, MachineUse, ProcessSample
from zenocap.tools.measure.soak import Bucket, Restart, Soak
from zenocap.tools.measure.tables import costs_table, histogram_lines, points_table, rate_line, soak_lines, soak_table

FIGURES = Figures(
    60, 59, 1, 0, 60.0, 59.0, {"p50": 5.0, "p95": 8.0, "p99": 9.0, "p99.9": 9.5, "max": 10.0}, {"p50": 2.0, "p99": 3.0},
    {"p99": 1.0}, 0.25, (0, 3, *[0] * (len(EDGES_MS) - 1)),
)  # fmt: skip
COST = Cost(("load-1", "viewer", "1"), 0.5, 10**8, 20, 12, 0.4, 30.0, {"step_frame": 3.0}, {"dropped_frames": 1})
POINT = Measurement(Plan(), FIGURES, (COST,), MachineUse(2, 0.5, 0.1), 4.0, 1.0, 0)
SAMPLES = {COST.key: ProcessSample(1, 0.0, 0.0, 10**8, 20, 12)}
SOAK = Soak(
    Plan(), tuple(Bucket(10.0 * k, FIGURES, SAMPLES, (0, 0)) for k in range(10)), (Restart(20.0, "load-1 viewer 2", 2.5),)
)


def test_json_has_everything() -> None:
    found = json.loads(report([POINT], Ramp("rate", (POINT,)), SOAK))
    (point,) = found["points"]
    assert point["plan"]["rate"] == 30.0
    assert point["latency_ms"]["p99"] == 9.0
    assert point["loss"] == pytest.approx(1 / 60)
    assert point["held"] is False
    assert point["services"][0]["cores"] == 0.5
    assert found["ramp"] == {"what": "rate", "largest_held": None, "failure": None}
    assert found["soak"]["restarts"][0]["back_s"] == 2.5
    assert len(found["soak"]["buckets"]) == 10
    assert found["limits"]


def test_csv_has_a_row_per_measurement_with_empty_cells_without_results() -> None:
    (row,) = csv.DictReader(io.StringIO(csv_text([POINT])))
    assert tuple(row) == COLUMNS
    assert [column for column, cell in row.items() if cell == ""] == ["skew_p50_ms"]
    assert (row["p99_ms"], row["rate"], row["held"]) == ("9.000", "30.000", "False")


def test_csv_of_a_soak_has_each_bucket_and_process() -> None:
    rows = list(csv.DictReader(io.StringIO(csv_of_soak(SOAK))))
    assert len(rows) == 20
    assert {row["process"] for row in rows} == {"", "load-1 viewer 1"}


def test_tables_show_the_results() -> None:
    console = Console(file=io.StringIO(), width=200)
    for table in (points_table([POINT]), costs_table(POINT), soak_table(SOAK)):
        console.print(table)
    assert isinstance(console.file, io.StringIO)
    text = console.file.getvalue()
    for words in ("60/s", "1.67 %", "load-1 viewer 1", "frames 1", "shared memory"):
        assert words in text
    assert soak_lines(SOAK)[-1] == "everything is flat"


def test_the_rate_counts_frame_sets_and_names_the_cores_of_viewers_and_integrator() -> None:
    integrator = Cost(("load-1", "integrator", "main"), 0.25, 10**8)
    point = replace(POINT, costs=(COST, COST, integrator), seconds=2.0)
    assert rate_line(point) == (
        "frame sets: 30/s offered, 29.5/s completed; cores: viewers 0.50 and 0.50, load-1 integrator 0.25"
    )


def test_a_histogram_starts_and_ends_with_filled_bins() -> None:
    (line,) = histogram_lines(FIGURES.histogram)
    assert line.endswith("3")
    assert histogram_lines([0] * 5) == []
