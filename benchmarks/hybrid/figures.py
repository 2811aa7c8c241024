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


def with_worst(value: Figure, digits: int = 1) -> str:
    """Mean over the seeds, and the worst seed in brackets unless all are equal; a dash without a value."""
    if not math.isfinite(value.mean):
        return "–"
    mean, worst = f"{value.mean:.{digits}f}", f"{value.worst:.{digits}f}"
    return mean if value.mean == value.worst else f"{mean} ({worst})"


def frames_until(run: Run, seen: int, below_mm: float, in_row: int = 1) -> int | None:
    """Number of frames from `seen` on until the error is below `below_mm`, 1 for `seen` itself; None for never.

    in_row: number of consecutive frames below, of which the first counts.
    """
    below = np.array(run.errors[max(0, seen - run.first) :]) < below_mm
    recovered = [k for k in range(len(below) - in_row + 1) if below[k : k + in_row].all()]
    return recovered[0] + 1 if recovered else None


def starts(runs: Sequence[Run]) -> str:
    """Frame of the first pose: one number, or those of all seeds."""
    frames = dict.fromkeys("never" if run.started < 0 else str(run.started) for run in runs)
    return ", ".join(frames)
