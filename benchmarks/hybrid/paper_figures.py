"""The paper's figures 4 to 9 on the shared clips.  [Hybrid VI, VII]"""

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.experiments import (
    METHODS,
    MOTIONS,
    PAPER_RMSE_MM,
    PRESET_NAMES,
    angle_curves,
    first_test_frame,
    frame_rmse_mm,
    frames_of,
    has_pose,
    method_cases,
    runs_of,
)
from benchmarks.hybrid.paper_plots import BarPanel, Curve, CurvePanel, bar_panels, curve_panels, picture_grid
from benchmarks.hybrid.region_figures import clip_errors, figure_4, figure_8, last_label
from benchmarks.hybrid.runs import Case, Run, run_trajectories
from benchmarks.hybrid.tracking_pictures import ESTIMATED, TRUTH, captured_view, pose_view
from benchmarks.sections import Section, Table
from zenocap.common.arrays import Floats, Image
from zenocap.services.tracker.states import Method

Runs = Mapping[Case, Sequence[Run]]
Cases = Mapping[tuple[str, Method, str], Case]

# Paper (open): which angle of the right shoulder, a ball joint; its elevation.
ANGLES_SHOWN = (
    ("walk7", "elbow_flexion_l", "left elbow, flexion"),
    ("jog7", "knee_flexion_l", "left knee, flexion"),
    ("box7", "shoulder_elevation_r", "right shoulder, elevation"),
)
PRESET_COLOURS = {"default": "tab:blue", "paper": "tab:orange"}
METHOD_COLOURS = dict(zip(METHODS, ("tab:blue", "tab:red", "tab:green"), strict=True))
ERROR_TICKS = (20, 50, 100, 200, 500, 1000)  # mm
PRESET_STYLES = {"default": "-", "paper": "--"}
NUMBERS = range(4, 10)


def paper_figures(bench: Bench) -> Section:
    cases = method_cases(bench)
    runs = runs_of(bench, list(cases.values()))
    tables = (
        figure_4(bench, bench.places.out / _name(4)),
        figure_8(bench, bench.places.out / _name(8)),
    )
    _figure_5(bench, cases, runs)
    _figure_6(bench, cases, runs)
    angles = _figure_7(bench, cases, runs)
    _figure_9(bench, cases, runs)
    return Section(
        "figures",
        "Figures 4 to 9 of the paper",
        (
            f"{bench.seeds} seeds; curves and pictures are of seed 0.  Seven views.  Test frames and priors of the same "
            "take as in Table I, except Fig. 8 and the second pair of curves of Fig. 4: simulated people, because 80 "
            "regions need more than 100 frames.  Fig. 8 with preset paper refines by least squares: the printed force "
            "takes a hundred times as long.",
        ),
        (*tables, angles),
        tuple(_name(number) for number in NUMBERS),
    )


def _name(number: int) -> str:
    return f"figure-{number}.png"


def _figure_5(bench: Bench, cases: Cases, runs: Runs) -> None:
    """A frame of each motion: the view, and the estimates over the truth."""
    rows: dict[str, list[Image]] = {"camera 1": []}
    for clip in MOTIONS:
        whole = bench.clip(clip)
        frame = first_test_frame(whole) + frames_of(whole)[1] // 2
        rows["camera 1"].append(captured_view(whole, frame))
        for preset in PRESET_NAMES:
            run = runs[cases[preset, "hybrid", clip]][0]
            rows.setdefault(f"preset {preset}", []).append(pose_view(whole, frame, run))
    picture_grid(
        bench.places.out / _name(5), "[Hybrid] Fig. 5: tracking results", rows, list(MOTIONS.values()),
        {"estimated": ESTIMATED, "truth": TRUTH},
    )  # fmt: skip


