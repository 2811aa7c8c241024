"""Errors of joint angles: definitions, pairing, round trips, the command's outputs."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.common.formats.test_mot import ANGLES as REFERENCE
from tests.common.formats.test_mot import HEADER, ROWS
from tests.support.angle_cases import take_of, walking_person
from tests.support.command import zenocap
from tests.tools.teach.dataset.test_generate import TAKE as POSTURE
from tests.tools.teach.dataset.test_generate import short_timeline
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.clinical_angles import within_half_a_turn
from zenocap.common.errors import UserError
from zenocap.common.formats.angle_series import AngleSeries
from zenocap.common.formats.pose_track import Bound
from zenocap.tools.takes.evaluate import ScoredFrames
from zenocap.tools.takes.evaluate_angles import ONE_TRUNK, SOLUTIONS_NOTE, AngleAccuracy, compared, error_of
from zenocap.tools.takes.pairing import paired_rows
from zenocap.tools.teach.dataset.generate import dataset_rig, generate_take

ALL = ScoredFrames()
TAKE, TRUTH = Path("walk.mcap"), Path("angles.mot")
BOTH = (TEN_PARTS, FOURTEEN_PARTS)
MOST_DEG = 0.5  # largest RMS error of a round trip


def series(knee: Floats, *, rate: float = 50.0, start: int = 0, known: Floats | None = None, **more: Floats) -> AngleSeries:
    frames = np.arange(start, start + len(knee), dtype=np.int64)
    present = np.ones(len(knee), dtype=bool) if known is None else known.astype(bool)
    return AngleSeries(frames, frames / rate, present, {"knee_flexion_r": knee, **more}, rate)


def errors(take: AngleSeries, truth: AngleSeries, selection: ScoredFrames = ALL) -> AngleAccuracy:
    return compared(take, truth, selection, TAKE, TRUTH)[0]


def evaluated(take: Path, truth: Path, *options: object) -> dict[str, Any]:
    """What the command prints as JSON."""
    status, text, problems = zenocap("evaluate", take, "--truth", truth, *options, "--json")
    assert status == 0, problems
    found: dict[str, Any] = json.loads(text)
    return found


def test_errors_are_those_of_their_definitions() -> None:
    truth = np.array([0.0, 10.0, 20.0, 30.0])
    take = truth + np.array([2.0, 4.0, 2.0, 4.0])
    found = error_of(take, truth)
    assert (found.frames, found.mae_deg, found.bias_deg, found.rms_unbiased_deg) == (4, 3.0, 3.0, 1.0)
    assert found.rms_deg == pytest.approx(np.sqrt(10.0))
    assert (found.range_truth_deg, found.range_take_deg) == (30.0, 32.0)
    assert found.correlation == pytest.approx(np.corrcoef(truth, take)[0, 1])
    assert found.rms_deg**2 == pytest.approx(found.bias_deg**2 + found.rms_unbiased_deg**2)


def test_a_constant_angle_has_no_correlation() -> None:
    assert error_of(np.array([1.0, 2.0]), np.array([5.0, 5.0])).correlation is None
    assert error_of(np.array([1.0]), np.array([5.0])).correlation is None


def test_differences_are_within_half_a_turn_and_curves_continuous() -> None:
    truth = np.array([160.0, 175.0, -170.0, -155.0])
    take = np.array([165.0, -180.0, -165.0, -150.0])
    found, curves = compared(series(take), series(truth), ALL, TAKE, TRUTH)
    error = found.angles["knee_flexion_r"]
    assert (error.mae_deg, error.bias_deg) == (5.0, 5.0)
    assert (error.range_truth_deg, error.range_take_deg) == (45.0, 45.0)
    np.testing.assert_allclose(curves.truth["knee_flexion_r"], [160.0, 175.0, 190.0, 205.0])
    np.testing.assert_allclose(within_half_a_turn(np.array([190.0, -190.0, 10.0])), [-170.0, 170.0, 10.0])


def test_the_solution_of_the_shoulder_nearer_to_the_truth_is_compared_which_is_noted() -> None:
    """Flexion 100, adduction -60 and rotation 20 are the same rotation as -80, -120 and -160."""
    names = ("shoulder_flexion_r", "shoulder_adduction_r", "shoulder_rotation_r")
    knee, known = np.zeros(5), np.arange(5) < 4
    one, other = ((100.0, -60.0, 20.0), (-80.0, -120.0, -160.0))
    take = series(knee, known=known, **{name: np.full(5, value) for name, value in zip(names, one, strict=True)})
    truth = series(knee, **{name: np.r_[a, b, a, a, b] for name, a, b in zip(names, one, other, strict=True)})
    found = errors(take, truth)
    assert [found.angles[name].rms_deg for name in names] == [0.0, 0.0, 0.0]
    assert found.notes == (f"{SOLUTIONS_NOTE} in 25.0% of the rows",)
    assert errors(take, take).notes == ()


def test_rows_without_pose_are_not_compared_and_their_share_is_stated() -> None:
    knee = np.arange(10.0)
    take = series(knee + 1.0, known=np.arange(10) != 3)
    truth = series(knee, known=(np.arange(10) != 3) & (np.arange(10) != 7))
    found = errors(take, truth)
    assert found.frames == found.angles["knee_flexion_r"].frames == 8
    assert (found.without_pose_pct, found.take_lost_pct, found.truth_lost_pct) == (20.0, 10.0, 20.0)


def test_a_take_shorter_than_the_truth_has_no_pose_in_the_rest() -> None:
    found = errors(series(np.arange(8.0)), series(np.arange(10.0)))
    assert (found.frames, found.take_lost_pct) == (8, 20.0)


def test_undefined_and_missing_angles_are_listed_with_a_reason() -> None:
    knee = np.arange(4.0)
    take = series(knee, hip_rotation_r=np.full(4, np.nan), elbow_flexion_l=knee)
    truth = series(knee, hip_rotation_r=knee, ankle_dorsiflexion_r=knee)
    found = errors(take, truth)
    assert list(found.angles) == ["knee_flexion_r"]
    assert found.not_compared["hip_rotation_r"] == "defined in no common frame"
    assert found.not_compared["elbow_flexion_l"] == "not in the truth"
    assert found.not_compared["ankle_dorsiflexion_r"] == "not in the take"
    assert found.not_compared["pelvis_tilt"] == "in neither"


def test_from_until_every_and_offset_select_frames_of_the_truth() -> None:
    truth, take = series(np.arange(20.0), start=5), series(np.arange(20.0), start=8)
    assert errors(take, truth, ScoredFrames(offset=3)).angles["knee_flexion_r"].rms_deg == 0.0
    assert errors(take, truth).angles["knee_flexion_r"].bias_deg == -3.0
    assert errors(take, truth, ScoredFrames(first=Bound(10), last=Bound(14))).frames == 5
    assert errors(take, truth, ScoredFrames(first=Bound(0.2, True), last=Bound(0.3, True))).frames == 6
    assert errors(take, truth, ScoredFrames(first=Bound(10), every=5)).frames == 3


@pytest.mark.parametrize(("rate", "count"), [(25.0, 20), (50.0, 39), (100.0, 39), (60.0, 39), (29.97, 23)])
def test_series_of_different_rates_are_paired_by_time(rate: float, count: int) -> None:
    """Angles that rise by 10 degrees a second: the error is that of the nearest sample, at most half an interval."""
    truth_times = np.arange(39) / 50.0
    times = np.arange(int(np.ceil(0.77 * rate))) / rate
    found = errors(series(10.0 * times, rate=rate), series(10.0 * truth_times))
    assert abs(found.frames - count) <= 1
    assert found.without_pose_pct <= 100.0 * 1 / count + 1e-9
    assert found.angles["knee_flexion_r"].mae_deg <= 10.0 * 0.5 / max(rate, 50.0) + 1e-6


def test_each_instant_of_the_slower_series_is_paired_with_the_nearest_within_half_an_interval() -> None:
    slow, fast = np.array([0.0, 0.1, 0.2, 0.3]), np.array([0.0, 0.02, 0.04, 0.06, 0.08, 0.101, 0.12, 0.3])
    one, other = paired_rows(slow, fast)
    assert (one.tolist(), other.tolist()) == ([0, 1, 2, 3], [0, 5, -1, 7])
    one, other = paired_rows(fast, slow)
    assert (one.tolist(), other.tolist()) == ([0, 5, -1, 7], [0, 1, 2, 3])


@pytest.mark.parametrize(
    ("changed", "doubt"),
    [
        (lambda knee: {"knee": knee[15:60], "other": 20.0 - knee[15:60]}, "with --offset 15 "),
        (lambda knee: {"knee": 20.0 - knee, "other": knee}, "with left and right of the truth exchanged "),
        (lambda knee: {"knee": np.radians(knee), "other": np.radians(20.0 - knee)}, "with the truth times 57.3 "),
        (lambda knee: {"knee": knee + 5.0, "other": 20.0 - knee}, None),
    ],
    ids=["offset", "sides", "radians", "bias"],
)
def test_a_truth_of_another_offset_side_or_unit_is_doubted(
    changed: Callable[[Floats], dict[str, Floats]], doubt: str | None
) -> None:
    knee = np.cumsum(np.random.default_rng(1).uniform(-25.0, 25.0, 80))
    truth = changed(knee)
    found = errors(series(knee, knee_flexion_l=20.0 - knee), series(truth["knee"], knee_flexion_l=truth["other"]))
    assert found.doubts == () if doubt is None else found.doubts[0].startswith(f"{doubt}the mean error is 0 degrees")


def test_series_without_a_common_instant_pose_or_angle_are_errors() -> None:
    knee = np.arange(4.0)
    text = r"no frame of walk\.mcap \(0\.000 to 0\.060 s at 50/s\) .* angles\.mot \(1\.000 to 1\.060 s at 50/s\): check"
    with pytest.raises(UserError, match=text):
        errors(series(knee), series(knee, start=50))
    with pytest.raises(UserError, match="no pose in the same frame"):
        errors(series(knee, known=np.array([1, 0, 0, 0])), series(knee, known=np.array([0, 1, 1, 1])))
    with pytest.raises(UserError, match="no joint angle in common"):
        errors(series(knee), replace(series(knee), angles={"neck_flexion": knee}))
    text = r"angles\.mot: --from, --until and --every leave no frame: allowed: of frames 0 to 3"
    with pytest.raises(UserError, match=text):
        errors(series(knee), series(knee), ScoredFrames(first=Bound(9)))


@pytest.mark.nightly
def test_a_tracked_simulated_person_is_compared_with_the_take_of_the_true_poses(tmp_path: Path) -> None:
    timeline = short_timeline(6.0)
    for method in ("truth", "hybrid"):
        generate_take(dataset_rig(method), method, timeline, POSTURE.room, tmp_path / f"{method}.mcap")
    found = evaluated(tmp_path / "hybrid.mcap", tmp_path / "truth.mcap")
    assert found["truth_lost_pct"] == 0.0
    assert found["notes"][0] == ONE_TRUNK
    shoulder = found["angles"]["shoulder_elevation_r"]
    assert shoulder["range_truth_deg"] > 60.0
    assert shoulder["rms_deg"] < 6.0
    assert shoulder["correlation"] > 0.99


@pytest.fixture(scope="module", params=BOTH, ids=lambda a: a.name)
def walk(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A take of the simulated person walking; beside it its exports walk.bvh, walk.mot and walk.trc."""
    anatomy: Anatomy = request.param
    path = take_of(tmp_path_factory.mktemp("walk") / "walk.mcap", walking_person(anatomy, 30, lost=(11,)))
    for suffix in (".bvh", ".mot", ".trc"):
        status, _, text = zenocap("export", path, "-o", path.with_suffix(suffix))
        assert status == 0, text
    return path


