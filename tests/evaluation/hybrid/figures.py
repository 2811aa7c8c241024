"""Figures over seeds, and tables of them."""

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.evaluation.hybrid.runs import Run

Cell = str | int | float
Row = tuple[Cell, ...]
COLUMNS = (
    "mean mm", "worst", "RMSE mm", "worst", "shape mm", "worst", "lost %", "worst", "losses", "never"
)  # fmt: skip


@dataclass(frozen=True)
class Figure:
    """mean, worst: over seeds, NaN ones left out; the worst is the largest."""

    mean: float
    worst: float


@dataclass(frozen=True)
class Summary:
    """Of the runs of one case.  losses: how often a person was lost, over all seeds.  never: seeds without any pose."""

    seeds: int
    mean: Figure
    rmse: Figure
    shape: Figure
    lost: Figure
    losses: int
    never: int
    cpu_ms: float
    wall_ms: float

    @staticmethod
    def missing() -> "Summary":
        """Of a case that there is not."""
        nothing = Figure(math.nan, math.nan)
        return Summary(0, nothing, nothing, nothing, nothing, 0, 0, math.nan, math.nan)

    def cells(self) -> tuple[Cell, ...]:
        """As COLUMNS has them."""
        return (
            self.mean.mean, self.mean.worst, self.rmse.mean, self.rmse.worst, self.shape.mean, self.shape.worst,
            self.lost.mean, self.lost.worst, self.losses, self.never,
        )  # fmt: skip


@dataclass(frozen=True)
class Table:
    """columns: the first is a name.  Floats are shown with one digit."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Section:
    """What one part shows.  notes: what was measured and how.  pictures: files in the same folder."""

    name: str
    title: str
    notes: tuple[str, ...]
    tables: tuple[Table, ...]
    pictures: tuple[str, ...] = field(default=())


def figure(values: Sequence[float]) -> Figure:
    known = [value for value in values if math.isfinite(value)]
    return Figure(float(np.mean(known)), float(np.max(known))) if known else Figure(math.nan, math.nan)


def summary(runs: Sequence[Run]) -> Summary:
    """Raises ValueError without a run."""
    if not runs:
        raise ValueError("no run to summarise: allowed: one or more")
    return Summary(
        len(runs),
        figure([run.mean_mm for run in runs]),
        figure([run.rmse_mm for run in runs]),
        figure([run.shape_mm for run in runs]),
        figure([run.lost_pct for run in runs]),
        sum(run.losses for run in runs),
        sum(run.started < 0 for run in runs),
        figure([run.cpu_ms for run in runs]).mean,
        figure([run.wall_ms for run in runs]).mean,
    )


def markdown(table: Table) -> str:
    lines = [
        "| " + " | ".join(table.columns) + " |",
        "|" + "---|" + "---:|" * (len(table.columns) - 1),
        *("| " + " | ".join(text(cell) for cell in row) + " |" for row in table.rows),
    ]
    return "\n".join([f"**{table.title}**", "", *lines, ""])


def text(cell: Cell) -> str:
    if isinstance(cell, float):
        return f"{cell:.1f}" if math.isfinite(cell) else "–"
    return str(cell)


def write(section: Section, out: Path) -> None:
    """The section's files, and the report of all sections that are in the folder."""
    out.mkdir(parents=True, exist_ok=True)
    plain = {
        "name": section.name,
        "title": section.title,
        "notes": section.notes,
        "tables": [
            {"title": t.title, "columns": t.columns, "rows": [list(map(_finite, row)) for row in t.rows]}
            for t in section.tables
        ],
        "pictures": section.pictures,
    }
    (out / f"{section.name}.json").write_text(json.dumps(plain, indent=1) + "\n")
    for number, table in enumerate(section.tables, 1):
        with (out / f"{section.name}-{number}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([table.columns, *table.rows])
    body = [f"## {section.title}", "", *(f"{note}\n" for note in section.notes), *map(markdown, section.tables)]
    body += [f"![{picture}]({picture})\n" for picture in section.pictures]
    (out / f"{section.name}.md").write_text("\n".join(body))


def report(out: Path, names: Sequence[str]) -> Path:
    """One page of the sections that are there, in the order of `names`."""
    pages = [(out / f"{name}.md").read_text() for name in names if (out / f"{name}.md").is_file()]
    path = out / "report.md"
    path.write_text("\n".join(["# Hybrid tracker: what it reaches\n", *pages]))
    return path


def _finite(cell: Cell) -> Cell | None:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell
