"""Plots of figures: a line for every series with its worst seed, stacked bars, pictures side by side."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

DPI = 110
MOST_TICKS = 10  # at every point of the first series
ABOVE = 1.15  # of the highest value
WORST = 0.25  # opacity of the range from mean to worst


@dataclass(frozen=True)
class Series:
    """y against x; worst: over the seeds, drawn as a band; empty without."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    worst: tuple[float, ...] = ()


@dataclass(frozen=True)
class Panel:
    """aim: a dashed line across.  log: the x axis is logarithmic, ticks are the x of the first series.

    top: of the y axis; values beyond are cut off.  marks: on every point.
    """

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    aim: float | None = None
    log: bool = False
    top: float | None = None
    marks: bool = True


def panels(path: Path, title: str, every: Sequence[Panel], columns: int = 3) -> None:
    """Panels in rows of at most `columns`."""
    columns = min(columns, len(every))
    rows = -(-len(every) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.6 * rows + 0.3), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    axes = figure.subplots(rows, columns, squeeze=False)
    for k, where in enumerate(axes.flat):
        if k < len(every):
            _draw(where, every[k])
        else:
            where.set_axis_off()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)


def _draw(axes: Axes, panel: Panel) -> None:
    for one in panel.series:
        (line,) = axes.plot(one.x, one.y, "o-" if panel.marks else "-", markersize=4, linewidth=1.4, label=one.name)
        if one.worst:
            axes.fill_between(one.x, one.y, one.worst, color=line.get_color(), alpha=WORST, linewidth=0)
    if panel.aim is not None:
        axes.axhline(panel.aim, color="grey", linestyle="--", linewidth=0.9, label=f"aim {panel.aim:g}")
    if panel.log:
        axes.set_xscale("log")
        axes.minorticks_off()
    if 0 < len(panel.series[0].x) <= MOST_TICKS:
        axes.set_xticks(panel.series[0].x, [f"{tick:g}" for tick in panel.series[0].x])
    axes.set(xlabel=panel.x_label, ylabel=panel.y_label)
    axes.set_title(panel.title, fontsize=10)
    highest = [*(v for one in panel.series for v in (*one.y, *one.worst) if math.isfinite(v)), panel.aim or 0.0]
    axes.set_ylim(0, ABOVE * max(highest) or 1.0 if panel.top is None else panel.top)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def bars(
    path: Path,
    title: str,
    y_label: str,
    groups: Sequence[str],
    series: Mapping[str, Sequence[float]],
    worst: Mapping[str, Sequence[float]] | None = None,
    top: float | None = None,
) -> None:
    """Bars side by side, one of every series in every group, with a whisker up to the worst; NaN for none."""
    figure = Figure(figsize=(max(6.0, 1.1 * len(groups) * max(1.0, len(series) / 3)), 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    width = 0.8 / len(series)
    for k, (name, values) in enumerate(series.items()):
        at = [group + (k - (len(series) - 1) / 2) * width for group in range(len(groups))]
        axes.bar(at, values, 0.92 * width, label=name)
        high = values if worst is None else [max(one, two) for one, two in zip(worst[name], values, strict=True)]
        rise = [up - value for up, value in zip(high, values, strict=True)]
        axes.errorbar(at, values, [[0.0] * len(rise), rise], fmt="none", ecolor="black", elinewidth=0.8, capsize=2)
        for x, value, up in zip(at, values, high, strict=True):
            if math.isfinite(value):
                place = up if top is None else min(up, 0.97 * top)
                axes.annotate(f"{value:.0f}", (x, place), (0, 2), textcoords="offset points", ha="center", fontsize=7)
    axes.set_xticks(range(len(groups)), groups, fontsize=8)
    axes.set_ylabel(y_label)
    axes.set_title(title, fontsize=11)
    axes.set_ylim(0, top)
    axes.grid(axis="y", alpha=0.3)
    figure.legend(loc="outside lower center", ncols=min(len(series), 6), fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)


def stacked(
    path: Path,
    title: str,
    x_label: str,
    groups: Sequence[str],
    series: Mapping[str, Sequence[float]],
    aims: Mapping[str, float],
    totals: Sequence[float],
) -> None:
    """Horizontal bars, the series of each group one after the other; aims: vertical lines by name.

    totals: written beside the bars; medians do not add up.
    """
    figure = Figure(figsize=(8.5, 1.2 + 0.5 * len(groups)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    left = [0.0] * len(groups)
    for name, values in series.items():
        axes.barh(range(len(groups)), values, left=left, height=0.7, label=name)
        left = [before + value for before, value in zip(left, values, strict=True)]
    for k, (end, total) in enumerate(zip(left, totals, strict=True)):
        axes.text(end, k, f" {total:.1f}", va="center", fontsize=8)
    for (name, value), style in zip(aims.items(), ("--", ":"), strict=False):
        axes.axvline(value, color="black", linestyle=style, linewidth=1.0, label=name)
    axes.set_yticks(range(len(groups)), groups)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.12 * max([*left, *aims.values()]))
    axes.set_xlabel(x_label)
    axes.set_title(title, fontsize=11)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
