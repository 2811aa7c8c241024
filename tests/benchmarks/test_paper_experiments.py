"""The paper's experiments: protocol, errors on the test frames, plots."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hybrid.experiments import (
    LIMB_ANGLES,
    METHODS,
    PRESET_NAMES,
    angle_curves,
    case_of,
    errors_of,
    frame_rmse_mm,
    has_pose,
    take_prior,
)
from benchmarks.hybrid.figures import Figure, with_worst
from benchmarks.hybrid.paper_figures import NUMBERS
from benchmarks.hybrid.paper_plots import BarPanel, Curve, CurvePanel, bar_panels, curve_panels, picture_grid
from benchmarks.hybrid.runs import ANATOMY, NAMES, Run, TrackedPath, run_trajectories, scored, trajectories
from tests.support.places import ROOT
from zenocap.common.body.definition import neutral_pose
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.body.average_body import body_of_height

NAN = float("nan")
FIRST = 4
FRAMES = list(range(12))
LOST = (6, 9)


def path_of(frames: list[int], shift: float = 0.0) -> TrackedPath:
    body = body_of_height(1.75)
    poses = {k: (body, neutral_pose(ANATOMY, np.array([shift, 0.9, 0.01 * k]), yaw=0.02 * k)) for k in frames}
    return TrackedPath(poses, (), dict.fromkeys(FRAMES, 2.0), dict.fromkeys(FRAMES, 1.0))


def truth() -> Trajectories:
    rate_only = Trajectories(NAMES, np.array(FRAMES), np.zeros(len(FRAMES)), np.zeros((0, len(NAMES), 3)), 60.0)
    return trajectories(path_of(FRAMES), rate_only)


def run_of(shift: float = 0.03) -> Run:
    return scored(path_of([k for k in FRAMES if k not in LOST], shift), truth(), 2)


def never() -> Run:
    return scored(TrackedPath({}, (), {}, {}), truth(), 2)


def test_joint_centres_of_a_run_are_those_of_its_path() -> None:
    found = run_trajectories(run_of(), 60.0)
    assert found.frames.tolist() == [k for k in FRAMES if k >= 2 and k not in LOST]
    assert found.points == pytest.approx(truth().points[found.frames] + (0.03, 0.0, 0.0), abs=1e-4)


def test_run_without_a_pose_has_no_joint_centres() -> None:
    assert not has_pose(never(), FIRST)
    with pytest.raises(ValueError, match="without a pose"):
        run_trajectories(never(), 60.0)


def test_errors_are_of_the_test_frames() -> None:
    found = errors_of(truth(), FIRST, [run_of(), run_of(0.05)])
    assert (found.rmse.mean, found.rmse.worst) == pytest.approx((40.0, 50.0), abs=0.1)
    assert found.shape.worst < 15.0  # the person turns, the offset does not
    assert found.lost.worst == pytest.approx(100.0 * len(LOST) / (len(FRAMES) - FIRST))
    assert found.angles.worst < 0.5  # rounded joint centres


def test_seed_without_a_pose_is_lost_and_nothing_else() -> None:
    found = errors_of(truth(), FIRST, [run_of(), never()])
    assert found.rmse.worst == pytest.approx(30.0, abs=0.1)
    assert found.lost.worst == 100.0


def test_frames_without_a_pose_have_no_error() -> None:
    frames, values = frame_rmse_mm(truth(), FIRST, run_of())
    assert frames.tolist() == FRAMES[FIRST:]
    assert [int(frame) for frame in frames[np.isnan(values)]] == list(LOST)
    assert np.nanmax(values) == pytest.approx(30.0, abs=0.1)
    assert np.isnan(frame_rmse_mm(truth(), FIRST, never())[1]).all()


def test_angles_are_compared_from_the_first_test_frame_on() -> None:
    curves = angle_curves(run_trajectories(run_of(), 60.0), truth(), FIRST)
    assert set(LIMB_ANGLES) <= set(curves.truth)
    assert curves.times_s[0] == pytest.approx(FIRST / 60.0)


@pytest.mark.parametrize(
    ("frames", "preset", "name"),
    [(100, "default", "take:x/100"), (100, "paper", "take:x/100@20"), (43, "paper", "take:x/43@10")],
)
def test_the_papers_prior_has_twenty_regions_where_there_are_enough_frames(frames: int, preset: str, name: str) -> None:
    assert take_prior("x", frames, preset) == name


def test_cases_have_the_defaults_of_their_preset() -> None:
    every = {(preset, method): case_of("walk7", preset, method, "walking") for preset in PRESET_NAMES for method in METHODS}
    assert {case.particles for case in every.values()} == {40, 1, 1000}
    assert {case.refinement for (preset, _), case in every.items() if preset == "paper"} == {"force-printed"}
    assert {method for (_, method), case in every.items() if case.prior} == {"hybrid"}


def test_the_worst_seed_is_in_brackets() -> None:
    assert with_worst(Figure(12.34, 15.0)) == "12.3 (15.0)"
    assert with_worst(Figure(12.34, 12.34)) == "12.3"
    assert with_worst(Figure(NAN, NAN)) == "–"


@pytest.mark.nightly
def test_plots_are_small_files_even_with_gaps(tmp_path: Path) -> None:
    x, y = np.arange(1.0, 41.0), np.where(np.arange(40) == 20, math.nan, np.arange(40) + 20.0)
    panel = CurvePanel("walking", "RMSE (mm)", (Curve("one", x, y, "tab:blue"),), "frame", (1, 10, 40), (20, 50, 100))
    curve_panels(tmp_path / "curves.png", "Curves", [panel, replace(panel, x_ticks=None, y_ticks=None)])
    values = {"one": (1.0, NAN), "two": (2.0, 3.0)}
    bars = BarPanel("mm", ("walking", "jogging"), values, {"one": (1.5, NAN), "two": (2.0, 4.0)})
    bar_panels(tmp_path / "bars.png", "Bars", [bars], {"one": "tab:blue", "two": "tab:orange"})
    image = np.full((30, 20, 3), 200, np.uint8)
    picture_grid(
        tmp_path / "grid.png", "Pictures", {"a": [image] * 3, "b": [image] * 3}, ["1", "2", "3"], {"truth": "#ff0000"}
    )
    for name in ("curves", "bars", "grid"):
        written = (tmp_path / f"{name}.png").read_bytes()
        assert written.startswith(b"\x89PNG")
        assert len(written) < 100_000


def test_documented_figures_are_small_and_shown() -> None:
    page = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")
    for number in NUMBERS:
        assert f"(papers/figure-{number}.png)" in page
        assert 0 < (ROOT / "docs" / "papers" / f"figure-{number}.png").stat().st_size < 100_000
