"""Pure parts of the tracker's evaluation: figures over seeds, tables, recovery."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.hybrid.accuracy import cases, mediapipe
from benchmarks.hybrid.figures import Summary, figure, frames_until, summary
from benchmarks.hybrid.priors import WALKS, another_take
from benchmarks.hybrid.runs import (
    ANATOMY,
    NAMES,
    Run,
    TrackedPath,
    fixed_prior_fraction,
    frame_errors,
    scored,
    trajectories,
)
from benchmarks.sections import Section, Table, markdown, report, write
from zenocap.common.body.definition import neutral_pose
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.body.average_body import body_of_height
from zenocap.services.tracker.filter import filter_step
from zenocap.tools.recordings.evaluate import Selection, accuracy

NAN = float("nan")
RUN = Run(30.0, 34.0, 12.0, 28.0, 0.0, {"Hip": 20.0}, 0, 63, 9.0, 8.0, 0.5, 100, (30.0, 31.0))
finite = st.floats(0.0, 1e6)


@given(st.lists(finite, min_size=1))
def test_the_worst_is_no_better_than_the_mean(values: list[float]) -> None:
    found = figure(values)
    assert found.worst >= found.mean * (1 - 1e-12)
    assert found.worst in values


def test_seeds_without_a_figure_are_left_out_and_counted() -> None:
    nothing = replace(RUN, mean_mm=NAN, rmse_mm=NAN, shape_mm=NAN, lost_pct=100.0, losses=1, started=-1)
    found = summary([RUN, replace(RUN, mean_mm=40.0, losses=2), nothing])
    assert (found.mean.mean, found.mean.worst) == (35.0, 40.0)
    assert found.lost.worst == 100.0
    assert (found.losses, found.never, found.seeds) == (3, 1, 3)


def test_summary_without_a_run_is_an_error() -> None:
    with pytest.raises(ValueError, match="one or more"):
        summary([])
    assert math.isnan(Summary.missing().mean.mean)
    assert math.isnan(figure([NAN]).worst)


def test_table_is_formatted_as_markdown() -> None:
    table = Table("Error", ("clip", "mean mm", "losses"), (("walk7", 24.96, 0), ("jog7", NAN, 2)))
    assert markdown(table).splitlines() == [
        "**Error**",
        "",
        "| clip | mean mm | losses |",
        "|---|---:|---:|",
        "| walk7 | 25.0 | 0 |",
        "| jog7 | – | 2 |",
    ]


def test_section_is_written_and_the_report_contains_all_sections(tmp_path: Path) -> None:
    table = Table("Error", ("clip", "mean mm"), (("walk7", 24.96), ("jog7", NAN)))
    write(Section("second", "Second", ("How.",), (table,), ("plot.png",)), tmp_path)
    write(Section("first", "First", (), ()), tmp_path)
    page = report(tmp_path, ["first", "second", "third"], "What it reaches").read_text()
    assert page.index("## First") < page.index("## Second") < page.index("![plot.png](plot.png)")
    assert json.loads((tmp_path / "second.json").read_text())["tables"][0]["rows"] == [["walk7", 24.96], ["jog7", None]]
    assert (tmp_path / "second-1.csv").read_text().splitlines() == ["clip,mean mm", "walk7,24.96", "jog7,nan"]


@pytest.mark.parametrize(
    ("errors", "seen", "expected"),
    [
        ((20.0, NAN, NAN, 30.0, 20.0), 103, 1),
        ((20.0, NAN, NAN, 90.0, 50.0, 49.9), 103, 3),
        ((20.0, NAN, NAN, NAN, 90.0), 103, None),
        ((20.0,), 103, None),
    ],
)
def test_frames_until_the_error_is_small(errors: tuple[float, ...], seen: int, expected: int | None) -> None:
    assert frames_until(replace(RUN, errors=errors, first=100), seen, 50.0) == expected


def test_frames_until_the_error_is_small_for_a_while() -> None:
    run = replace(RUN, errors=(90.0, 20.0, 90.0, 20.0, 20.0, 20.0), first=100)
    assert [frames_until(run, 100, 50.0, in_row) for in_row in (1, 2, 3, 4)] == [2, 4, 4, None]


def test_prior_is_not_trained_on_the_motion_of_the_clip() -> None:
    for clip, motion in (("walk7", "002_01.bvh"), ("walk2", "002_02.bvh"), ("kick2", "11_01.bvh")):
        prior = another_take(clip, motion)
        assert prior is not None
        assert "cmu_" + motion.removesuffix(".bvh").removeprefix("0") not in prior.removeprefix("motion:").split("+")
    assert "cmu_02_02" in WALKS
    assert another_take("box7", "002_05.bvh") is None


def test_mediapipe_figures_are_read_from_their_table(tmp_path: Path) -> None:
    path = tmp_path / "mediapipe.md"
    path.write_text(
        "# M\n| clip | mean | RMSE | shape | lost |\n|---|---|---|---|---|\n| real, against `r` | 99.2 | 142.1 | 1 | 2 |\n"
        "| kick2 (new) | 26.8 | 30.6 | 20.6 | 17.8 |\n"
    )
    assert mediapipe(path) == {"real": (99.2, 142.1, 1.0, 2.0), "kick2": (26.8, 30.6, 20.6, 17.8)}
    assert mediapipe(tmp_path / "none.md") == {}


def test_every_clip_is_tracked_with_and_without_a_prior() -> None:
    wanted = cases()
    with_prior = {replace(key, prior="") for key, case in wanted.items() if case.prior}
    assert with_prior == {replace(key, prior="") for key, case in wanted.items() if not case.prior}
    assert {key.views for key in wanted} == {"7", "4", "3", "2"}
    assert {key.size for key in wanted if key.views == "2"} == {"640x480", "160x120"}


def test_clips_and_kinds_of_prior_can_be_selected() -> None:
    wanted = cases(("none",), ("jump2",))
    assert {(key.clip, key.size) for key in wanted} == {("jump2", "640x480"), ("jump2", "160x120")}
    assert not any(case.prior for case in wanted.values())


def test_the_prior_fraction_is_fixed_inside_the_context_only() -> None:
    before = filter_step.PRIOR_FRACTION, filter_step.MIN_PRIOR_FRACTION, filter_step.MAX_PRIOR_FRACTION
    with fixed_prior_fraction(1.0):
        assert (filter_step.PRIOR_FRACTION, filter_step.MIN_PRIOR_FRACTION, filter_step.MAX_PRIOR_FRACTION) == (
            1.0,
            1.0,
            1.0,
        )
    with fixed_prior_fraction(None):
        assert before == (filter_step.PRIOR_FRACTION, filter_step.MIN_PRIOR_FRACTION, filter_step.MAX_PRIOR_FRACTION)


def path_of(frames: list[int], shift: float) -> TrackedPath:
    body = body_of_height(1.75)
    poses = {k: (body, neutral_pose(ANATOMY, np.array([shift, 0.9, 0.01 * k]), yaw=0.02 * k)) for k in frames}
    return TrackedPath(poses, (4,), {k: 2.0 for k in range(10)}, {k: 1.0 for k in range(10)})


def truth_of(frames: list[int]) -> Trajectories:
    empty = np.zeros((0, len(NAMES), 3))
    rate_only = Trajectories(NAMES, np.array(frames), np.zeros(len(frames)), empty, 60.0)
    return replace(trajectories(path_of(frames, 0.0), rate_only), rate=60.0)


def test_frames_without_a_pose_are_lost() -> None:
    found = scored(path_of([3, 4, 6, 7], 0.03), truth_of(list(range(10))), 2)
    assert found.mean_mm == pytest.approx(30.0)
    assert found.lost_pct == pytest.approx(50.0)
    assert np.isnan(found.errors).tolist() == [True, False, False, True, False, False, True, True]
    assert (found.first, found.losses, found.started, found.wall_ms, found.cpu_ms) == (2, 1, 3, 2.0, 1.0)


def test_run_without_any_pose_is_completely_lost() -> None:
    found = scored(TrackedPath({}, (), {5: 1.0}, {5: 1.0}), truth_of(list(range(10))), 2)
    assert (found.lost_pct, found.losses, found.started, found.errors) == (100.0, 1, -1, ())
    assert math.isnan(found.mean_mm)


def test_errors_by_frame_have_the_scorers_mean() -> None:
    track, truth = trajectories(path_of([0, 1, 2, 3], 0.05), truth_of([0, 1, 2, 3])), truth_of([0, 1, 2, 3])
    _, errors = frame_errors(track, truth)
    assert errors.mean() == pytest.approx(accuracy(track, truth, Selection()).mpjpe_mm)
