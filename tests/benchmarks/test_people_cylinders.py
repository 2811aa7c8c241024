"""People made of cylinders: exact silhouettes, motion that repeats; and the cases of the replication."""

from itertools import product
from unittest.mock import Mock

import numpy as np
import pytest

from benchmarks.cases import replication
from benchmarks.cases.paper import METHODS, PAPER_RMSE_MM
from benchmarks.cases.replication import CAUSES, FEWER, HEADING, LAWS, PEOPLE, REPLICATION, T_POSE, TRUE_POSE, setup_of
from benchmarks.harness.case import case
from benchmarks.people import cylinders
from benchmarks.people.cylinders import CIRCLE_M, COUNTS, CYCLE_FPS, CYCLE_S, MOTIONS, REGIONS, TEST_FRAMES, silhouette
from benchmarks.people.cylinders import _cycle as cycle
from benchmarks.people.simulated_clips import cameras_of
from tests.support.two_view_scene import BDP, angles
from zenocap.common.arrays import Bools, Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.simulation.body.person import person

STEPS = np.arange(2.5, 7.0, 0.002)  # m along a line of sight


def inside(body: Bdp, pose: Pose, points: Floats) -> Bools:
    """(n,) whether points (n, 3) are in a cylinder with flat ends."""
    found = np.zeros(len(points), dtype=bool)
    for frame, (height, long, short) in zip(part_frames(TEN_PARTS, body, pose), body.sizes, strict=True):
        x, y, z = ((points - frame[:, 3]) @ frame[:, :3]).T
        found |= (y >= 0) & (y <= height) & ((x / long) ** 2 + (z / short) ** 2 <= 1)
    return found


@pytest.mark.parametrize("view", ["r0", "r3"])
def test_a_silhouette_has_the_pixels_whose_lines_of_sight_meet_a_cylinder(view: str) -> None:
    camera, rng = cameras_of(7)[view], np.random.default_rng(1)
    pose = Pose(np.array([0.1, 0.95, -0.1]), angles(right_shoulder_z=130.0, left_shoulder_x=40.0, right_knee_x=-30.0))
    mask = silhouette(camera, BDP, pose)
    rows, columns = np.nonzero(mask)
    places = rng.integers([columns.min() - 2, rows.min() - 2], [columns.max() + 3, rows.max() + 3], (150, 2))
    slopes = np.column_stack([places, np.ones(len(places))]) @ np.linalg.inv(camera.matrix).T @ camera.rotation
    seen = [
        bool(inside(BDP, pose, camera.centre + STEPS[:, None] * (slope / np.linalg.norm(slope))).any()) for slope in slopes
    ]
    assert np.mean(seen == (mask[places[:, 1], places[:, 0]] > 0)) > 0.98  # the steps may miss what a line grazes
    assert 0.2 < np.mean(seen) < 0.8


def test_a_short_motion_goes_on_without_a_leap() -> None:
    time = np.arange(90) / CYCLE_FPS
    rows = np.column_stack([np.zeros((90, 3)), *(np.sin(6.0 * time + phase) for phase in range(4)), 0.05 * time])
    found = cycle(rows, 400)
    assert found.shape == (400, rows.shape[1])
    assert np.abs(np.diff(found, axis=0)).max() < 1.5 * np.abs(np.diff(rows, axis=0)).max()
    apart = np.linalg.norm(found[round(CYCLE_S * CYCLE_FPS) :, 3:] - found[0, 3:], axis=1)
    assert apart.min() < 0.05  # it does come back


def test_the_way_is_a_circle_walked_forwards_at_the_speed_of_the_file() -> None:
    rows, velocity = np.zeros((200, 6)), np.array([0.012, -0.016])
    found = cylinders._on_circle(rows, velocity)
    assert np.linalg.norm(found[:, [0, 2]], axis=1) == pytest.approx(CIRCLE_M)
    steps = np.diff(found[:, :3], axis=0)
    assert np.linalg.norm(steps, axis=1) == pytest.approx(0.02, rel=1e-3)
    assert steps[0, [0, 2]] / 0.02 == pytest.approx(velocity / 0.02, abs=0.02)
    turn = np.empty((3, 3))
    vector_to_matrix(found[100, 3:6], turn)  # of a person who looks along the velocity first
    assert turn @ [0.6, 0.0, -0.8] == pytest.approx(steps[100] / 0.02, abs=0.02)
    assert np.array_equal(cylinders._on_circle(rows, 0.2 * velocity), rows)


