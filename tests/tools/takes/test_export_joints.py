"""Exported points: joint conventions, joints of the spine, missing points, confidence of limbs."""

import csv
import json
from pathlib import Path

import ezc3d
import numpy as np
import pytest

import zenocap
from tests.support.command import zenocap as run
from tests.support.export_takes import BODY, LIMBS, LOST, UNSURE, tracked_poses
from tests.support.places import GOLDEN
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.joint_conventions import CONVENTIONS, Convention, limb_of, points_of
from zenocap.common.body.keypoints import keypoints
from zenocap.common.body.kinematics import part_frames
from zenocap.common.errors import UserError
from zenocap.common.formats.trc import read_trc
from zenocap.tools.takes.export import ExportOptions, export

FEET = ("RBigToe", "RSmallToe", "RHeel", "LBigToe", "LSmallToe", "LHeel")
SPINE_NAMES = ("Pelvis", "Spine", "Thorax", "UpperNeck")
BENDS = ("Spine", "UpperNeck")


def points_in(path: Path) -> tuple[list[str], Floats]:
    """Names, and places (n, points, 3) in metres, as ezc3d, pandas, NumPy and the own reader of TRC find them."""
    if path.suffix == ".trc":
        data = read_trc(path)
        return list(data.names), data.points
    if path.suffix == ".c3d":
        file = ezc3d.c3d(str(path))
        point = file["parameters"]["POINT"]
        assert point["UNITS"]["value"] == ["mm"]
        return list(point["LABELS"]["value"]), file["data"]["points"][:3].transpose(2, 1, 0) / 1000.0
    if path.suffix == ".npz":
        arrays = np.load(path)
        return arrays["joint_names"].tolist(), arrays["joint_centres_m"]
    pandas = pytest.importorskip("pandas")
    table = pandas.read_csv(path) if path.suffix == ".csv" else pandas.read_parquet(path)
    names = [key[:-4] for key in table.columns if key.endswith(".x_m") and not key.startswith("navel")]
    return names, np.stack([table[[f"{name}.{axis}_m" for axis in "xyz"]].to_numpy() for name in names], axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("joints", CONVENTIONS)
@pytest.mark.parametrize(
    "to", ["trc", "c3d", "csv", *(pytest.param(to, marks=pytest.mark.nightly) for to in ("parquet", "npz"))]
)
@pytest.mark.parametrize("spine", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_every_format_has_the_points_of_the_convention(
    joints: Convention, to: str, spine: bool, tracked: Path, tmp_path: Path
) -> None:
    """And the joints of the spine after them, against the frames of the parts."""
    path = tmp_path / f"a.{to}"
    status, _, err = run("export", tracked, "-o", path, "--joints", joints, *(["--spine"] if spine else []))
    assert (status, "left out" in err) == (0, False)
    body = keypoints(joints, FOURTEEN_PARTS, BODY)
    joints_at = [FOURTEEN_PARTS.index[part] for part in ("pelvis", "chest", "neck_column", "head") if spine]
    expected = np.array(
        [[*body.at(pose), *part_frames(FOURTEEN_PARTS, BODY, pose)[joints_at, :, 3]] for pose in tracked_poses()]
    )
    expected[LOST] = np.nan
    names, points = points_in(path)
    assert names == [*body.names, *(SPINE_NAMES if spine else ())]
    np.testing.assert_allclose(points, expected, atol=2e-6)
    if to == "npz":
        assert json.loads(str(np.load(path)["metadata"]))["spine"] is spine


def test_c3d_describes_which_points_are_derived(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "a.c3d", ExportOptions("c3d", joints="halpe", spine=True))
    point = ezc3d.c3d(str(tmp_path / "a.c3d"))["parameters"]["POINT"]
    described = dict(zip(point["LABELS"]["value"], point["DESCRIPTIONS"]["value"], strict=True))
    assert (described["RHeel"], described["RWrist"]) == ("HALPE-26 RHeel, derived", "HALPE-26 RWrist, share")
    assert (described["Spine"], described["UpperNeck"]) == ("spine Spine, share", "spine UpperNeck, measured")


@pytest.mark.parametrize("to", ["trc", "c3d", "csv", "bvh"])
@pytest.mark.parametrize("take", ["two_view", "tracked"])
def test_the_default_is_zenocaps_convention_byte_for_byte(
    to: str, take: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    path: Path = request.getfixturevalue(take)
    written = []
    for number, options in enumerate([ExportOptions(to), ExportOptions(to, joints="zenocap")]):
        (tmp_path / str(number)).mkdir()
        export(path, tmp_path / str(number) / "a", options)
        written.append((tmp_path / str(number) / "a").read_bytes())
    assert written[0] == written[1]


@pytest.mark.parametrize(
    ("options", "lacks", "missing"),
    [
        (["--joints", "halpe"], "no feet", FEET),
        (["--joints", "isb", "--spine"], "no joint in the spine", BENDS),
        (["--joints", "halpe", "--spine"], "no feet and no joint in the spine", (*FEET, *BENDS)),
    ],
)
def test_points_that_the_body_lacks_are_named_in_one_line(
    options: list[str], lacks: str, missing: tuple[str, ...], two_view: Path, tmp_path: Path
) -> None:
    status, _, err = run("export", two_view, "-o", tmp_path / "a.trc", *options)
    notes = [line for line in err.splitlines() if "left out" in line]
    assert (status, notes) == (0, [f"note: the take's body has {lacks}: left out: {', '.join(missing)}"])
    names = read_trc(tmp_path / "a.trc").names
    assert not set(missing) & set(names)
    assert (names[-2:] == ("Pelvis", "Thorax")) is ("--spine" in options)


@pytest.mark.slow
def test_a_take_is_evaluated_in_the_convention_of_the_truth(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "truth.trc", ExportOptions("trc", joints="halpe"))
    arguments = ("evaluate", tracked, "--truth", tmp_path / "truth.trc", "--json")
    other, same = (json.loads(run(*arguments, *extra)[1]) for extra in ((), ("--joints", "halpe")))
    assert (other["joints"], same["joints"]) == (15, 26)
    assert same["mpjpe_mm"] == pytest.approx(0.0, abs=1e-3)
    assert other["mpjpe_mm"] > 10.0
    status, _, err = run(*arguments, "--joints", "halpe", "--angles")
    assert (status, "--joints halpe" in err) == (2, True)


@pytest.mark.parametrize(
    ("joints", "spine", "smooth"),
    [*((joints, False, None) for joints in CONVENTIONS), ("coco", True, None), ("coco", True, 6.0)],
)
def test_arrays_of_a_take_have_the_points_of_its_export(
    joints: Convention, spine: bool, smooth: float | None, tracked: Path, tmp_path: Path
) -> None:
    take = zenocap.open_take(tracked)
    exported = take.export(tmp_path / "a.trc", joints=joints, spine=spine, smooth=smooth)
    data, poses = read_trc(tmp_path / "a.trc"), take.poses(joints=joints, spine=spine, smooth=smooth)
    assert (exported.left_out, poses.joint_names) == ((), data.names)
    assert (poses.joint_names[-4:] == SPINE_NAMES) is spine
    np.testing.assert_allclose(poses.joint_centres, data.points, atol=1e-6)
    if not spine:
        parts = [part.joint_centres for part in take.chunks(5, joints=joints)]
        np.testing.assert_array_equal(np.concatenate(parts), poses.joint_centres)


def test_a_take_without_feet_has_the_other_points() -> None:
    take = zenocap.open_take(GOLDEN / "arms.mcap")
    found = take.poses(joints="halpe")
    assert (len(found.joint_names), take.joint_names) == (20, take.poses().joint_names)
    assert set(found.joint_names) == {point.name for point in points_of("halpe", FOURTEEN_PARTS)} - set(FEET)


def test_an_unknown_convention_is_an_error_of_the_python_interface(tmp_path: Path) -> None:
    take = zenocap.open_take(GOLDEN / "arms.mcap")
    with pytest.raises(ValueError, match="joints = 'body25': allowed: zenocap, isb, coco, halpe"):
        take.poses(joints="body25")  # type: ignore[arg-type]  # that is the test
    with pytest.raises(UserError, match=r"a\.trc: joints 'body25': allowed: zenocap, isb, coco, halpe"):
        take.export(tmp_path / "a.trc", joints="body25")  # type: ignore[arg-type]  # that is the test


def test_csv_has_a_column_for_each_limb_and_names_the_lost_ones(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "take.csv", ExportOptions("csv"))
    with (tmp_path / "take.csv").open() as file:
        rows = list(csv.DictReader(file))
    for number, row in enumerate(rows):
        assert float(row["confidence.left_arm"]) == (0.2 if number == UNSURE else 0.9)
        assert row["lost"] == {UNSURE: "left_arm", LOST: "person"}.get(number, "")
    assert rows[UNSURE]["LWrist.x_m"] != ""


@pytest.mark.parametrize("joints", CONVENTIONS)
def test_points_of_an_uncertain_limb_are_blank_where_asked_for(tracked: Path, tmp_path: Path, joints: Convention) -> None:
    output = tmp_path / "take.trc"
    export(tracked, output, ExportOptions("trc", joints=joints, min_confidence=0.5))
    found = read_trc(output)
    arm = [k for k, name in enumerate(found.names) if limb_of(name) == "left_arm"]
    assert len(arm) == 2
    missing = np.isnan(found.points).any(axis=2)
    expected = np.zeros_like(missing)
    expected[UNSURE, arm] = expected[LOST] = True
    np.testing.assert_array_equal(missing, expected)


def test_c3d_marks_points_of_an_uncertain_limb_as_missing(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "take.c3d", ExportOptions("c3d", min_confidence=0.5))
    residuals = ezc3d.c3d(str(tmp_path / "take.c3d"))["data"]["meta_points"]["residuals"][0]
    assert np.count_nonzero(residuals[:, UNSURE] < 0) == 2


def test_every_limb_has_points_in_every_convention() -> None:
    for joints in CONVENTIONS:
        limbs = [limb_of(point.name) for point in points_of(joints, FOURTEEN_PARTS)]
        assert set(limbs) - {None} == set(LIMBS)
        assert limbs.count("right_arm") == limbs.count("left_arm") == 2
        assert limbs.count("right_leg") == limbs.count("left_leg")


def test_python_gives_the_confidence_of_takes_that_state_it(tracked: Path, two_view: Path) -> None:
    poses = zenocap.open_take(tracked).poses()
    assert set(poses.limbs) == set(LIMBS)
    assert poses.limbs["left_arm"][UNSURE] == 0.2
    assert zenocap.open_take(two_view).poses().limbs == {}