@pytest.mark.nightly
@pytest.mark.parametrize("suffix", [".bvh", ".mot", ".trc", ".mcap"])
def test_an_export_evaluated_against_its_take_has_no_error(walk: Path, suffix: str) -> None:
    found = evaluated(walk, walk.with_suffix(suffix), "--angles")
    assert found["frames"] == 29
    assert found["take_lost_pct"] == pytest.approx(100.0 / 30 if suffix != ".mot" else 0.0)
    assert {"hip_flexion_r", "knee_flexion_l", "shoulder_elevation_r", "elbow_flexion_l"} <= set(found["angles"])
    assert max(error["rms_deg"] for error in found["angles"].values()) < MOST_DEG
    assert min(error["correlation"] for name, error in found["angles"].items() if "knee" in name) > 0.999


@pytest.mark.slow
def test_the_table_has_a_row_for_each_angle_and_the_convention(walk: Path) -> None:
    status, text, _ = zenocap("evaluate", walk, "--truth", walk.with_suffix(".bvh"))
    lines = text.splitlines()
    assert status == 0
    assert lines[0] == "frames 29; without pose 3.3 % (take 3.3 %, truth 0.0 %)"
    assert lines[1].split() == ["degrees", "frames", "mae", "rms", "bias", "rms-bias", "range", "truth", "take", "r"]
    (knee,) = (line.split() for line in lines if line.startswith("knee_flexion_r"))
    assert knee[1:5] == ["29", "0.0", "0.0", knee[4]]
    assert float(knee[6]) > 10.0
    assert lines[-1].startswith("convention: degrees; joint coordinate systems of the ISB")
    assert any(line.startswith("not compared, defined in no common frame: ") for line in lines)


