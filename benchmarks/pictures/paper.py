"""Figures 4 to 9 of [Hybrid VI, VII], of the replication: seed 0; 7 and 8 of the stored results."""

from pathlib import Path

import numpy as np

from benchmarks.cases.paper import METHODS, PAPER_RMSE_MM, angle_curves
from benchmarks.cases.replication import FEWER, LAWS, PEOPLE, REPLICATION, TRUE_POSE, clip_of, tracked
from benchmarks.harness.case import Case
from benchmarks.harness.results import load_all
from benchmarks.people.cylinders import COUNTS, MOTIONS, REGIONS, prior_of
from benchmarks.people.tracker import offsets, trajectories
from benchmarks.pictures.plots import BarPanel, CurvePanel, PlottedCurve, bar_panels, curve_panels, picture_grid
from benchmarks.pictures.views import ESTIMATED, TRUTH, pose_view
from zenocap.common.arrays import Image
from zenocap.common.errors import UserError

# Paper (open): which angle of the right shoulder, a ball joint; its elevation.
ANGLES_SHOWN = {
    "walking": ("elbow_flexion_l", "left elbow, flexion"),
    "jogging": ("knee_flexion_l", "left knee, flexion"),
    "boxing": ("shoulder_elevation_r", "right shoulder, elevation"),
}
METHOD_COLOURS = dict(zip(METHODS, ("tab:blue", "tab:red", "tab:green"), strict=True))
MOTION_COLOURS = dict(zip(MOTIONS, ("tab:blue", "tab:orange", "tab:green"), strict=True))
PAPER_COLOUR = "tab:gray"
ERROR_TICKS = (5, 10, 20, 50, 100, 200, 500, 1000)  # mm


def draw(folder: Path) -> None:
    """Write figure-4.png to figure-9.png into `papers` of a folder.  Raises UserError without stored results."""
    place = folder / "papers"
    _regions_of_the_prior(place / "figure-4.png")
    _tracked_frames(place / "figure-5.png")
    _angles(place / "figure-6.png")
    _errors(place / "figure-7.png")
    _errors_by_regions(place / "figure-8.png")
    _errors_by_frame(place / "figure-9.png")


def _regions_of_the_prior(path: Path) -> None:
    panels = []
    for motion in MOTIONS:
        rows = prior_of(motion, PEOPLE[0]).training.errors
        counts = np.array([row.regions for row in rows], dtype=np.float64)
        curves = [
            PlottedCurve(name, counts, np.degrees(values), "tab:blue", style)
            for name, values, style in (
                ("training frames", [row.training for row in rows], "o-"),
                ("held out", [row.held for row in rows], "s--"),
            )
        ]
        panels.append(CurvePanel(motion, "error, RMS (°)", tuple(curves), _last(motion, "regions M"), COUNTS))
    curve_panels(path, "[Hybrid] Fig. 4: reconstruction error by regions", panels)


def _tracked_frames(path: Path) -> None:
    """The middle test frame of each motion: the estimates over the truth and the silhouette."""
    rows: dict[str, list[Image]] = {}
    for motion in MOTIONS:
        for method in METHODS:
            one = _case(method, motion)
            film = clip_of(one).film
            frame = (film.motion_from + int(film.truth.frames[-1])) // 2
            rows.setdefault(method, []).append(pose_view(film, frame, tracked(one)))
    picture_grid(path, "[Hybrid] Fig. 5: tracking results", rows, list(MOTIONS), {"estimated": ESTIMATED, "truth": TRUTH})


def _angles(path: Path) -> None:
    """A joint angle over the test frames."""
    panels = []
    for motion, (angle, label) in ANGLES_SHOWN.items():
        one = _case("hybrid", motion)
        film = clip_of(one).film
        found = angle_curves(trajectories(tracked(one), film.truth.rate, film.motion_from), film.truth, film.motion_from)
        times_s = found.times_s - found.times_s[0]
        curves = (
            PlottedCurve("truth", times_s, found.truth[angle], "black", "-", 2.2),
            PlottedCurve("hybrid", times_s, found.take[angle], METHOD_COLOURS["hybrid"]),
        )
        panels.append(CurvePanel(f"{motion}: {label}", "angle (°)", curves, _last(motion, "test time (s)"), zero=False))
    curve_panels(path, "[Hybrid] Fig. 6: joint angles", panels)


