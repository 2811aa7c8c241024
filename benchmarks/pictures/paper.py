"""Figures 4 to 9 of [Hybrid VI, VII] on the shared clips, seed 0; 7 and 8 of the stored results."""

from pathlib import Path

import numpy as np

from benchmarks.cases import clips
from benchmarks.cases.paper import COUNTS, METHODS, MOTIONS, PAPER_RMSE_MM, PRESETS, TABLE_2, angle_curves
from benchmarks.harness.case import Case
from benchmarks.harness.results import load_all
from benchmarks.people.priors import KINDS, prior_named
from benchmarks.people.shared_clips import Clip
from benchmarks.people.tracker import offsets, trajectories
from benchmarks.pictures.plots import BarPanel, Curve, CurvePanel, bar_panels, curve_panels, picture_grid
from benchmarks.pictures.views import ESTIMATED, TRUTH, captured_view, pose_view
from zenocap.common.arrays import Image

# Paper (open): which angle of the right shoulder, a ball joint; its elevation.
ANGLES_SHOWN = {
    "walk7": ("elbow_flexion_l", "left elbow, flexion"),
    "jog7": ("knee_flexion_l", "left knee, flexion"),
    "box7": ("shoulder_elevation_r", "right shoulder, elevation"),
}
PRESET_COLOURS = {"default": "tab:blue", "paper": "tab:orange"}
METHOD_COLOURS = dict(zip(METHODS, ("tab:blue", "tab:red", "tab:green"), strict=True))
MOTION_COLOURS = dict(zip(MOTIONS, ("tab:blue", "tab:orange", "tab:green"), strict=True))
REGION_TITLES = {"default": "preset default", "paper": "preset paper, least squares"}
PRESET_STYLES = {"default": "-", "paper": "--"}
ERROR_TICKS = (20, 50, 100, 200, 500, 1000)  # mm


def draw(folder: Path) -> None:
    """Write figure-4.png to figure-9.png into `papers` of a folder."""
    place = folder / "papers"
    _regions_of_the_prior(place / "figure-4.png")
    _tracked_frames(place / "figure-5.png")
    _angles(place / "figure-6.png")
    _errors(place / "figure-7.png")
    _errors_by_regions(place / "figure-8.png")
    _errors_by_frame(place / "figure-9.png")


def _regions_of_the_prior(path: Path) -> None:
    panels = []
    for clip, motion in MOTIONS.items():
        training = clips.training(clips.film_of(_case("default", "hybrid", clip)))
        sources = {
            "first frames of the take": (clips.take_prior(clip, training, paper=False), "tab:blue"),
            "simulated people": (KINDS[clip], "tab:orange"),
        }
        curves = []
        for source, (name, colour) in sources.items():
            prior = prior_named(name)
            assert prior is not None
            counts = np.array([row.regions for row in prior.training.errors], dtype=np.float64)
            for part, style in (("training", "o-"), ("held out", "s--")):
                values = np.degrees([row.training if part == "training" else row.held for row in prior.training.errors])
                curves.append(Curve(f"{source}: {part}", counts, values, colour, style))
        title = f"{motion}: {training} frames of the take"
        panels.append(CurvePanel(title, "error, RMS (°)", tuple(curves), _last(clip, "regions M"), COUNTS))
    curve_panels(path, "[Hybrid] Fig. 4: reconstruction error by regions", panels)


def _tracked_frames(path: Path) -> None:
    """A frame of each motion: the view, and the estimates over the truth."""
    rows: dict[str, list[Image]] = {"camera 1": []}
    for clip in MOTIONS:
        one = _case("default", "hybrid", clip)
        whole = clips.film_of(one)
        assert isinstance(whole, Clip)
        frame = (clips.first_frame(one, whole) + int(whole.truth.frames[-1])) // 2
        rows["camera 1"].append(captured_view(whole, frame))
        for preset in PRESETS:
            found = clips.tracked(_case(preset, "hybrid", clip))
            rows.setdefault(f"preset {preset}", []).append(pose_view(whole, frame, found))
    legend = {"estimated": ESTIMATED, "truth": TRUTH}
    picture_grid(path, "[Hybrid] Fig. 5: tracking results", rows, list(MOTIONS.values()), legend)


