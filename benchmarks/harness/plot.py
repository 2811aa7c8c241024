"""A picture of a kind's results: a panel a column, a mark a case, a whisker to the worst seed."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.harness.results import Results, Row
from benchmarks.harness.text import title

DPI = 110


def plot(results: Results, rows: Sequence[Row], path: Path) -> None:
    """Write the picture."""
    shown = [one for one in results.columns if any(row.figures.get(one.name) for row in rows)]
    figure = Figure(figsize=(3.0 + 2.4 * max(1, len(shown)), 1.4 + 0.28 * len(rows)), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(results.kind)
    for axes, heading in zip(figure.subplots(1, max(1, len(shown)), sharey=True, squeeze=False)[0], shown, strict=False):
        for place, row in enumerate(rows):
            known = [value for value in row.figures.get(heading.name, []) if value is not None]
            if known:
                axes.plot([known[0], known[-1]], [place, place], color="tab:gray", linewidth=1.2)
                axes.plot(known[0], place, "o", color="tab:blue", markersize=4)
        axes.set_xlabel(title(heading), fontsize=8)
        axes.grid(alpha=0.3)
        axes.set_yticks(range(len(rows)), [row.case for row in rows], fontsize=8)
    figure.axes[0].invert_yaxis()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
