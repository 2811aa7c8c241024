"""`zenocap evaluate`: error of joint angles against ground truth, another take, or another system."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.clinical_angles import ANGLES, other_solution, within_half_a_turn
from zenocap.common.errors import UserError
from zenocap.common.formats.angle_series import AngleSeries, angle_series, filled, has_rigid_trunk, read_source
from zenocap.common.formats.pose_track import PoseTrack, inside
from zenocap.tools.takes.evaluate import ScoredFrames
from zenocap.tools.takes.pairing import TimedValues, better_changes, paired_rows

CONVENTION = "degrees; joint coordinate systems of the ISB (sequence Z, X, Y; leans Y, X, Z); signs in docs/conventions.md"
ABSENT = {(False, False): "in neither", (False, True): "not in the truth", (True, False): "not in the take"}
ONE_TRUNK = "one side has no joint between pelvis and trunk: hips and shoulders are measured against the whole trunk"
BAD_DEG = 5.0  # mean error beyond which a change of the truth is searched; chosen by hand
RADIANS = {"radians": 180.0 / np.pi, "degrees, and declared as radians": np.pi / 180.0}
SOLUTIONS = ("shoulder_flexion", "shoulder_adduction", "shoulder_rotation")
SOLUTIONS_NOTE = "of two equal Euler solutions of a shoulder, that nearer to the truth was compared: the other one"
COLUMNS, DPI = 4, 110  # of the picture
WIDTH_IN, HEIGHT_IN = 3.6, 2.2  # of one plot
STILL_DEG = 1e-6  # standard deviation below which an angle has no correlation; chosen by hand, beyond rounding


@dataclass(frozen=True)
class AngleError:
    """Error of one angle, degrees.  frames: those in which both sides define it.

    mae: mean absolute error.  rms: root mean square.  bias: mean of take minus truth.  rms_unbiased: RMS without the bias.
    range_truth, range_take: highest minus lowest angle.  correlation: Pearson's; None if an angle is constant.
    """

    frames: int
    mae_deg: float
    rms_deg: float
    bias_deg: float
    rms_unbiased_deg: float
    range_truth_deg: float
    range_take_deg: float
    correlation: float | None


@dataclass(frozen=True)
class AngleAccuracy:
    """Errors of all angles.  frames: compared instants, at which both sides have a pose.

    without_pose_pct: share of the selected instants that are not compared; take_lost_pct and truth_lost_pct: because the
    take or the truth has no pose there.  not_compared: reason by angle.  notes: assumptions made while reading.
    doubts: changes of the truth, in words, after which the mean error is less than half.
    """

    convention: str
    frames: int
    without_pose_pct: float
    take_lost_pct: float
    truth_lost_pct: float
    angles: dict[str, AngleError]
    not_compared: dict[str, str]
    notes: tuple[str, ...]
    doubts: tuple[str, ...]


@dataclass(frozen=True)
class AngleCurves:
    """Angles of both sides at the m selected instants, degrees by name; NaN where not compared.

    times_s: (m,) of the truth, seconds.
    """

    times_s: Floats
    truth: Mapping[str, Floats]
    take: Mapping[str, Floats]


def angle_accuracy(
    track: PoseTrack, truth_path: Path, selection: ScoredFrames, take_path: Path
) -> tuple[AngleAccuracy, AngleCurves]:
    """Errors of the joint angles of a take's poses against the file at `truth_path`: .mot, .bvh, .trc or a take.

    selection: of the truth's frames.  take_path: for errors.  Raises UserError, also without instants or angles in common.
    """
    take_source, truth_source = filled(track), read_source(truth_path)
    rigid_trunk = has_rigid_trunk(take_source) or has_rigid_trunk(truth_source)
    take = angle_series(take_source, take_path, rigid_trunk=rigid_trunk)
    if rigid_trunk:
        take = replace(take, notes=(*take.notes, ONE_TRUNK))
    truth = angle_series(truth_source, truth_path, rigid_trunk=rigid_trunk)
    return compared(take, truth, selection, take_path, truth_path)


def compared(
    take: AngleSeries, truth: AngleSeries, selection: ScoredFrames, take_path: Path, truth_path: Path
) -> tuple[AngleAccuracy, AngleCurves]:
    """See `angle_accuracy`."""
    selected = (truth.frames % selection.every == 0) & inside(truth.frames, truth.times_s, selection.first, selection.last)
    rows = np.flatnonzero(selected)
    if not len(rows):
        range_text = f"frames {truth.frames[0]} to {truth.frames[-1]}, {truth.times_s[0]:.2f}s to {truth.times_s[-1]:.2f}s"
        raise UserError(f"{truth_path}: --from, --until and --every leave no frame: allowed: of {range_text}")
    shift_s = selection.offset / take.rate if take.rate else 0.0
    take_at, truth_at = paired_rows(take.times_s - shift_s, truth.times_s[rows])
    if not len(take_at) or not ((take_at >= 0) & (truth_at >= 0)).any():
        raise UserError(
            f"no frame of {take_path.name} ({_span(take)}) is within half an interval of a selected one of "
            f"{truth_path.name} ({_span(truth)}): check --from, --until, --every and --offset"
        )
    truth_at = np.where(truth_at >= 0, rows[truth_at], -1)
    take_known = (take_at >= 0) & take.known[take_at]
    truth_known = (truth_at >= 0) & truth.known[truth_at]
    both = take_known & truth_known
    if not both.any():
        raise UserError(f"{take_path.name} and {truth_path.name} have no pose in the same frame: check --offset")
    expected = {name: np.where(both, values[truth_at], np.nan) for name, values in truth.angles.items()}
    found = {name: np.where(both, values[take_at], np.nan) for name, values in take.angles.items()}
    nearest = _nearest_solutions(found, expected)
    turned = both & np.any([np.abs(values - found[name]) > 0.0 for name, values in nearest.items()], axis=0)
    notes = [f"{SOLUTIONS_NOTE} in {turned.sum() / both.sum():.1%} of the rows"] if turned.any() else []
    found |= nearest
    angles, not_compared = {}, {}
    curves: tuple[dict[str, Floats], dict[str, Floats]] = ({}, {})
    for name in (angle.name for angle in ANGLES):
        if name not in expected or name not in found:
            not_compared[name] = ABSENT[name in expected, name in found]
            continue
        # Continuous over time: 181 after 179 degrees; the take's within half a turn of the truth's.
        curves[0][name] = _unwrapped(expected[name])
        curves[1][name] = curves[0][name] + within_half_a_turn(found[name] - expected[name])
        if np.isfinite(curves[1][name]).any():
            angles[name] = error_of(curves[1][name], curves[0][name])
        else:
            not_compared[name] = "defined in no common frame"
    if not angles:
        raise UserError(f"{take_path.name} and {truth_path.name} have no joint angle in common")
    without, take_lost, truth_lost = (100.0 * float(np.mean(~known)) for known in (both, take_known, truth_known))
    result = AngleAccuracy(
        CONVENTION, int(np.count_nonzero(both)), without, take_lost, truth_lost, angles=angles, not_compared=not_compared,
        notes=(*take.notes, *truth.notes, *notes), doubts=_doubts(take, truth, rows, shift_s),
    )  # fmt: skip
    instants = np.where(truth_at >= 0, truth.times_s[truth_at], take.times_s[take_at] - shift_s)
    return result, AngleCurves(instants, *curves)


def _doubts(take: AngleSeries, truth: AngleSeries, rows: Ints, shift_s: float) -> tuple[str, ...]:
    """See `AngleAccuracy`.  rows: of the truth.  Without angles of the shoulder that have equal solutions."""
    names = tuple(name for name in truth.angles if name in take.angles and not name.startswith(SOLUTIONS))
    if not names:
        return ()
    every = np.arange(len(take.frames))
    one, other = (
        TimedValues(
            names, side.times_s[at], np.stack([np.where(side.known, side.angles[name], np.nan)[at] for name in names], 1),
            side.rate,
        )
        for side, at in ((take, every), (truth, rows))
    )  # fmt: skip
    take_at, truth_at = paired_rows(one.times_s - shift_s, other.times_s, one.rate)
    error = _distance(one.values[take_at], other.values[truth_at])[(take_at >= 0) & (truth_at >= 0)]
    mean = float(np.nanmean(error)) if np.isfinite(error).any() else 0.0
    if mean <= BAD_DEG:
        return ()
    return tuple(one.text("degrees", mean) for one in better_changes(one, other, shift_s, mean, _distance, RADIANS))


def _distance(found: Floats, expected: Floats) -> Floats:
    distance: Floats = np.abs(within_half_a_turn(found - expected))
    return distance


def error_of(take: Floats, truth: Floats) -> AngleError:
    """Error of an angle (n,), degrees, both continuous; NaN rows of either are left out, one or more must remain."""
    defined = np.isfinite(take) & np.isfinite(truth)
    found, expected = take[defined], truth[defined]
    difference = found - expected
    bias = float(difference.mean())
    moving = len(found) > 1 and found.std() > STILL_DEG and expected.std() > STILL_DEG
    return AngleError(
        frames=len(found), mae_deg=float(np.abs(difference).mean()), rms_deg=float(np.sqrt((difference**2).mean())),
        bias_deg=bias, rms_unbiased_deg=float(np.sqrt(((difference - bias) ** 2).mean())),
        range_truth_deg=float(np.ptp(expected)), range_take_deg=float(np.ptp(found)),
        correlation=float(np.corrcoef(found, expected)[0, 1]) if moving else None,
    )  # fmt: skip


def _nearest_solutions(found: Mapping[str, Floats], expected: Mapping[str, Floats]) -> dict[str, Floats]:
    """Flexion, adduction and rotation of the take's shoulders: of both solutions the one nearer to the truth's."""
    result: dict[str, Floats] = {}
    for side in "rl":
        names = [f"shoulder_{name}_{side}" for name in ("flexion", "adduction", "rotation")]
        if not all(name in found and name in expected for name in names):
            continue
        one, truth = (np.stack([angles[name] for name in names], axis=-1) for angles in (found, expected))
        other = other_solution(one)
        distance, other_distance = (
            np.nansum(np.abs(within_half_a_turn(three - truth))[:, :2], axis=1) for three in (one, other)
        )
        nearer = np.where((other_distance < distance)[:, None], other, one)
        result |= {name: nearer[:, k] for k, name in enumerate(names)}
    return result


def _unwrapped(degrees: Floats) -> Floats:
    """The same angles modulo full turns, continuous over the rows that are not NaN."""
    result = degrees.copy()
    known = np.isfinite(degrees)
    result[known] = np.unwrap(degrees[known], period=360.0)
    return result


def _span(series: AngleSeries) -> str:
    return f"{series.times_s[0]:.3f} to {series.times_s[-1]:.3f} s at {series.rate:g}/s"


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
