"""Errors of joint angles as a table, and the angles over time as a picture."""

from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.tools.takes.evaluate_angles import AngleAccuracy, AngleCurves

COLUMNS, DPI = 4, 110
WIDTH_IN, HEIGHT_IN = 3.6, 2.2  # of one plot


def angle_lines(found: AngleAccuracy) -> list[str]:
    """Table of the errors, for a terminal."""
    lines = [
        f"frames {found.frames}; without pose {found.without_pose_pct:.1f} % "
        f"(take {found.take_lost_pct:.1f} %, truth {found.truth_lost_pct:.1f} %)",
        f"{'degrees':22}{'frames':>7}{'mae':>7}{'rms':>7}{'bias':>7}{'rms-bias':>9}{'range truth':>12}{'take':>7}{'r':>7}",
    ]
    for name, error in found.angles.items():
        correlation = "-" if error.correlation is None else f"{error.correlation:.2f}"
        lines.append(
            f"{name:22}{error.frames:7}{error.mae_deg:7.1f}{error.rms_deg:7.1f}{error.bias_deg:+7.1f}"
            f"{error.rms_unbiased_deg:9.1f}{error.range_truth_deg:12.1f}{error.range_take_deg:7.1f}{correlation:>7}"
        )
    for reason in dict.fromkeys(found.not_compared.values()):
        names = ", ".join(name for name, given in found.not_compared.items() if given == reason)
        lines.append(f"not compared, {reason}: {names}")
    lines += [f"note: {note}" for note in found.notes]
    lines.append(f"convention: {found.convention}")
    return lines


def draw_angles(path: Path, curves: AngleCurves, found: AngleAccuracy, names: tuple[str, str]) -> None:
    """Write a picture in the format of `path`'s suffix.  names: of truth and take, for the legend.

    Raises UserError, and ImportError without matplotlib.
    """
    from matplotlib.figure import Figure

    rows = -(-len(found.angles) // COLUMNS)
    figure = Figure(figsize=(COLUMNS * WIDTH_IN, rows * HEIGHT_IN + 0.5), layout="constrained")
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
