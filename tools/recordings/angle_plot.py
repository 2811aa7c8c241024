"""Picture of joint angles over time: truth and take, one small plot for each angle."""

from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.tools.recordings.evaluate_angles import AngleAccuracy, AngleCurves

COLUMNS, DPI = 4, 110
WIDTH_IN, HEIGHT_IN = 3.6, 2.2  # of one plot
FORMATS = (".png", ".jpg", ".pdf", ".svg")


def check_picture(path: Path) -> None:
    """Raise UserError for a picture that cannot be written, before the take is read."""
    if path.suffix.lower() not in FORMATS:
        raise UserError(f"--plot {path}: suffix {path.suffix!r}: allowed: {', '.join(FORMATS)}")
    if not path.parent.is_dir():
        raise UserError(f"--plot {path}: cannot be written: no folder {path.parent}")


def draw_angles(path: Path, curves: AngleCurves, found: AngleAccuracy, names: tuple[str, str]) -> None:
    """Write a picture in the format of `path`'s suffix, one of FORMATS.  names: of truth and take, for the legend.

    Raises UserError, and ImportError without matplotlib.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(found.angles) // COLUMNS)
    figure = Figure(figsize=(COLUMNS * WIDTH_IN, rows * HEIGHT_IN + 0.5), layout="constrained")
    FigureCanvasAgg(figure)
    plots = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True).flat
    for axes, (name, error) in zip(plots, found.angles.items(), strict=False):
        axes.plot(curves.times_s, curves.truth[name], color="black", linewidth=1.4)
        axes.plot(curves.times_s, curves.take[name], color="tab:red", linewidth=1.0)
        axes.set_title(f"{name}: rms {error.rms_deg:.1f}°, bias {error.bias_deg:+.1f}°", size=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    for axes in list(figure.axes)[len(found.angles) :]:
        axes.set_axis_off()
    figure.legend(figure.axes[0].lines, names, loc="outside upper left", ncols=2, fontsize=9)
    figure.supxlabel("time (s)", size=9)
    figure.supylabel("angle (°)", size=9)
    try:
        figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from error