def _errors(path: Path) -> None:
    """RMSE of joint angles and of joint positions by motion, of the hybrid method."""
    panels = []
    for column, label, digits in (("angles", "joint angles (°)", 1), ("RMSE", "joint positions (mm)", 1)):
        found = [_stored(_name("hybrid", motion), column) for motion in MOTIONS]
        values, worst = ({"replication": [pair[k] for pair in found]} for k in (0, 1))
        # Of the angles the paper prints no numbers.
        more = {"paper": list(PAPER_RMSE_MM["hybrid"])} if column == "RMSE" else {}
        panels.append(BarPanel(label, tuple(MOTIONS), values | more, worst | more, digits))
    colours = {"replication": METHOD_COLOURS["hybrid"], "paper": PAPER_COLOUR}
    bar_panels(path, "[Hybrid] Fig. 7: RMSE of each sequence", panels, colours)


def _errors_by_regions(path: Path) -> None:
    """RMSE over the first test frames from the true pose on."""
    curves = []
    for motion in MOTIONS:
        names = [LAWS[0] if count == REGIONS else f"M = {count}" for count in COUNTS]
        values = [_stored(f"hybrid, {name}, {TRUE_POSE}, {FEWER} frames, {motion}", "RMSE")[0] for name in names]
        curves.append(
            PlottedCurve(motion, np.array(COUNTS, dtype=np.float64), np.array(values), MOTION_COLOURS[motion], "o-")
        )
    panel = CurvePanel("hybrid", "RMSE (mm)", tuple(curves), "regions M", COUNTS)
    curve_panels(path, "[Hybrid] Fig. 8: RMSE by number of regions", [panel])


def _errors_by_frame(path: Path) -> None:
    """RMSE over the joints in every test frame by method."""
    panels = []
    for motion in MOTIONS:
        curves = []
        for method in reversed(METHODS):  # the hybrid on top
            one = _case(method, motion)
            film = clip_of(one).film
            kept = film.truth.frames >= film.motion_from
            squares = np.sum(offsets(tracked(one), film.truth)[kept] ** 2, axis=2)
            values = 1e3 * np.sqrt(squares.mean(axis=1))
            curves.append(
                PlottedCurve(method, np.arange(len(values), dtype=np.float64), values, METHOD_COLOURS[method], "-", 1.3)
            )
        panels.append(CurvePanel(motion, "RMSE (mm)", tuple(curves), _last(motion, "test frame"), y_ticks=ERROR_TICKS))
    curve_panels(path, "[Hybrid] Fig. 9: RMSE of the joint positions", panels)


def _name(method: str, motion: str) -> str:
    """Name of a case of the paper's table."""
    law = f", {LAWS[0]}" if method != "particle-filter" else ""
    return f"{method}{law}, {TRUE_POSE}, all frames, {motion}"


def _case(method: str, motion: str) -> Case:
    return REPLICATION.cases[_name(method, motion)]


def _stored(case: str, column: str) -> tuple[float, float]:
    """Figure and worst seed of a stored result.  Raises UserError without one."""
    results = load_all().get(REPLICATION.name)
    if results is None:
        raise UserError(
            f"{REPLICATION.name}: no results: allowed: after `python -m benchmarks {REPLICATION.name} --publish`"
        )
    values = [float("nan") if one is None else one for one in results.row(case).figures[column]]
    return values[0], values[-1]


def _last(motion: str, label: str) -> str:
    """Label of the x axis, below the last panel only."""
    return label if motion == list(MOTIONS)[-1] else ""