def _figure_6(bench: Bench, cases: Cases, runs: Runs) -> None:
    """Joint angles over the test frames."""
    panels = []
    for clip, angle, label in ANGLES_SHOWN:
        curves: list[Curve] = []
        for preset in PRESET_NAMES:
            found = _angles(bench, clip, runs[cases[preset, "hybrid", clip]][0], angle)
            if found is None:
                continue
            times_s, truth, estimated = found
            if not curves:
                curves.append(Curve("truth", times_s, truth, "black", "-", 2.2))
            curves.append(Curve(f"preset {preset}", times_s, estimated, PRESET_COLOURS[preset], PRESET_STYLES[preset]))
        panels.append(
            CurvePanel(
                f"{MOTIONS[clip]}: {label}",
                "angle (°)",
                tuple(curves),
                last_label(clip, "time in the test part (s)"),
                zero=False,
            )
        )
    curve_panels(bench.places.out / _name(6), "[Hybrid] Fig. 6: joint angles", panels)


def _angles(bench: Bench, clip: str, run: Run, angle: str) -> tuple[Floats, Floats, Floats] | None:
    """Times in seconds from the first test frame, true and estimated angle in degrees; None without a pose."""
    whole = bench.clip(clip)
    first = first_test_frame(whole)
    if not has_pose(run, first):
        return None
    curves = angle_curves(run_trajectories(run, whole.truth.rate), whole.truth, first)
    return curves.times_s - curves.times_s[0], curves.truth[angle], curves.take[angle]


def _figure_7(bench: Bench, cases: Cases, runs: Runs) -> Table:
    """RMSE of joint angles and of joint positions by motion."""
    found = {
        (preset, clip): clip_errors(bench, clip, runs[cases[preset, "hybrid", clip]])
        for preset in PRESET_NAMES for clip in MOTIONS
    }  # fmt: skip
    series = {f"preset {preset}": [found[preset, clip] for clip in MOTIONS] for preset in PRESET_NAMES}
    paper = {"paper, HumanEva": list(PAPER_RMSE_MM["hybrid"])}  # of the angles it prints no numbers
    bar_panels(
        bench.places.out / _name(7),
        "[Hybrid] Fig. 7: RMSE of each sequence",
        [
            BarPanel(
                "joint angles (°)", tuple(MOTIONS.values()),
                {name: [one.angles.mean for one in each] for name, each in series.items()},
                {name: [one.angles.worst for one in each] for name, each in series.items()},
                digits=1,
            ),
            BarPanel(
                "joint positions (mm)", tuple(MOTIONS.values()),
                {name: [one.rmse.mean for one in each] for name, each in series.items()} | paper,
                {name: [one.rmse.worst for one in each] for name, each in series.items()} | paper,
            ),
        ],
        {f"preset {preset}": PRESET_COLOURS[preset] for preset in PRESET_NAMES} | dict.fromkeys(paper, "tab:gray"),
    )  # fmt: skip
    rows = tuple(
        (MOTIONS[clip], preset, one.angles.mean, one.angles.worst, one.rmse.mean, one.rmse.worst)
        for (preset, clip), one in found.items()
    )
    return Table("Fig. 7: RMSE by sequence", ("motion", "preset", "angles °", "worst", "positions mm", "worst"), rows)


def _figure_9(bench: Bench, cases: Cases, runs: Runs) -> None:
    """RMSE over the joints in every test frame by method."""
    panels = []
    for clip, motion in MOTIONS.items():
        whole = bench.clip(clip)
        curves = []
        for preset in PRESET_NAMES:
            for method in reversed(METHODS):  # the hybrid on top
                run = runs[cases[preset, method, clip]][0]
                frames, values = frame_rmse_mm(whole.truth, first_test_frame(whole), run)
                curves.append(
                    Curve(
                        f"{method}, {preset}",
                        frames.astype(np.float64) - frames[0],
                        values,
                        METHOD_COLOURS[method],
                        PRESET_STYLES[preset],
                        1.3,
                    )
                )
        panels.append(CurvePanel(motion, "RMSE (mm)", tuple(curves), last_label(clip, "test frame"), y_ticks=ERROR_TICKS))
    curve_panels(bench.places.out / _name(9), "[Hybrid] Fig. 9: RMSE of the joint positions", panels)