def _angles(path: Path) -> None:
    """Joint angles over the test frames."""
    panels = []
    for clip, (angle, label) in ANGLES_SHOWN.items():
        curves: list[Curve] = []
        for preset in PRESETS:
            one = _case(preset, "hybrid", clip)
            whole = clips.film_of(one)
            first = clips.first_frame(one, whole)
            found = angle_curves(trajectories(clips.tracked(one), whole.truth.rate, first), whole.truth, first)
            times_s = found.times_s - found.times_s[0]
            if not curves:
                curves.append(Curve("truth", times_s, found.truth[angle], "black", "-", 2.2))
            style = PRESET_STYLES[preset]
            curves.append(Curve(f"preset {preset}", times_s, found.take[angle], PRESET_COLOURS[preset], style))
        x_label = _last(clip, "time in the test part (s)")
        panels.append(CurvePanel(f"{MOTIONS[clip]}: {label}", "angle (°)", tuple(curves), x_label, zero=False))
    curve_panels(path, "[Hybrid] Fig. 6: joint angles", panels)


def _errors(path: Path) -> None:
    """RMSE of joint angles and of joint positions by motion."""
    motions = tuple(MOTIONS.values())
    found = {
        column: {
            f"preset {preset}": [_stored("table-1", f"{motion}, {preset}, same take", column) for motion in motions]
            for preset in PRESETS
        }
        for column in ("angles", "RMSE")
    }
    paper = {"paper, HumanEva": list(PAPER_RMSE_MM["hybrid"])}  # of the angles it prints no numbers
    panels = []
    for column, label, digits in (("angles", "joint angles (°)", 1), ("RMSE", "joint positions (mm)", 0)):
        values, worst = ({name: [pair[k] for pair in each] for name, each in found[column].items()} for k in (0, 1))
        more = paper if column == "RMSE" else {}
        panels.append(BarPanel(label, motions, values | more, worst | more, digits))
    colours = {f"preset {preset}": PRESET_COLOURS[preset] for preset in PRESETS} | dict.fromkeys(paper, "tab:gray")
    bar_panels(path, "[Hybrid] Fig. 7: RMSE of each sequence", panels, colours)


def _errors_by_regions(path: Path) -> None:
    x = np.array(COUNTS, dtype=np.float64)
    panels = []
    for preset, title in REGION_TITLES.items():
        curves = []
        for clip, motion in MOTIONS.items():
            values = [_stored("regions", f"{motion}, {preset}, M = {count}", "RMSE")[0] for count in COUNTS]
            curves.append(Curve(motion, x, np.array(values), MOTION_COLOURS[clip], "o-"))
        panels.append(CurvePanel(title, "RMSE (mm)", tuple(curves), "regions M" if preset == PRESETS[-1] else "", COUNTS))
    curve_panels(path, "[Hybrid] Fig. 8: RMSE by number of regions", panels)


def _errors_by_frame(path: Path) -> None:
    """RMSE over the joints in every test frame by method."""
    panels = []
    for clip, motion in MOTIONS.items():
        curves = []
        for preset in PRESETS:
            for method in reversed(METHODS):  # the hybrid on top
                one = _case(preset, method, clip)
                whole = clips.film_of(one)
                kept = whole.truth.frames >= clips.first_frame(one, whole)
                squares = np.sum(offsets(clips.tracked(one), whole.truth)[kept] ** 2, axis=2)
                values = 1e3 * np.sqrt(squares.mean(axis=1))
                frames = np.arange(len(values), dtype=np.float64)
                name, style = f"{method}, {preset}", PRESET_STYLES[preset]
                curves.append(Curve(name, frames, values, METHOD_COLOURS[method], style, 1.3))
        panels.append(CurvePanel(motion, "RMSE (mm)", tuple(curves), _last(clip, "test frame"), y_ticks=ERROR_TICKS))
    curve_panels(path, "[Hybrid] Fig. 9: RMSE of the joint positions", panels)


def _case(preset: str, method: str, clip: str) -> Case:
    return TABLE_2.cases[f"{preset}, {method}, {MOTIONS[clip]}"]


def _stored(kind: str, case: str, column: str) -> tuple[float, float]:
    """Figure and worst seed of a stored result.  Raises UserError without one."""
    values = [float("nan") if one is None else one for one in load_all()[kind].row(case).figures[column]]
    return values[0], values[-1]


def _last(clip: str, label: str) -> str:
    """Label of the x axis, below the last panel only."""
    return label if clip == list(MOTIONS)[-1] else ""