def test_the_prior_is_of_other_frames_than_the_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both are a period of a short file, repeated; the frames that differ are counted."""
    time = np.arange(90)[:, None]
    rows = np.concatenate([np.zeros((90, 6)), 1e-3 * (time + np.sin(time * np.pi / 15 + np.arange(19)))], axis=1)
    monkeypatch.setattr(cylinders, "captured_rows", lambda path, body: (rows, np.array([0.0, 0.02])))
    monkeypatch.setattr(cylinders, "_pose", lambda body, row: Pose(row[:3], row[3:]))
    monkeypatch.setattr(cylinders, "_standing", lambda body, pose: pose)
    halves = cylinders._training_and_test.__wrapped__("jogging", PEOPLE[0])
    monkeypatch.setattr(cylinders, "_training_and_test", lambda motion, seed: halves)
    training, tested = (np.array([pose.angles[3] for pose in poses]) for poses in halves)
    assert (len(training), len(tested)) == (100, TEST_FRAMES["jogging"])
    assert training.max() < tested.min()
    for name, value in {"clip_of": Mock(), "tracked": Mock(), "errors": lambda *_: {}}.items():
        monkeypatch.setattr(replication, name, value)
    assert [replication.run(case("jogging", same=same))["training"] for same in (False, True)] == [30, 30]


def test_the_person_faces_the_side_that_the_method_is_given_and_has_the_ends_of_the_case() -> None:
    """Ten parts have no feet: without the side, the front of the T-pose is chance."""
    clip = Mock(film=Mock(cameras={}, frame_ns=1))
    first = cylinders._opening(BDP, Pose(np.array([0.3, 1.0, 0.0]), angles(navel_y=140.0)))[0]
    front = RootedPose.of(TEN_PARTS, BDP, first).rotation[:, 2]
    for name, one in REPLICATION.selected(["image-force"]).items():
        options = setup_of(one, clip).options
        assert options.heading == (HEADING if T_POSE in name else None)
        assert options.filter.ends == ("round" if "round ends" in name else "flat")
    assert front == pytest.approx([np.sin(HEADING), 0.0, np.cos(HEADING)], abs=1e-6)


def test_the_replication_has_all_methods_laws_and_starts_and_the_papers_table_has_its_numbers_of_frames() -> None:
    changed = {"trained", "regions", *(name for options in CAUSES.values() for name in options)}
    own = [one for one in REPLICATION.cases.values() if not changed & set(dict(one.options))]
    cases = [(one.option("method", ""), one.option("law", ""), one.option("start", "")) for one in own]
    expected = {(name, law, start) for name in METHODS[:2] for law in LAWS for start in (T_POSE, TRUE_POSE)}
    assert set(cases) == expected | {(METHODS[2], "", start) for start in (T_POSE, TRUE_POSE)}
    whole = [(one.option("method", ""), one.option("start", ""), one.film) for one in own if one.option("tested", 0) == 0]
    assert set(whole) == set(product(METHODS, (T_POSE, TRUE_POSE), MOTIONS))
    true_pose = sum(start == TRUE_POSE for _, _, start in set(cases))
    assert len(own) == (len(set(cases)) + true_pose) * len(MOTIONS)  # from the true pose with both numbers of frames
    assert len(whole) == (len(METHODS) + true_pose) * len(MOTIONS)  # from the T-pose with the printed force
    assert {one.option("tested", 0) for one in own} == {0, FEWER}
    assert all(("all frames" in name) == (one.option("tested", 0) == 0) for name, one in REPLICATION.cases.items())
    assert all(one.option("trained", one.film) != one.film for one in REPLICATION.selected(["unfamiliar"]).values())
    counts = {one.option("regions", REGIONS) for one in REPLICATION.cases.values()}
    assert counts == set(COUNTS)
    assert set(PAPER_RMSE_MM) == set(METHODS)
    assert TEST_FRAMES == {"walking": 433, "jogging": 393, "boxing": 377}
    assert len(PEOPLE) == REPLICATION.seeds
    assert all(1.5 < person(seed).height < 1.9 for seed in PEOPLE)