@pytest.mark.slow
def test_two_takes_of_different_bodies_are_compared_as_the_poorer_one(tmp_path: Path) -> None:
    ten, fourteen = (take_of(tmp_path / f"{one.name}.mcap", walking_person(one, 20)) for one in BOTH)
    for take, truth in ((ten, fourteen), (fourteen, ten)):
        found = evaluated(take, truth)
        assert "pelvis_tilt" not in found["angles"]
        assert found["angles"]["knee_flexion_r"]["rms_deg"] < 1.0
        assert found["angles"]["hip_flexion_l"]["rms_deg"] < 3.0


@pytest.mark.slow
def test_a_cut_take_is_reported_on_either_side(walk: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(walk.read_bytes()[:-100])
    for take, truth in ((walk, cut), (cut, walk)):
        status, text, problems = zenocap("evaluate", take, "--truth", truth)
        assert status == 3
        assert text.startswith("frames ")
        assert "lost: " in problems
        assert "cut.mcap" in problems


@pytest.mark.slow
def test_joint_centres_of_two_takes_and_of_a_skeleton_are_compared(walk: Path) -> None:
    for suffix in (".trc", ".bvh", ".mcap"):
        options = ["--centres"] if suffix != ".trc" else []
        assert evaluated(walk, walk.with_suffix(suffix), *options)["mpjpe_mm"] < 1.0, suffix


@pytest.mark.nightly
def test_the_picture_shows_a_plot_for_each_angle(walk: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    status, _, problems = zenocap("evaluate", walk, "--truth", walk.with_suffix(".mot"), "--plot", tmp_path / "a.png")
    assert status == 0, problems
    image = cv2.imread(str(tmp_path / "a.png"))
    assert image is not None
    assert image.shape[0] > 1000
    red = (image[:, :, 2] > 180) & (image[:, :, 1] < 90)
    assert red.any()


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        (["--truth", "walk.trc", "--plot", "a.png"], 2, "--plot a.png: draws joint angles: allowed: with --angles"),
        (["--truth", "walk.mot", "--centres"], 1, "suffix '.mot': allowed for joint centres: .bvh, .trc, .c3d, .mcap"),
        (["--truth", "walk.csv"], 1, "suffix '.csv': allowed for joint angles: .mot, .bvh, .trc, .c3d, .mcap"),
        (["--truth", "walk.mot", "--plot", "a.txt"], 1, "--plot a.txt: suffix '.txt': allowed: .png, .jpg, .pdf, .svg"),
        (["--truth", "walk.mot", "--plot", "none/a.png"], 1, "none/a.png: there is no folder none: allowed: a file"),
        (["--truth", "walk.mot", "--offset", "5000"], 1, "within half an interval of a selected one of walk.mot"),
        (["--truth", "none.mot"], 1, "none.mot: cannot be read: No such file"),
        (["--truth", "nan.mot"], 1, "nan.mot: line 7: hip_flexion_r = 'nan': allowed: a finite number"),
    ],
)
def test_errors_are_one_line(
    walk: Path, monkeypatch: pytest.MonkeyPatch, options: list[str], status: int, message: str
) -> None:
    monkeypatch.chdir(walk.parent)
    Path("nan.mot").write_text(HEADER + ROWS.replace("3.0", "nan"))
    found, _, text = zenocap("evaluate", "walk.mcap", *options)
    assert found == status, text
    assert message in " ".join(text.replace("│", " ").split())


