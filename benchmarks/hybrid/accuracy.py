"""Error of the joint centres against ground truth, by clip and by number of views."""

import re
from pathlib import Path

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import COLUMNS, figure, summary
from benchmarks.hybrid.plots import Panel, Series, bars, panels
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import NAMES, Case, Run, run_trajectories
from benchmarks.mesh_joints import in_mesh_convention
from benchmarks.sections import Row, Section, Table
from zenocap.common.formats.trajectories import Trajectories
from zenocap.tools.recordings.evaluate import Selection
from zenocap.tools.recordings.evaluate import accuracy as errors

# Paper (replaced): [Hybrid VI] tests on HumanEva; here on rendered meshes moved by motion capture.
SEVEN = ("walk7", "jog7", "box7")
TWO = ("walk2", "bend2", "kick2")
VIEWS: dict[str, tuple[str, ...]] = {
    "7": (), "4": ("cam01", "cam03", "cam05", "cam07"), "3": ("cam01", "cam03", "cam05")
}  # fmt: skip
PAPER_RMSE = {"walk7": 8.57, "jog7": 16.77, "box7": 30.75}
AIMS = {"walk7": (25.0, 10.0), "jog7": (25.0, 13.0), "box7": (25.0, 16.0)}  # mean, shape (mm); with seven views
PRIORS = ("shipped", "none")
TOP_MM = 150.0


def cases() -> dict[tuple[str, str, str], Case]:
    """Cases by clip, number of views and prior."""
    found = {}
    for prior in PRIORS:
        for clip in SEVEN:
            for number, views in VIEWS.items():
                found[clip, number, prior] = Case(clip, views=views, prior=_prior(clip, prior))
        for clip in TWO:
            found[clip, "2", prior] = Case(clip, prior=_prior(clip, prior))
    return found


def accuracy(bench: Bench) -> Section:
    selected = cases()
    runs = bench.runs(list(selected.values()))
    rows: list[Row] = []
    joints: list[Row] = []
    conventions: list[Row] = []
    others = mediapipe(bench.places.clips / "mediapipe.md")
    for (clip, number, prior), case in selected.items():
        found = summary(runs[case])
        aim = AIMS.get(clip) if number == "7" else None
        rows.append(
            (
                f"{clip}, {number} views, prior {case.prior or 'none'}",
                *found.cells(),
                "" if aim is None else f"{aim[0]:g} / {aim[1]:g}",
            )
        )
        joint_errors = [figure([run.per_joint_mm.get(name, float("nan")) for run in runs[case]]).mean for name in NAMES]
        if prior == PRIORS[0]:
            joints.append((f"{clip}, {number} views", *joint_errors))
            in_mesh = figure([mesh_mean_mm(run, bench.clip(clip).truth) for run in runs[case]])
            conventions.append((f"{clip}, {number} views", found.mean.mean, in_mesh.mean, in_mesh.worst))
    comparison: list[Row] = [
        (clip, *others.get(clip, (float("nan"),) * 4), PAPER_RMSE.get(clip, float("nan")))
        for clip in (*SEVEN, *TWO)
    ]  # fmt: skip
    notes = (
        f"{bench.seeds} seeds, 40 particles, 400 points, 4 iterations; scored from the first frame of motion as "
        "`score_trc.py` does.  Shape: RMSE without each joint's constant offset.  Losses: over all seeds; never: seeds "
        "without any pose.",
        "MediaPipe: all views, every frame, triangulated (14 joints).  The paper: other people and another studio, a body "
        "measured from markers.",
    )
    return Section(
        "accuracy",
        "Accuracy",
        notes,
        (
            Table("Error by clip, views and prior", ("clip", *COLUMNS, "aim mean / shape"), tuple(rows)),
            Table(
                "MediaPipe on the same clips, and the paper on its own recordings",
                ("clip", "MediaPipe mean mm", "RMSE", "shape", "lost %", "paper's RMSE"),
                tuple(comparison),
            ),
            Table("Mean error by joint, shipped prior, mm", ("clip", *NAMES), tuple(joints)),
            Table(
                "Mean error in the joint convention of the truth (mesh_joints), shipped prior, mm",
                ("clip", "our joints", "the mesh's joints", "worst"),
                tuple(conventions),
            ),
        ),
        _drawn(bench, selected, runs, others),
    )


def _drawn(
    bench: Bench,
    selected: dict[tuple[str, str, str], Case],
    runs: dict[Case, list[Run]],
    others: dict[str, tuple[float, ...]],
) -> tuple[str, str]:
    """Bars of all cases, and errors over time with the shipped prior."""
    groups = list(dict.fromkeys((clip, number) for clip, number, _ in selected))
    found = {key: summary(runs[case]).mean for key, case in selected.items()}
    nan = float("nan")
    mediapipe_means = [others[clip][0] if clip in others and number in "72" else nan for clip, number in groups]
    means = {f"prior {prior}": [found[*group, prior].mean for group in groups] for prior in PRIORS}
    worst = {f"prior {prior}": [found[*group, prior].worst for group in groups] for prior in PRIORS}
    bars(
        bench.places.out / "accuracy.png",
        f"Mean error (whiskers: worst seed; cut off at {TOP_MM:g} mm; no bar: never tracked)",
        "mean error, mm",
        [f"{clip}\n{number} views" for clip, number in groups],
        means | {"MediaPipe, all views": mediapipe_means},
        worst | {"MediaPipe, all views": mediapipe_means},
        TOP_MM,
    )
    clip_panels = [
        Panel(
            clip, "frame", "mean error, mm",
            tuple(_over_time(f"{n} views", runs[selected[clip, n, PRIORS[0]]]) for one, n in groups if one == clip),
            top=TOP_MM, marks=False,
        )
        for clip in (*SEVEN, *TWO)
    ]  # fmt: skip
    panels(
        bench.places.out / "accuracy-frames.png",
        "Error by frame, shipped prior (filled: up to the worst seed)",
        clip_panels,
    )
    return "accuracy.png", "accuracy-frames.png"


def _over_time(name: str, runs: list[Run]) -> Series:
    """Error by frame, over the seeds."""
    known = [run for run in runs if run.errors]
    if not known:
        return Series(f"{name}: never tracked", (), ())
    curves = [figure(values) for values in zip(*(run.errors for run in known), strict=True)]
    frames = tuple(float(known[0].first + k) for k in range(len(curves)))
    return Series(name, frames, tuple(one.mean for one in curves), tuple(one.worst for one in curves))


def mesh_mean_mm(run: Run, truth: Trajectories) -> float:
    """Mean error of a run after conversion to the joint convention of the truth, mm; NaN without a pose."""
    if not any(run.centres_mm):
        return float("nan")
    return errors(in_mesh_convention(run_trajectories(run, truth.rate)), truth, Selection()).mpjpe_mm


def mediapipe(path: Path) -> dict[str, tuple[float, ...]]:
    """Mean, RMSE, shape in millimetres and lost % by clip, from the table beside the clips; empty without it."""
    if not path.is_file():
        return {}
    found = {}
    for line in path.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if len(cells) == 5 and re.fullmatch(r"[\d.]+", cells[1]):
            found[cells[0].split(",")[0]] = tuple(map(float, cells[1:]))
    return found


def _prior(clip: str, prior: str) -> str:
    return KINDS[clip] if prior == "shipped" else ""
