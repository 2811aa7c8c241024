"""Exports in joint conventions: names, units, places; missing points."""

import csv
import json
from pathlib import Path

import ezc3d
import numpy as np
import pytest

import zenocap
from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.built_messages import built
from tests.support.command import zenocap as run
from tests.support.places import GOLDEN
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.joint_conventions import CONVENTIONS, Convention, points_of
from zenocap.common.body.keypoints import keypoints
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.errors import UserError
from zenocap.common.formats.trc import read_trc
from zenocap.services.tracker.body.average_body import average_body
from zenocap.tools.takes.export import ExportOptions, export

FEET = ("RBigToe", "RSmallToe", "RHeel", "LBigToe", "LSmallToe", "LHeel")
SPINE_NAMES = ("Pelvis", "Spine", "Thorax", "UpperNeck")
COUNT, LOST = 12, 5
BODY = average_body(FOURTEEN_PARTS, 1.75)


def poses() -> list[Pose]:
    """Poses near the T-pose of a person who moves to the left."""
    random = np.random.default_rng(3)
    start = t_pose_angles(FOURTEEN_PARTS)
    return [Pose(np.array([0.1 * k, 0.9, 0.0]), start + random.uniform(-0.3, 0.3, len(start))) for k in range(COUNT)]


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A take of the tracker, with feet; the person is lost in one frame."""
    camera = messages_of_track(moving(2))[0]
    body = body_of(FOURTEEN_PARTS, BODY)
    found: list[m.Message] = [camera, m.TrackerBdp(frame=0, captured_ns=START_NS, body=body)]
    for frame, pose in enumerate(poses()):
        x, y, z = pose.position.tolist()
        found.append(
            built(
                m.TrackerPose, frame=frame, captured_ns=START_NS + round(frame * 1e9 / 30), position=(x, y, z),
                angles=angles_by_name(FOURTEEN_PARTS, pose.angles), lost=frame == LOST, views=["1"],
            )
        )  # fmt: skip
    return write_take(tmp_path_factory.mktemp("tracked") / "take.mcap", found)


@pytest.fixture(scope="module")
def two_view(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_take(tmp_path_factory.mktemp("two-view") / "take.mcap", messages_of_track(moving(COUNT)))


@pytest.mark.slow
@pytest.mark.parametrize("joints", CONVENTIONS)
@pytest.mark.parametrize("to", ["trc", "c3d", "csv"])
def test_every_format_has_the_points_of_the_convention(joints: Convention, to: str, tracked: Path, tmp_path: Path) -> None:
    path = tmp_path / f"a.{to}"
    status, _, err = run("export", tracked, "-o", path, "--joints", joints)
    assert (status, "left out" in err) == (0, False)
    body = keypoints(joints, FOURTEEN_PARTS, BODY)
    expected = np.array([body.at(pose) for pose in poses()])
    expected[LOST] = np.nan
    if to == "trc":
        data = read_trc(path)
        names, points = data.names, data.points
    elif to == "c3d":
        file = ezc3d.c3d(str(path))
        names, unit = tuple(file["parameters"]["POINT"]["LABELS"]["value"]), file["parameters"]["POINT"]["UNITS"]["value"]
        points = file["data"]["points"][:3].transpose(2, 1, 0) / {"mm": 1000.0}[unit[0]]
    else:
        rows = list(csv.DictReader(path.open()))
        names = tuple(key[:-4] for key in rows[0] if key.endswith(".x_m") and not key.startswith("navel"))
        points = np.array([[[float(row[f"{name}.{a}_m"] or "nan") for a in "xyz"] for name in names] for row in rows])
    assert names == body.names
    np.testing.assert_allclose(points, expected, atol=2e-6)


def test_c3d_describes_which_points_are_derived(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "a.c3d", ExportOptions("c3d", joints="halpe"))
    point = ezc3d.c3d(str(tmp_path / "a.c3d"))["parameters"]["POINT"]
    described = dict(zip(point["LABELS"]["value"], point["DESCRIPTIONS"]["value"], strict=True))
    assert described["RHeel"] == "HALPE-26 RHeel, derived"
    assert described["RWrist"] == "HALPE-26 RWrist, share"


@pytest.mark.nightly
@pytest.mark.parametrize("joints", CONVENTIONS)
@pytest.mark.parametrize("to", ["trc", "c3d", "csv", "parquet", "npz"])
def test_joints_of_the_spine_follow_the_points_of_the_convention(
    joints: Convention, to: str, tracked: Path, tmp_path: Path
) -> None:
    """Names and places as ezc3d, pandas, NumPy and the own reader of TRC find them, against the frames of the parts."""
    path = tmp_path / f"a.{to}"
    status, _, err = run("export", tracked, "-o", path, "--joints", joints, "--spine")
    assert (status, "left out" in err) == (0, False)
    if to == "trc":
        data = read_trc(path)
        names, points = list(data.names), data.points
    elif to == "c3d":
        file = ezc3d.c3d(str(path))
        point = file["parameters"]["POINT"]
        names, points = list(point["LABELS"]["value"]), file["data"]["points"][:3].transpose(2, 1, 0) / 1e3
        described = dict(zip(names, point["DESCRIPTIONS"]["value"], strict=True))
        assert (described["Spine"], described["UpperNeck"]) == ("spine Spine, share", "spine UpperNeck, measured")
    elif to == "npz":
        arrays = np.load(path)
        names, points = arrays["joint_names"].tolist(), arrays["joint_centres_m"]
        assert json.loads(str(arrays["metadata"]))["spine"] is True
    else:
        pandas = pytest.importorskip("pandas")
        table = pandas.read_csv(path) if to == "csv" else pandas.read_parquet(path)
        names = [key[:-4] for key in table.columns if key.endswith(".x_m") and not key.startswith("navel")]
        points = np.stack([table[[f"{name}.{axis}_m" for axis in "xyz"]].to_numpy() for name in names], axis=1)
    assert names == [*keypoints(joints, FOURTEEN_PARTS, BODY).names, *SPINE_NAMES]
    for row, pose in enumerate(poses()):
        at = dict(zip(FOURTEEN_PARTS.parts, part_frames(FOURTEEN_PARTS, BODY, pose)[:, :, 3], strict=True))
        expected = [at["pelvis"], at["chest"], at["neck_column"], at["head"]]
        if row == LOST:
            assert np.isnan(points[row, -4:]).all()
        else:
            np.testing.assert_allclose(points[row, -4:], expected, atol=2e-6)


@pytest.mark.slow
def test_a_body_without_a_bend_in_the_spine_has_its_other_joints(two_view: Path, tmp_path: Path) -> None:
    for joints, missing, text in (
        ("isb", ["Spine", "UpperNeck"], "no joint in the spine"),
        ("halpe", [*FEET, "Spine", "UpperNeck"], "no feet and no joint in the spine"),
    ):
        status, _, err = run("export", two_view, "-o", tmp_path / "a.trc", "--joints", joints, "--spine")
        assert (status, err) == (0, f"note: the take's body has {text}: left out: {', '.join(missing)}\n")
        assert read_trc(tmp_path / "a.trc").names[-2:] == ("Pelvis", "Thorax")


@pytest.mark.parametrize("smooth", [None, 6.0])
def test_arrays_of_a_take_have_the_joints_of_the_spine(smooth: float | None, tracked: Path, tmp_path: Path) -> None:
    take = zenocap.open_take(tracked)
    take.export(tmp_path / "a.trc", joints="coco", spine=True, smooth=smooth)
    data, found = read_trc(tmp_path / "a.trc"), take.poses(joints="coco", spine=True, smooth=smooth)
    assert (found.joint_names, found.joint_names[-4:]) == (data.names, SPINE_NAMES)
    np.testing.assert_allclose(found.joint_centres, data.points, atol=1e-6)


@pytest.mark.parametrize("to", ["trc", "c3d", "csv"])
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


def test_points_that_the_body_lacks_are_named_in_one_line(two_view: Path, tmp_path: Path) -> None:
    status, _, err = run("export", two_view, "-o", tmp_path / "a.trc", "--joints", "halpe")
    assert (status, err) == (0, f"note: the take's body has no feet: left out: {', '.join(FEET)}\n")
    assert not set(FEET) & set(read_trc(tmp_path / "a.trc").names)


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


@pytest.mark.slow
@pytest.mark.parametrize("to", ["bvh", "mot", "glb"])
@pytest.mark.parametrize(("options", "words"), [(["--spine"], "spine"), (["--joints", "halpe"], "joints halpe")])
def test_formats_without_points_refuse_them(
    to: str, options: list[str], words: str, two_view: Path, tmp_path: Path
) -> None:
    status, out, err = run("export", two_view, "-o", tmp_path / f"a.{to}", *options)
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert err.rstrip().endswith(f"a.{to}: {words}: {to} has no points: allowed in trc, c3d, csv, parquet, npz")
    assert list(tmp_path.iterdir()) == []
    assert run("export", two_view, "-o", tmp_path / f"a.{to}", "--joints", "zenocap")[0] == 0


@pytest.mark.parametrize("joints", CONVENTIONS)
def test_arrays_of_a_take_have_the_convention_of_its_export(joints: Convention, tracked: Path, tmp_path: Path) -> None:
    take = zenocap.open_take(tracked)
    exported = take.export(tmp_path / "a.trc", joints=joints)
    data, poses_ = read_trc(tmp_path / "a.trc"), take.poses(joints=joints)
    assert (exported.left_out, poses_.joint_names) == ((), data.names)
    np.testing.assert_allclose(poses_.joint_centres, data.points, atol=1e-6)
    parts = list(take.chunks(5, joints=joints))
    np.testing.assert_array_equal(np.concatenate([part.joint_centres for part in parts]), poses_.joint_centres)


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