@pytest.mark.slow
def test_rows_left_out_of_a_mot_file_are_reported(walk: Path, tmp_path: Path) -> None:
    status, text, note = zenocap("export", walk, "-o", tmp_path / "a.mot", "--axes", "opensim")
    assert status == 0
    assert "a.mot: 30 frames, 0 to 29, 30/s, m, opensim" in text
    assert "note: 1 frames without pose: left out" in note


@pytest.mark.clips
def test_inverse_kinematics_of_opensim_agrees_with_the_key_points_it_was_computed_from(tmp_path: Path) -> None:
    """Angles of real_beam4 from OpenSim against those from triangulated key points: the same signs and ranges."""
    from zenocap.common.formats.angle_series import angle_series, read_source

    centres = REFERENCE.parent.parent / "reference.trc"
    one = angle_series(read_source(centres), centres, rigid_trunk=True)
    other = angle_series(read_source(REFERENCE), REFERENCE, rigid_trunk=True)
    found = compared(one, other, ALL, centres, REFERENCE)[0]
    assert found.frames == 100
    limits = {
        "knee_flexion": 9.0, "hip_flexion": 7.0, "hip_adduction": 9.0, "shoulder_elevation": 9.0, "elbow_flexion": 20.0,
    }  # fmt: skip
    for name, limit in limits.items():
        for side in ("r", "l"):
            assert found.angles[f"{name}_{side}"].rms_deg < limit, (name, side, found.angles[f"{name}_{side}"])
    assert found.angles["trunk_lateral_lean"].correlation > 0.99
