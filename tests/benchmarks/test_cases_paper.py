"""The paper's experiments: protocol, plots."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.cases.clips import take_prior
from benchmarks.cases.paper import LIMB_ANGLES, TABLE_2, angle_curves, angle_rmse_deg, with_true_angles
from benchmarks.people.tracker import ANATOMY, TrackedPath, errors, trajectories
from benchmarks.pictures.plots import BarPanel, CurvePanel, PlottedCurve, bar_panels, curve_panels, picture_grid
from zenocap.common.body.definition import neutral_pose
from zenocap.services.tracker.body.average_body import body_of_height

NAN = float("nan")
FIRST = 4


def test_angles_are_compared_from_the_first_test_frame_on() -> None:
    body = body_of_height(1.75)
    path = TrackedPath({k: (body, neutral_pose(ANATOMY, np.array([0.0, 0.9, 0.01 * k]), yaw=0.02 * k)) for k in range(12)})
    truth = trajectories(path, 60.0)
    curves = angle_curves(trajectories(path, 60.0, FIRST), truth, FIRST)
    assert set(LIMB_ANGLES) <= set(curves.truth)
    assert curves.times_s[0] == pytest.approx(FIRST / 60.0)
    assert angle_rmse_deg(curves) < 1e-6


def test_true_angles_on_another_body_have_only_the_error_of_the_body() -> None:
    bodies = body_of_height(1.75), body_of_height(1.85)
    path, other = (TrackedPath({k: (body, neutral_pose(ANATOMY, np.zeros(3))) for k in range(3)}) for body in bodies)
    truth = trajectories(path, 60.0)
    assert errors(with_true_angles(path, truth), truth, 0)["RMSE"] < 1.0
    assert 10.0 < errors(with_true_angles(other, truth), truth, 0)["RMSE"] < 60.0


@pytest.mark.parametrize(
    ("frames", "paper", "name"), [(100, False, "take:x/100"), (100, True, "take:x/100@20"), (43, True, "take:x/43@10")]
)
def test_the_papers_prior_has_twenty_regions_where_there_are_enough_frames(frames: int, paper: bool, name: str) -> None:
    assert take_prior("x", frames, paper=paper) == name


def test_table_2_has_all_methods_under_both_presets_on_frames_that_train_nothing() -> None:
    assert {(one.option("preset", ""), one.option("method", "")) for one in TABLE_2.cases.values()} == {
        (preset, method) for preset in ("default", "paper") for method in ("hybrid", "image-force", "particle-filter")
    }
    assert all(one.option("test", False) for one in TABLE_2.cases.values())


@pytest.mark.nightly
def test_plots_are_small_files_even_with_gaps(tmp_path: Path) -> None:
    x, y = np.arange(1.0, 41.0), np.where(np.arange(40) == 20, math.nan, np.arange(40) + 20.0)
    panel = CurvePanel(
        "walking", "RMSE (mm)", (PlottedCurve("one", x, y, "tab:blue"),), "frame", (1, 10, 40), (20, 50, 100)
    )
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
