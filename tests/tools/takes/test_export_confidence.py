"""Confidence of limbs in exports and in Python: columns, blanks, and what has none."""

import csv
from pathlib import Path

import ezc3d
import numpy as np
import pytest

import zenocap
from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.built_messages import built
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.joint_conventions import CONVENTIONS, Convention, limb_of, points_of
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.errors import UserError
from zenocap.common.formats.trc import read_trc
from zenocap.services.tracker.body.average_body import average_body
from zenocap.tools.takes.export import ExportOptions, export

COUNT, BAD = 6, 3
LIMBS = ("right_arm", "left_arm", "right_leg", "left_leg")


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A take of the tracker whose left arm is uncertain in one frame."""
    camera = messages_of_track(moving(2))[0]
    body = body_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
    angles = angles_by_name(FOURTEEN_PARTS, neutral_pose(FOURTEEN_PARTS, np.zeros(3)).angles)
    found: list[m.Message] = [camera, m.TrackerBdp(frame=0, captured_ns=START_NS, body=body)]
    for frame in range(COUNT):
        limbs = dict.fromkeys(LIMBS, 0.9) | ({"left_arm": 0.2} if frame == BAD else {})
        captured_ns, position = START_NS + round(frame * 1e9 / 30), (0.1 * frame, 0.9, 0.0)
        found.append(
            built(
                m.TrackerPose, frame=frame, captured_ns=captured_ns, position=position, angles=angles, views=["1"],
                limbs=limbs, lost_limbs=["left_arm"] if frame == BAD else [], heading=0.97,
            )
        )  # fmt: skip
    return write_take(tmp_path_factory.mktemp("tracked") / "take.mcap", found)


def test_csv_has_a_column_for_each_limb_and_names_the_lost_ones(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "take.csv", ExportOptions("csv"))
    with (tmp_path / "take.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["confidence.left_arm"]) for row in rows] == [0.9] * BAD + [0.2] + [0.9] * (COUNT - BAD - 1)
    assert [row["lost"] for row in rows] == [""] * BAD + ["left_arm"] + [""] * (COUNT - BAD - 1)
    assert rows[BAD]["LWrist.x_m"] != ""


@pytest.mark.parametrize("joints", CONVENTIONS)
def test_points_of_an_uncertain_limb_are_blank_where_asked_for(tracked: Path, tmp_path: Path, joints: Convention) -> None:
    output = tmp_path / "take.trc"
    export(tracked, output, ExportOptions("trc", joints=joints, min_confidence=0.5))
    found = read_trc(output)
    arm = [k for k, name in enumerate(found.names) if limb_of(name) == "left_arm"]
    assert len(arm) == 2
    missing = np.isnan(found.points).any(axis=2)
    expected = np.zeros_like(missing)
    expected[BAD, arm] = True
    np.testing.assert_array_equal(missing, expected)


def test_c3d_marks_points_of_an_uncertain_limb_as_missing(tracked: Path, tmp_path: Path) -> None:
    export(tracked, tmp_path / "take.c3d", ExportOptions("c3d", min_confidence=0.5))
    residuals = ezc3d.c3d(str(tmp_path / "take.c3d"))["data"]["meta_points"]["residuals"][0]
    assert np.count_nonzero(residuals < 0) == 2


def test_every_limb_has_points_in_every_convention() -> None:
    for joints in CONVENTIONS:
        limbs = [limb_of(point.name) for point in points_of(joints, FOURTEEN_PARTS)]
        assert set(limbs) - {None} == set(LIMBS)
        assert limbs.count("right_arm") == limbs.count("left_arm") == 2
        assert limbs.count("right_leg") == limbs.count("left_leg")


def test_python_gives_the_confidence(tracked: Path) -> None:
    poses = zenocap.open_take(tracked).poses()
    assert set(poses.limbs) == set(LIMBS)
    assert poses.limbs["left_arm"][BAD] == 0.2


def test_a_take_without_confidence_is_refused_where_it_is_asked_for(tmp_path: Path) -> None:
    take = write_take(tmp_path / "take.mcap", messages_of_track(moving(COUNT)))
    assert zenocap.open_take(take).poses().limbs == {}
    with pytest.raises(UserError, match="the take states none: allowed with takes of the tracker"):
        export(take, tmp_path / "sure.trc", ExportOptions("trc", min_confidence=0.9))
    assert not (tmp_path / "sure.trc").exists()


def test_formats_without_points_refuse(tracked: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"bvh has no points to leave out: allowed in trc, c3d, csv, parquet, npz"):
        export(tracked, tmp_path / "take.bvh", ExportOptions("bvh", min_confidence=0.5))
