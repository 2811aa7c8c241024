"""Plots in the style of the paper's figures: panels below each other, readable on a narrow screen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from PIL import Image as PictureFile

from zenocap.common.arrays import Floats, Image

DPI = 160
WIDTH_IN = 4.8  # 768 px; 10 pt are 11 px on a screen of 390 px
COLOURS, PICTURE_COLOURS = 48, 96  # of a plot and of pictures; the file is a third as large as with all
PANEL_IN = 2.2  # height of a panel
LEGEND_IN = 0.24  # height of a row of the legend
TITLE_PT, LABEL_PT, SMALL_PT = 11, 10, 9


@dataclass(frozen=True)
class PlottedCurve:
    """y against x, both (n,); NaN are gaps.  style: of the line, as in matplotlib.  width: of the line, points."""

    name: str
    x: Floats
    y: Floats
    colour: str
    style: str = "-"
    width: float = 1.5


@dataclass(frozen=True)
class CurvePanel:
    """x_label: "" for none.  x_ticks, y_ticks: of a logarithmic axis, None for a linear one.

    y_ticks: the axis ends at the first and the last.  zero: the y axis starts at 0."""

    title: str
    y_label: str
    curves: tuple[PlottedCurve, ...]
    x_label: str = ""
    x_ticks: tuple[int, ...] | None = None
    y_ticks: tuple[int, ...] | None = None
    zero: bool = True


def curve_panels(path: Path, title: str, panels: Sequence[CurvePanel]) -> None:
    """Panels below each other with one legend."""
    names = dict.fromkeys(curve.name for panel in panels for curve in panel.curves)
    columns = 2 if max(map(len, names), default=0) > 14 else 3
    rows = -(-len(names) // columns)
    figure, every = _figure(title, len(panels), 0.45 + PANEL_IN * len(panels) + LEGEND_IN * rows)
    handles: dict[str, Artist] = {}
    for axes, panel in zip(every, panels, strict=True):
        for curve in panel.curves:
            (line,) = axes.plot(
                curve.x, curve.y, curve.style, color=curve.colour, linewidth=curve.width, markersize=4, label=curve.name
            )
            handles.setdefault(curve.name, line)
        if panel.x_ticks is not None:
            axes.set_xscale("log")
            axes.minorticks_off()
            axes.set_xticks(panel.x_ticks, [str(tick) for tick in panel.x_ticks])
        if panel.y_ticks is not None:
            axes.set_yscale("log")
            axes.minorticks_off()
            axes.set_yticks(panel.y_ticks, [str(tick) for tick in panel.y_ticks])
            axes.set_ylim(panel.y_ticks[0], panel.y_ticks[-1])
        elif panel.zero:
            axes.set_ylim(0, None)
        _labelled(axes, panel.title, panel.y_label)
        axes.set_xlabel(panel.x_label, fontsize=LABEL_PT)
    figure.legend(
        list(handles.values()), list(handles), loc="outside lower center", ncols=columns, fontsize=SMALL_PT, frameon=False
    )
    _save(figure, path)


@dataclass(frozen=True)
class BarPanel:
    """values, worst: by name of the series, one for each group; NaN for none.  worst: end of the whisker.

    digits: decimals of the printed values.
    """

    y_label: str
    groups: tuple[str, ...]
    values: Mapping[str, Sequence[float]]
    worst: Mapping[str, Sequence[float]]
    digits: int = 0


def bar_panels(path: Path, title: str, panels: Sequence[BarPanel], colours: Mapping[str, str]) -> None:
    """Panels of bars side by side, below each other, with one legend."""
    figure, every = _figure(title, len(panels), 0.45 + PANEL_IN * len(panels) + LEGEND_IN)
    for axes, panel in zip(every, panels, strict=True):
        width = 0.84 / len(panel.values)
        tops = [value for values in panel.worst.values() for value in values if np.isfinite(value)]
        for k, (name, values) in enumerate(panel.values.items()):
            at = np.arange(len(panel.groups)) + (k - (len(panel.values) - 1) / 2) * width
            rise = np.maximum(np.array(panel.worst[name]) - np.array(values), 0.0)
            axes.bar(at, values, 0.92 * width, color=colours[name], label=name)
            axes.errorbar(at, values, [0 * rise, rise], fmt="none", ecolor="black", elinewidth=1.0, capsize=2)
            for x, value, up in zip(at, values, rise, strict=True):
                if np.isfinite(value):
                    text = f"{value:.{panel.digits}f}"
                    axes.annotate(text, (x, value + up), (0, 2), textcoords="offset points", ha="center", fontsize=SMALL_PT)
        axes.set_xticks(range(len(panel.groups)), panel.groups)
        axes.set_ylim(0, 1.15 * max(tops, default=1.0))
        _labelled(axes, "", panel.y_label)
    handles, names = max((axes.get_legend_handles_labels() for axes in every), key=lambda one: len(one[1]))
    figure.legend(handles, names, loc="outside lower center", ncols=3, fontsize=SMALL_PT, frameon=False)
    _save(figure, path)


def picture_grid(
    path: Path, title: str, rows: Mapping[str, Sequence[Image]], columns: Sequence[str], legend: Mapping[str, str]
) -> None:
    """Images, RGB and of equal size, in named rows and columns.  legend: colour by name."""
    height, width = next(iter(rows.values()))[0].shape[:2]
    tall = WIDTH_IN / len(columns) * height / width
    layout = ConstrainedLayoutEngine(w_pad=0.01, h_pad=0.01, hspace=0.0, wspace=0.0)
    figure = Figure(figsize=(WIDTH_IN, 0.6 + LEGEND_IN + 0.96 * tall * len(rows)), layout=layout)
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=TITLE_PT)
    every = figure.subplots(len(rows), len(columns), squeeze=False)
    for row, (name, images) in enumerate(rows.items()):
        for column, image in enumerate(images):
            axes = every[row, column]
            axes.imshow(image)
            axes.set(xticks=[], yticks=[])
            if row == 0:
                axes.set_title(columns[column], fontsize=LABEL_PT)
        every[row, 0].set_ylabel(name, fontsize=LABEL_PT)
    handles = [every[0, 0].plot([], [], color=colour, linewidth=2.5)[0] for colour in legend.values()]
    figure.legend(handles, list(legend), loc="outside lower center", ncols=len(legend), fontsize=SMALL_PT, frameon=False)
    _save(figure, path, PICTURE_COLOURS)


def _figure(title: str, panels: int, height_in: float) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=TITLE_PT)
    return figure, list(figure.subplots(panels, 1, squeeze=False)[:, 0])


def _labelled(axes: Axes, title: str, y_label: str) -> None:
    axes.set_title(title, fontsize=LABEL_PT)
    axes.set_ylabel(y_label, fontsize=LABEL_PT)
    axes.tick_params(labelsize=SMALL_PT)
    axes.grid(alpha=0.3)


def _save(figure: Figure, path: Path, colours: int = COLOURS) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    drawn = BytesIO()
    figure.savefig(drawn, dpi=DPI)
    with PictureFile.open(drawn) as picture:
        picture.convert("RGB").quantize(colours, kmeans=2, dither=PictureFile.Dither.NONE).save(path, optimize=True)
