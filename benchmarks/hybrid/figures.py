"""Figures over seeds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hybrid.runs import Run
from benchmarks.sections import Cell

COLUMNS = (
    "mean mm", "worst", "RMSE mm", "worst", "shape mm", "worst", "lost %", "worst", "losses", "never"
)  # fmt: skip


@dataclass(frozen=True)
class Figure:
    """mean, worst: over seeds without NaN; worst is the largest."""

    mean: float
    worst: float


@dataclass(frozen=True)
class Summary:
    """Figures of one case.  losses: number of track losses over all seeds.  never: seeds without any pose."""

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
        """Summary of a case without runs."""
        empty = Figure(math.nan, math.nan)
        return Summary(0, empty, empty, empty, empty, 0, 0, math.nan, math.nan)

    def cells(self) -> tuple[Cell, ...]:
        """Cells in the order of COLUMNS."""
        return (
            self.mean.mean, self.mean.worst, self.rmse.mean, self.rmse.worst, self.shape.mean, self.shape.worst,
            self.lost.mean, self.lost.worst, self.losses, self.never,
        )  # fmt: skip


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
