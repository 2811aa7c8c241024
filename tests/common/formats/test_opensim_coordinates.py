"""OpenSim's coordinates: round trips, and directions as from key points."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_mot import ANGLES
from tests.support.angle_cases import posed, track_of_angles, walking_person
from tests.support.places import CLIPS
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.clinical_angles import clinical_angles, joint_rotations
from zenocap.common.body.rotations import unit
from zenocap.common.errors import UserError, file_notes
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.mot import Mot, read_mot
from zenocap.common.formats.opensim_coordinates import VERTEBRAE, coordinates_of, export_mot, rotations_of
from zenocap.common.formats.trajectories import Axes
from zenocap.common.formats.trc import read_trc

PATH = Path("angles.mot")
BOTH = (TEN_PARTS, FOURTEEN_PARTS)


def mot(columns: dict[str, Floats | list[float]], in_degrees: bool = True) -> Mot:
    values = {name: np.asarray(column, dtype=np.float64) for name, column in columns.items()}
    count = len(next(iter(values.values())))
    return Mot(np.arange(count) / 60.0, values, in_degrees, 60.0)


@pytest.mark.parametrize("axes", ["opensim", "y-up"])
@pytest.mark.parametrize("anatomy", BOTH, ids=lambda a: a.name)
def test_coordinates_of_a_walk_give_its_angles_back(anatomy: Anatomy, axes: Axes) -> None:
    track = walking_person(anatomy, 20)
    _, columns = coordinates_of(track, axes)
    rotations, notes = rotations_of(mot(columns), PATH)
    found, expected = clinical_angles(rotations), clinical_angles(joint_rotations(anatomy, track.angles))
    assert notes == ()
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, atol=1e-6, err_msg=name)


def test_coordinates_are_in_degrees_with_opensims_signs() -> None:
    changes = {
        "right_knee.x": -30, "left_knee.x": -40, "right_hip.x": 25, "left_hip.z": -10, "right_ankle.x": 12,
        "left_elbow.x": 50, "right_shoulder.x": 35, "waist.x": 20, "neck.x": 8,
    }  # fmt: skip
    angles = posed(FOURTEEN_PARTS, changes)
    _, found = coordinates_of(track_of_angles(FOURTEEN_PARTS, np.zeros((1, 3)), angles))
    expected = {
        "knee_angle_r": 30, "knee_angle_l": 40, "hip_flexion_r": 25, "hip_adduction_l": 10, "ankle_angle_r": 12,
        "elbow_flex_l": 50, "arm_flex_r": 35, "lumbar_extension": -20, "neck_flexion": -8,
    }  # fmt: skip
    for name, (value,) in found.items():
        if not name.startswith("pelvis_t"):
            assert value == pytest.approx(expected.get(name, 0.0), abs=1e-9), name
    assert found["pelvis_tilt"][0] == pytest.approx(0.0, abs=1e-9)


def test_a_person_who_faces_x_of_opensim_has_no_pelvis_rotation() -> None:
    track = track_of_angles(FOURTEEN_PARTS, np.array([[1.0, 0.95, 2.0]]), posed(FOURTEEN_PARTS, {}))
    _, found = coordinates_of(track, "opensim")
    assert found["pelvis_rotation"][0] == pytest.approx(0.0, abs=1e-9)
    position = [found[f"pelvis_t{axis}"][0] for axis in "xyz"]
    np.testing.assert_allclose(position, [2.0, 0.93, -1.0], atol=1e-9)  # the hips of this body are 2 cm below the navel
    _, found = coordinates_of(track, "y-up")
    assert found["pelvis_rotation"][0] == pytest.approx(-90.0, abs=1e-9)


BEYOND = "a.mcap: beyond the ranges of Rajagopal's models, to which OpenSim clamps them: {}: set their `clamped` to false"


@pytest.mark.parametrize(
    ("turn_deg", "to_m", "raised_deg", "note"),
    [
        (170.0, 1.0, 80.0, "pelvis_rotation from 0 to 170 degrees (-90 to 90)"),
        (800.0, 1.0, 80.0, "pelvis_rotation from -360 to 440 degrees (-90 to 90)"),
        (80.0, 4.0, 80.0, "pelvis_tz from -4 to 0 m (-3 to 3)"),
        (85.0, 2.9, 150.0, "arm_flex_r in 100% of the rows"),
        (90.5, 3.005, 80.0, ""),
    ],
)
def test_coordinates_that_leave_the_ranges_of_the_model_give_a_note(
    tmp_path: Path, turn_deg: float, to_m: float, raised_deg: float, note: str
) -> None:
    """A person who faces X of OpenSim turns to the left and goes there; the angle goes on beyond a full turn."""
    angles = np.tile(posed(FOURTEEN_PARTS, {"right_shoulder.x": raised_deg}), (61, 1))
    angles[:, FOURTEEN_PARTS.index["navel.y"]] += np.radians(np.linspace(0.0, turn_deg, 61))
    track = track_of_angles(FOURTEEN_PARTS, np.linspace([0.0, 0.95, 0.0], [to_m, 0.95, 0.0], 61), angles)
    shown: list[str] = []
    with file_notes(shown.append):
        export_mot(tmp_path / "a.mot", ExportRequest(track, axes="opensim", take="a.mcap"))
    assert shown == ([BEYOND.format(note)] if note else [])


def test_rows_without_pose_are_left_out_and_other_axes_an_error() -> None:
    track = walking_person(TEN_PARTS, 6, lost=(2, 3))
    times_s, columns = coordinates_of(track)
    np.testing.assert_allclose(times_s, np.array([0, 1, 4, 5]) / 30.0)
    assert all(len(column) == 4 for column in columns.values())
    with pytest.raises(ValueError, match="axes 'z-up': allowed: y-up, opensim"):
        coordinates_of(track, "z-up")


SPINE = {f"{name}_{axis}": [0.0] for name in VERTEBRAE for axis in ("Flex_Ext", "axial_rotation")}
BENT = SPINE | {f"{name}_Lat_Bending": [2.0] for name in VERTEBRAE}
REVERSED = "knee_angle is negative in flexion in angles.mot, as in gait2392: its sign is reversed"


@pytest.mark.parametrize(
    ("file", "expected", "notes"),
    [
        (mot({"elbow_flex_r": [np.pi / 4]}, in_degrees=False), {"elbow_flexion_r": [45.0]}, None),
        (
            mot({"elbow_flex_r": [np.pi / 4], "elbow_flex_l": [np.nan], "arm_rot_r": [6.4]}, in_degrees=False),
            {"elbow_flexion_r": [45.0]}, (),
        ),
        (mot(BENT), {"trunk_bending": [12.0]}, ()),
        (mot({"hip_flexion_r": [20.0]}), {"hip_flexion_r": [20.0], "hip_adduction_r": [0.0]},
         ("no hip_adduction_r, hip_rotation_r in angles.mot: taken as 0",)),
        (mot({"knee_angle_r": [-5.0, -60.0], "knee_angle_l": [4.0, -10.0]}), {"knee_flexion_r": [5.0, 60.0]}, (REVERSED,)),
        (mot({"knee_angle_r": [-5.0, 60.0]}), {"knee_flexion_r": [-5.0, 60.0]}, ()),
    ],
    ids=["radians", "past a turn", "joints of the spine add up", "missing is zero", "knees reversed", "knees as they are"],
)  # fmt: skip
def test_coordinates_of_other_models_are_angles_with_notes(file, expected, notes):
    rotations, found_notes = rotations_of(file, PATH)
    for name, values in expected.items():
        np.testing.assert_allclose(clinical_angles(rotations)[name], values, atol=1e-9)
    assert notes is None or found_notes == notes


@pytest.mark.parametrize(
    ("in_degrees", "stated", "note"),
    [
        (True, False, r"inDegrees = no in angles\.mot, but angles of \d+: degrees"),
        (False, True, r"inDegrees = yes in angles\.mot, but no angle beyond \d\.\d+: are they radians\?"),
        (True, True, ""),
        (False, False, ""),
    ],
)
def test_a_unit_that_the_angles_contradict_gives_a_note(in_degrees: bool, stated: bool, note: str) -> None:
    """Degrees beyond a full turn in radians are read as degrees."""
    _, columns = coordinates_of(walking_person(FOURTEEN_PARTS, 20))
    scaled = {name: column if in_degrees else np.radians(column) for name, column in columns.items()}
    rotations, notes = rotations_of(mot(scaled, stated), PATH)
    assert [bool(re.fullmatch(note, one)) for one in notes] == [True] * bool(note)
    if not (stated and not in_degrees):
        np.testing.assert_allclose(rotations["left_hip"], rotations_of(mot(columns), PATH)[0]["left_hip"], atol=1e-9)


def test_a_file_without_a_known_coordinate_is_an_error() -> None:
    with pytest.raises(UserError, match=r"angles\.mot: no known coordinate: rotor, flap: allowed: .*hip_flexion_r"):
        rotations_of(mot({"rotor": [1.0], "flap": [2.0]}), PATH)


@pytest.mark.clips
def test_directions_of_the_reference_agree_with_triangulated_key_points() -> None:
    """Mean angle between segments of OpenSim's inverse kinematics and lines between the key points it was computed from."""
    rotations, notes = rotations_of(read_mot(ANGLES), ANGLES)
    points = read_trc(CLIPS / "real_beam4" / "reference.trc")
    at = {name: points.points[:, k] for k, name in enumerate(points.names)}
    pelvis, trunk = rotations["pelvis"], rotations["trunk_inclination"]
    assert notes == ()
    assert _between(trunk[:, :, 1], 2.0 * at["Neck"] - at["RHip"] - at["LHip"]) < 8.0
    assert _between(trunk[:, :, 2], at["RShoulder"] - at["LShoulder"]) < 8.0
    for letter, side in (("R", "right"), ("L", "left")):
        thigh = pelvis @ rotations[f"{side}_hip"]
        shank = thigh @ rotations[f"{side}_knee"]
        arm = trunk @ rotations[f"{side}_shoulder"]
        forearm = arm @ rotations[f"{side}_elbow"]
        assert _between(-thigh[:, :, 1], at[f"{letter}Knee"] - at[f"{letter}Hip"]) < 8.0
        assert _between(-shank[:, :, 1], at[f"{letter}Ankle"] - at[f"{letter}Knee"]) < 8.0
        assert _between((shank @ rotations[f"{side}_ankle"])[:, :, 0], at[f"{letter}BigToe"] - at[f"{letter}Heel"]) < 18.0
        assert _between(-arm[:, :, 1], at[f"{letter}Elbow"] - at[f"{letter}Shoulder"]) < 12.0
        assert _between(-forearm[:, :, 1], at[f"{letter}Wrist"] - at[f"{letter}Elbow"]) < 18.0


def _between(one: Floats, other: Floats) -> float:
    """Mean angle, degrees."""
    return float(np.degrees(np.arccos(np.clip(np.sum(unit(one) * unit(other), axis=1), -1.0, 1.0))).mean())
