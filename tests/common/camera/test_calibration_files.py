"""Calibration files of zenocap, EasyMocap, ROS and Qualisys: round trips and errors."""

import os
import re
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.places import CLIPS
from tests.support.puppets import ring
from zenocap.common import atomic_write as durable
from zenocap.common.camera.anipose import anipose_texts
from zenocap.common.camera.calibration_files import axes_note, camera_named, read_calibration, unit_note, write_calibration
from zenocap.common.camera.lens_files import read_lenses
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.ros_camera_info import read_ros_info
from zenocap.common.errors import FileNote, UserError, file_notes

GOOD = """[cam_01]
name = "left"
size = [640.0, 480.0]
matrix = [[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0]
rotation = [3.141592653589793, 0.0, 0.0]
translation = [0.0, 1.0, 5.2]
fisheye = false

[metadata]
adjusted = false
error = 0.0
"""

pytestmark = pytest.mark.filterwarnings("ignore::zenocap.common.errors.FileNote")
vectors = st.tuples(*[st.floats(-1.8, 1.8)] * 3)


def refused(path: Path, content: str, text: str, up_axis: str = "y") -> None:
    """The file is refused with this text behind its name."""
    path.write_text(content)
    with pytest.raises(UserError, match=text) as caught:
        read_calibration(path, up_axis)
    assert str(caught.value).startswith(str(path))


@st.composite
def cameras(draw) -> Camera:
    width, height = draw(st.integers(16, 4000)), draw(st.integers(16, 4000))
    focal = draw(st.floats(10, 5000))
    matrix = np.array([[focal, 0, draw(st.floats(0, width))], [0, focal * 1.1, draw(st.floats(0, height))], [0, 0, 1]])
    lens = np.array(draw(st.lists(st.floats(-1, 1), min_size=5, max_size=5)))
    rotation = np.asarray(cv2.Rodrigues(np.array(draw(vectors)))[0])
    name = draw(st.text(min_size=1, max_size=12, alphabet=st.characters(exclude_categories=["Cs", "Cc"])))
    shift = np.array(draw(st.tuples(*[st.floats(-500, 500)] * 3)))
    return Camera(name, (width, height), matrix, lens, rotation, shift)


@pytest.mark.nightly
@settings(max_examples=50)
@given(st.lists(cameras(), min_size=1, max_size=4, unique_by=lambda c: c.name), st.sampled_from("yz"))
def test_cameras_round_trip(tmp_path_factory, made, up_axis):
    path = tmp_path_factory.mktemp("calibration") / "calibration.toml"
    write_calibration(path, {camera.name: camera for camera in made}, up_axis)
    read = read_calibration(path, up_axis)
    assert list(read) == [camera.name for camera in made]
    for camera in made:
        again = read[camera.name]
        assert again.size == camera.size
        np.testing.assert_array_equal(again.matrix, camera.matrix)
        np.testing.assert_array_equal(again.distortions, camera.distortions)
        np.testing.assert_allclose(again.rotation, camera.rotation, atol=1e-12)
        np.testing.assert_array_equal(again.translation, camera.translation)


@pytest.mark.parametrize("turn_rad", [1e-9, 1e-7, 9e-6, 1e-4, 9.9e-4, 1.1e-3, 3.14])
def test_small_and_large_turns_are_kept(tmp_path, turn_rad):
    """OpenCV gives the vector 0 for the matrix of a turn below 1e-5 rad."""
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    turned = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    camera = Camera("a", (640, 480), np.diag([600.0, 600.0, 1.0]), np.zeros(5), turned, np.zeros(3))
    write_calibration(tmp_path / "a.toml", {"a": camera}, "y")
    np.testing.assert_allclose(read_calibration(tmp_path / "a.toml", "y")["a"].rotation, turned, atol=1e-12)


def test_keys_are_written_in_the_order_of_anipose(tmp_path):
    path = tmp_path / "calibration.toml"
    path.write_text(GOOD)
    texts = anipose_texts(path, read_calibration(path), error_px=0.0)[path], GOOD
    written, good = ([line.split(" =")[0] for line in text.splitlines()] for text in texts)
    assert written == good


def test_a_z_up_world_is_converted_to_y_z_x(tmp_path):
    path = tmp_path / "calibration.toml"
    path.write_text(GOOD.replace("[3.141592653589793, 0.0, 0.0]", "[0.3, -1.2, 0.4]"))
    as_is, turned = read_calibration(path, "y")["left"], read_calibration(path, "z")["left"]
    x, y, z = as_is.centre
    np.testing.assert_allclose(turned.centre, [y, z, x])
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    np.testing.assert_allclose(turned.project(points[:, [1, 2, 0]]), as_is.project(points))


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('name = "left"', 'name = ""', "cam_01.name = '': allowed: at least one character"),
        ('name = "left"', "name = 3", "cam_01.name = 3: allowed: a string"),
        ("size = [640.0, 480.0]", "size = [640.5, 480.0]", "cam_01.size = .*allowed: width and height in whole pixels"),
        ("size = [640.0, 480.0]", "size = [640.0]", "cam_01.size = .*allowed: 2 finite numbers"),
        ("size = [640.0, 480.0]", "", "cam_01.size is missing; there are: distortions, fisheye"),
        ("size = ", "sise = ", "cam_01.size is missing; .*did you mean 'sise'"),
        ("[600.0, 0.0, 319.5]", "[-600.0, 0.0, 319.5]",
         r"matrix\[0\]\[0\] \(fx\) = -600.0: allowed: focal length, from 5 to"),
        ("[600.0, 0.0, 319.5]", "[nan, 0.0, 319.5]", "cam_01.matrix = .*allowed: 3 x 3 finite numbers"),
        ("[600.0, 0.0, 319.5]", '["600", 0.0, 319.5]', "cam_01.matrix = .*allowed: 3 x 3 finite numbers"),
        ("[600.0, 0.0, 319.5]", "[600.0, 9.0, 319.5]", "no skew"),
        ("[600.0, 0.0, 319.5]", "[600.0, 0.0, 9000.0]", r"\(cx\) = 9000.0: allowed: principal point, from -640 to 1280"),
        ("[0.0, 0.0, 1.0]]", "[0.0, 0.0, 2.0]]", r"allowed: \[\[fx, 0, cx\]"),
        ("distortions = [0.0, 0.0, 0.0, 0.0]", "distortions = [0.0]", "distortions = .*4 or 5 or 8 or 12 or 14 finite"),
        ("[3.141592653589793, 0.0, 0.0]", "[inf, 0.0, 0.0]", "rotation = .*3 or 3 x 3 finite numbers"),
        ("[3.141592653589793, 0.0, 0.0]", "[[1, 0, 0], [0, 1, 0], [0, 1, 1]]", "rotation = .*orthonormal rows"),
        ("[3.141592653589793, 0.0, 0.0]", "[[-1, 0, 0], [0, 1, 0], [0, 0, 1]]", r"determinant \+1"),
        ("[0.0, 1.0, 5.2]", "[0.0, 1000.0, 5200.0]", "translation = .*at most 1000 long; are these millimetres"),
        ("[0.0, 1.0, 5.2]", "[true, 1.0, 5.2]", "translation = .*3 finite numbers"),
        ("[3.141592653589793,", "[180.0,", "cam_01.rotation = .*: allowed: .* 2 pi long, radians; are these degrees"),
        ("[[600.0,", "[[0.94,", r"\(fx\) = 0.94: allowed: focal length, from 5 to"),
        ("[metadata]", GOOD.split("[metadata]")[0].replace("cam_01", "cam_02") + "[metadata]", "cam_02.name = 'left'"),
        (GOOD, "", "no camera in it: allowed: a table"),
        (GOOD, "cam = [", "not TOML"),
    ],
)  # fmt: skip
def test_errors_name_file_key_value_and_allowed_values(tmp_path, old, new, text):
    assert old in GOOD
    refused(tmp_path / "calibration.toml", GOOD.replace(old, new, 1), text)


def test_error_names_the_file_that_cannot_be_read(tmp_path):
    with pytest.raises(UserError, match=r"none\.toml: no such calibration file"):
        read_calibration(tmp_path / "none.toml")
    with pytest.raises(UserError, match="a folder; allowed: a file"):
        read_calibration(tmp_path)
    (tmp_path / "a.json").write_text("{}")
    with pytest.raises(UserError, match=r"suffix '\.json': allowed: \.toml"):
        read_calibration(tmp_path / "a.json")
    (tmp_path / "a.toml").write_text(GOOD)
    with pytest.raises(UserError, match="up_axis = 'x': allowed: 'y' or 'z'"):
        read_calibration(tmp_path / "a.toml", "x")
    with pytest.raises(UserError, match=r"suffix '\.yml': allowed when writing: \.toml"):
        write_calibration(tmp_path / "a.yml", {})


def test_a_missing_camera_raises_an_error_that_lists_the_others(tmp_path):
    path = tmp_path / "calibration.toml"
    path.write_text(GOOD)
    found = read_calibration(path)
    assert camera_named(found, "left", path).name == "left"
    with pytest.raises(UserError, match="no camera 'lefd'; there are: left; did you mean 'left'"):
        camera_named(found, "lefd", path)


def test_a_crash_while_writing_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "calibration.toml"
    path.write_text(GOOD)
    found = read_calibration(path)
    monkeypatch.setattr(durable.os, "fsync", Mock(side_effect=OSError(28, "No space left on device")))
    with pytest.raises(OSError, match="No space left"):
        write_calibration(path, found)
    assert path.read_text() == GOOD
    assert os.listdir(tmp_path) == ["calibration.toml"]


def storage(path: Path, values: dict[str, np.ndarray | float | str | list[str]]) -> None:
    """Write a file of OpenCV's FileStorage, YAML or XML by the suffix."""
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        if isinstance(value, list):
            file.startWriteStruct(key, cv2.FILE_NODE_SEQ)
            for text in value:
                file.write("", text)
            file.endWriteStruct()
        else:
            file.write(key, value)
    file.release()


def test_opencv_storage_of_easymocap_is_read(tmp_path):
    (tmp_path / "calibration.toml").write_text(GOOD)
    left = read_calibration(tmp_path / "calibration.toml")["left"]
    storage(tmp_path / "intri.yml", {"K_left": left.matrix, "dist_left": np.zeros((1, 5))})
    shift = left.translation.reshape(3, 1)
    storage(tmp_path / "extri.yml", {"Rot_left": left.rotation, "T_left": shift})
    read = read_calibration(tmp_path / "extri.yml")["left"]
    assert read.size == (640, 480)  # from the centred principal point
    np.testing.assert_allclose(read.rotation, left.rotation)
    np.testing.assert_allclose(read.translation, left.translation)
    storage(tmp_path / "extri.yml", {"R_left": cv2.Rodrigues(left.rotation)[0], "T_left": shift})
    lens = {"K_left": left.matrix, "dist_left": np.zeros((1, 5))}
    storage(tmp_path / "intri.yml", lens | {"H_left": 470.0, "W_left": 630.0})
    read = read_calibration(tmp_path / "extri.yml")["left"]
    assert read.size == (630, 470)
    np.testing.assert_allclose(read.rotation, left.rotation, atol=1e-12)


def test_easymocaps_rotation_is_the_one_that_others_read_and_contradictions_are_said(tmp_path):
    path, turned = tmp_path / "extri.yml", cv2.Rodrigues(np.array([0.0, 0.3, 0.0]))[0]
    lens = {"K_a": np.array([[600.0, 0, 319.5], [0, 600, 239.5], [0, 0, 1]]), "dist_a": np.zeros((1, 5))}
    storage(tmp_path / "intri.yml", lens | {"H_a": 0, "W_a": 0})
    place = {"R_a": cv2.Rodrigues(turned)[0], "T_a": np.zeros((3, 1))}
    storage(path, place | {"names": ["a", "b"], "Rot_a": np.eye(3)})
    with pytest.warns(FileNote) as notes:
        camera = read_calibration(path, placed=False)["a"]
    np.testing.assert_allclose(camera.rotation, turned, atol=1e-9)
    assert camera.size == (640, 480)
    assert [str(note.message) for note in notes] == [
        f"{path}: names = a, b, but T_ is that of a: the latter are read",
        f"{path}: R_a and Rot_a are 17.2 degrees apart: R_a is used, as other programs do",
        f"{tmp_path / 'intri.yml'}: no W_a and H_a: 640 x 480 px is a guess from the principal point; add the size of the "
        "video",
    ]
    storage(path, place | {"names": ["a"], "Rot_a": np.round(turned, 4)})
    with pytest.warns(FileNote) as notes:
        read_calibration(path, placed=False)
    assert len(notes) == 1


PLACE, TURN = {"T_a": np.zeros((3, 1))}, {"Rot_a": np.eye(3)}


@pytest.mark.parametrize(
    ("intrinsics", "extrinsics", "text"),
    [
        ({"K_a": np.eye(3)}, TURN, r"extri\.yml: no camera in it: there are: Rot_a; allowed: extri\.yml with"),
        ({"K_a": np.eye(3)}, PLACE | TURN, r"intri\.yml: dist_a is missing; there are: K_a"),
        ({"K_a": np.eye(3), "dist_a": np.zeros(5)}, PLACE, r"extri\.yml: Rot_a is missing; there are: T_a"),
        (None, PLACE, r"intri\.yml: no such calibration file"),
        (None, None, r"extri\.yml: .*not OpenCV FileStorage"),
    ],
)
def test_opencv_storage_errors_name_file_and_key(tmp_path, intrinsics, extrinsics, text):
    (tmp_path / "extri.yml").write_text("no storage")
    for name, values in (("intri.yml", intrinsics), ("extri.yml", extrinsics)):
        if values is not None:
            storage(tmp_path / name, values)
    with pytest.raises(UserError, match=text):
        read_calibration(tmp_path / "extri.yml")


ROS = """image_width: 640
image_height: 480
camera_name: webcam
camera_matrix:
  rows: 3
  cols: 3
  data: [600.0, 0.0, 319.5, 0.0, 601.0, 239.5, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0.001, 0.002, 0.0]
"""


def test_ros_camera_info_has_intrinsics_only(tmp_path):
    path = tmp_path / "head.yaml"
    path.write_text(ROS)
    read = read_ros_info(path)
    assert (read.name, read.size) == ("webcam", (640, 480))
    np.testing.assert_array_equal(read.matrix, [[600, 0, 319.5], [0, 601, 239.5], [0, 0, 1]])
    np.testing.assert_array_equal(read.distortions, [0.1, -0.2, 0.001, 0.002, 0])
    with pytest.raises(UserError, match="intrinsics only, no position and orientation"):
        read_calibration(path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("plumb_bob", "equidistant", "distortion_coefficients = .*: allowed: 4 finite numbers"),
        ("plumb_bob", "omni", "distortion_model = omni: allowed: plumb_bob or rational_polynomial or equidistant"),
        ("camera_name: webcam\n", "", "camera_name is missing"),
        ("601.0", "x", "camera_matrix = 'x': allowed: a number"),
        ("image_width: 640", "image_width: 0", "size = .*whole pixels"),
    ],
)
def test_ros_camera_info_errors(tmp_path, old, new, text):
    refused(tmp_path / "head.yaml", ROS.replace(old, new), text)


QUALISYS = """<calibration><cameras><camera serial="7">
<fov_video left="0" top="0" right="639" bottom="479"/>
<transform r11="1" r12="0" r13="0" r21="0" r22="1" r23="0" r31="0" r32="0" r33="1" x="1000" y="2000" z="3000"/>
<intrinsic focalLengthU="38400" focalLengthV="38400" centerPointU="20448" centerPointV="15328" radialDistortion1="0"
 radialDistortion2="0" tangentalDistortion1="0" tangentalDistortion2="0"/>
</camera></cameras></calibration>"""


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("<cameras>", "<cameras", "not XML"),
        ("<transform", "<transfer", r"camera\[7\].transform is missing; there are: .*did you mean 'transfer'"),
        ('x="1000"', 'x="a"', r"camera\[7\].transform.x = 'a': allowed: a number"),
        ('x="1000"', "", r"camera\[7\].transform.x is missing"),
        ("camera serial", "kamera serial", "not XML"),
        ("<calibration>", "<!DOCTYPE a><calibration>", "document type"),
        (QUALISYS, "<calibration/>", "no camera in it"),
    ],
)
def test_qualisys_errors(tmp_path, old, new, text):
    refused(tmp_path / "room.qca.txt", QUALISYS.replace(old, new), text)


@pytest.mark.parametrize(("third", "expected"), [("0", [1, 0, 0, 0]), ("12.8", [1, 0, 0, 0, 0.2])])
def test_qualisys_units_are_millimetres_and_sixty_fourths_of_a_pixel(tmp_path, third, expected):
    path = tmp_path / "room.qca.txt"
    path.write_text(QUALISYS.replace('radialDistortion1="0"', f'radialDistortion1="64" radialDistortion3="{third}"'))
    camera = read_calibration(path, "z")["7"]
    np.testing.assert_allclose(camera.centre, [2, 3, 1])
    np.testing.assert_allclose(camera.matrix, [[600, 0, 319.5], [0, 600, 239.5], [0, 0, 1]])
    np.testing.assert_allclose(camera.distortions, expected)


def qualisys_camera(serial: str, attributes: str, video: str = 'right="1919" bottom="1087"') -> str:
    """As Qualisys writes a Miqus Video camera: intrinsics of the sensor of 1920 x 1088 px."""
    other = QUALISYS.replace('<calibration><cameras><camera serial="7">', f'<camera serial="{serial}" {attributes}>')
    sensor = 'sensorMinU="0.0" sensorMaxU="122879.0" sensorMinV="0.0" sensorMaxV="69631.0" radialDistortion1="64"'
    other = other.replace('right="639" bottom="479"', video).replace('radialDistortion1="0"', sensor)
    return other.replace("</cameras></calibration>", "")


@pytest.mark.parametrize(
    ("attributes", "reason"),
    [
        ('active="0" calibrated="false"', "not active"),
        ('active="1" calibrated="false"', "not calibrated"),
        ('active="1" calibrated="true" model="Oqus 300+" video_resolution=""', "a marker camera, without video"),
        ('video_resolution="none"', "a marker camera, without video"),
        *(
            (f'active="1" model="{model}"', f"a marker camera by its model {model}, without video_resolution")
            for model in ("ProReflex MCU 240", "Oqus 300+", "Oqus 500", "Miqus M3", "Arqus A12")
        ),
    ],
)
def test_qualisys_cameras_without_a_calibrated_video_are_left_out_and_said(tmp_path, attributes, reason):
    path, good = tmp_path / "room.qca.txt", qualisys_camera("1", 'active="1" video_resolution="1080p"')
    path.write_text(f"<calibration><cameras>{good}{qualisys_camera('2', attributes)}</cameras></calibration>")
    with pytest.warns(FileNote) as notes:
        assert list(read_calibration(path, "z", placed=False)) == ["1"]
    texts = [str(note.message) for note in notes]
    assert texts[-2] == f"{path}: camera 2 is {reason}: left out"
    assert "the distortions are divided by 64" in texts[-1]
    alone = f"<calibration><cameras>{qualisys_camera('2', attributes)}</cameras></calibration>"
    refused(path, alone, re.escape(f"camera 2 is {reason}: left out: allowed: Qualisys calibration"))


def test_a_qualisys_camera_without_a_part_of_its_video_is_left_out_and_the_others_are_read(tmp_path):
    path, empty = tmp_path / "room.qca.txt", qualisys_camera("2", "", 'right="0" bottom="0"')
    path.write_text(f"<calibration><cameras>{qualisys_camera('1', '')}{empty}</cameras></calibration>")
    with pytest.warns(FileNote, match=r"camera 2 is without a part of its video \(fov_video\): left out"):
        assert list(read_calibration(path, "z")) == ["1"]


def test_qualisys_cameras_that_are_shown_turned_are_noted(tmp_path):
    path, turns = tmp_path / "room.qca.txt", {"1": 0, "2": 90, "3": 180}
    cameras = "".join(qualisys_camera(name, f'viewrotation="{turn}"') for name, turn in turns.items())
    path.write_text(f"<calibration><cameras>{cameras}</cameras></calibration>")
    with pytest.warns(FileNote, match=r"camera 2, 3 is shown turned \(viewrotation\): .* as recorded, not turned upright"):
        assert list(read_calibration(path, "z")) == list(turns)


@pytest.mark.parametrize("model", ["Miqus Video", "Oqus 210c", "Miqus Hybrid", "Miqus VC1", "none", ""])
def test_qualisys_video_cameras_of_old_files_without_a_resolution_are_read(tmp_path, model):
    path = tmp_path / "room.qca.txt"
    camera = qualisys_camera("1", f'model="{model}"')
    path.write_text(f"<calibration><cameras>{camera}</cameras></calibration>")
    assert list(read_calibration(path, "z")) == ["1"]


@pytest.mark.parametrize(
    ("video", "resolution", "factor"),
    [
        ('right="1919" bottom="1087"', "1080p", 1),
        ('right="959" bottom="543"', "540p", 2),
        ('right="639" bottom="361"', "360p", 3),
        ('right="959" bottom="543"', "1080p", 1),
        ('right="959" bottom="543"', None, 1),
    ],
    ids=["whole", "half", "a third", "a part of the sensor", "an old file"],
)
def test_qualisys_intrinsics_are_those_of_the_sensor(tmp_path, video, resolution, factor):
    given = "" if resolution is None else f'video_resolution="{resolution}"'
    path = tmp_path / "room.qca.txt"
    path.write_text(f"<calibration><cameras>{qualisys_camera('1', given, video)}</cameras></calibration>")
    with pytest.warns(FileNote, match="divided by 64"):
        camera = read_calibration(path, "z")["1"]
    centre = (np.array([319.5, 239.5]) + 0.5) / factor - 0.5
    np.testing.assert_allclose(camera.matrix[[0, 1], [0, 1]], 600 / factor)
    np.testing.assert_allclose(camera.matrix[:2, 2], centre)


@pytest.mark.parametrize(("resolution", "factor"), [("1080p", 1), ("540p", 2), ("360p", 3)])
def test_the_part_of_a_qualisys_video_is_in_its_own_pixels(tmp_path, resolution, factor):
    path = tmp_path / "room.qca.txt"
    text = qualisys_camera("1", f'video_resolution="{resolution}"', 'right="599" bottom="199"')
    text = text.replace('left="0" top="0"', 'left="100" top="50"')
    path.write_text(f"<calibration><cameras>{text}</cameras></calibration>")
    camera = read_calibration(path, "z")["1"]
    assert camera.size == (500, 150)
    np.testing.assert_allclose(camera.matrix[[0, 1], [0, 1]], 600 / factor)
    np.testing.assert_allclose(camera.matrix[:2, 2], (np.array([319.5, 239.5]) + 0.5) / factor - 0.5 - [100, 50])


def test_a_qualisys_video_that_is_higher_than_its_resolution_is_said(tmp_path):
    path, resolution = tmp_path / "room.qca.txt", 'video_resolution="540p"'
    path.write_text(f"<calibration><cameras>{qualisys_camera('1', resolution)}</cameras></calibration>")
    with pytest.warns(FileNote, match=r"fov_video is 1088 px high, video_resolution = 540p: the former is used"):
        read_calibration(path, "z")


def test_a_qualisys_video_of_another_part_of_the_sensor_is_refused(tmp_path):
    text = f"<calibration><cameras>{qualisys_camera('1', VIDEO_720, NOT_HALF)}</cameras></calibration>"
    refused(tmp_path / "room.qca.txt", text, r"camera\[1\].fov_video = 500 px high of a sensor of 1088: allowed")


VIDEO_720, NOT_HALF = 'video_resolution="720p"', 'right="959" bottom="499"'


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (
            "translation = [0.0, 100.0, 520.0]",
            "camera 'left' is 530 m from the origin: is the file in centimetres or inches?",
        ),
        (
            "translation = [0.0, 39.0, 205.0]",
            "camera 'left' is 209 m from the origin: is the file in centimetres or inches?",
        ),
        ("translation = [0.0, 6.5, 17.0]", "camera 'left' is 18 m .* a point 6.5 m high: is the file in feet or"),
        ("translation = [0.0, 3.9, 13.0]", "camera 'left' is 14 m .* a point 3.9 m high: is the file in feet or"),
        ("translation = [0.0, 3.3, 6.6]", "camera 'left' is 7 m .* a point 3.3 m high: is the file in feet or"),
        ("translation = [0.0, 39.0, 79.0]", "camera 'left' is 88 m .* a point 39.0 m high: is the file in feet or inches"),
    ],
    ids=["centimetres", "inches", "feet", "feet, of low cameras", "feet, of near cameras", "inches, of near cameras"],
)
def test_distances_of_another_unit_than_metres_are_questioned(tmp_path, change, note):
    path = tmp_path / "calibration.toml"
    path.write_text(GOOD.replace("translation = [0.0, 1.0, 5.2]", change))
    with pytest.warns(FileNote, match=note):
        read_calibration(path)


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ("[3.141592653589793, 0.0, 0.0]", "[0.0, 0.3, 0.0]", "toml: up in the pictures of most cameras is -Y, not Y: is"),
        ("[3.141592653589793, 0.0, 0.0]", "[1.571, 0.0, 0.0]", "is Z, not Y: is another axis its vertical"),
        (
            "[metadata]",
            GOOD.partition("[meta")[0].replace("left", "right"),
            "cameras 'left' and 'right' are at the same place: are rotation and",
        ),
        ("[640.0, 480.0]", "[320.0, 240.0]", r"cam_01: principal point \(319.5, 239.5\) px, size 320 x 240 px: is it"),
        ("s = [0.0, 0.0, 0.0, 0.0]", "s = [7, -300, 0.1, 0.2, 2000]", "cam_01.distortions = .* no direction twice"),
        ("s = [0.0, 0.0, 0.0, 0.0]", "s = [7, 0, 0, 0, 2000]", "twice, and none far outside, in its images: k1, k2"),
    ],
    ids=[
        "Y points down, or axes of OpenGL",
        "Z-up",
        "from camera to world",
        "the size of other images",
        "folds",
        "doubles",
    ],
)
def test_cameras_that_contradict_each_other_or_their_pictures_are_questioned(tmp_path, old, new, note):
    path = tmp_path / "calibration.toml"
    path.write_text(GOOD.replace(old, new.replace("cam_01", "cam_02")))
    with pytest.warns(FileNote, match=note):
        read_calibration(path)


@pytest.mark.filterwarnings("error::zenocap.common.errors.FileNote")
@pytest.mark.parametrize(
    "distortions", ["-0.4, 0.17, 0.0, 0.0, -0.03", "0.1, -0.3, 0, 0, 0.25", "-8, 20, 0, 0, 5, -7.8, 19, 8"]
)
def test_distortions_of_real_lenses_are_not_questioned(tmp_path, distortions):
    (tmp_path / "a.toml").write_text(GOOD.replace("s = [0.0, 0.0, 0.0, 0.0]", f"s = [{distortions}]"))
    assert read_calibration(tmp_path / "a.toml")["left"].distortions.any()


@pytest.mark.parametrize(
    ("centres", "axes"),
    [
        ([(0, 2, 4), (4, 2, 0)], [(0, 0, -1), (-1, 0, 0)]),
        ([(0, 2, 4), (0, 2, -4)], [(0, 0, -1), (0, 0, 1)]),
        ([(-1, 2.6, 5), (1, 2.6, 5)], [(-0.05, -0.2, -1), (0.04, -0.2, -1)]),
        (
            [(-2, 3, -2), (2, 3, -2), (-2, 3, 2), (2, 3, 2)],
            [(-0.03, -1, 0.01), (0.03, -1, 0), (0.01, -1, 0.03), (0, -1, -0.03)],
        ),
    ],
    ids=["level at a right angle", "level and opposite", "nearly parallel", "straight down"],
)
def test_cameras_that_do_not_show_their_height_are_not_questioned(centres, axes):
    cameras = []
    for centre, axis in zip(np.array(centres, float), np.array(axes), strict=True):
        forward = axis / np.linalg.norm(axis)
        right = np.linalg.svd(forward[None])[2][1]
        rotation = np.stack([right, np.cross(forward, right), forward])
        cameras.append(Camera("a", np.eye(3), np.zeros(4), (640, 480), rotation, -rotation @ centre))
    assert unit_note(cameras) == ""


@pytest.mark.parametrize("count", [3, 4, 7])
def test_cameras_around_a_place_that_look_away_from_it_are_questioned(count):
    inwards = ring(count)
    away = [replace(one, rotation=turned, translation=-turned @ one.centre) for one in inwards
            for turned in [one.rotation @ np.diag([-1.0, 1.0, -1.0])]]  # fmt: skip
    assert axes_note(inwards) == ""
    assert axes_note(away).startswith(f"what the cameras look at is behind {', '.join(one.name for one in away)}: are the")


@pytest.mark.clips
@pytest.mark.filterwarnings("error::zenocap.common.errors.FileNote")
def test_in_feet_a_calibration_of_the_clips_is_questioned_and_not_in_metres_or_yards():
    for path in sorted(CLIPS.glob("*/calibration.toml")):
        cameras = list(read_calibration(path, "z" if path.parent.name.startswith("real") else "y").values())
        assert unit_note(cameras) == "", path
        feet = [replace(camera, translation=camera.translation / 0.3048) for camera in cameras]
        assert "is the file in feet" in unit_note(feet), path
        yards = [replace(camera, translation=camera.translation / 0.9144) for camera in cameras]
        assert unit_note(yards) == "", path


def test_a_note_about_a_file_is_shown_once(tmp_path):
    path, shown = tmp_path / "calibration.toml", list[str]()
    path.write_text(GOOD.replace("translation = [0.0, 1.0, 5.2]", "translation = [0.0, 100.0, 520.0]"))
    with file_notes(shown.append):
        read_calibration(path)
        read_calibration(path)
    assert len(shown) == 1
    path.write_text(GOOD)
    with file_notes(shown.append):
        read_calibration(path)
    assert len(shown) == 1


@pytest.mark.parametrize(
    ("principal", "size"),
    [
        ((975, 528), (1920, 1080)),
        ((962, 541.5), (1920, 1080)),
        ((242, 318), (480, 640)),
        ((900, 600), (1801, 1201)),
        ((327.5, 245.5), (656, 492)),
    ],
)
def test_the_guessed_size_of_easymocap_is_a_usual_one_and_is_said(tmp_path, principal, size):
    storage(tmp_path / "extri.yml", {"Rot_left": np.eye(3), "T_left": np.zeros((3, 1))})
    matrix = np.array([[600.0, 0, principal[0]], [0, 600, principal[1]], [0, 0, 1]])
    storage(tmp_path / "intri.yml", {"K_left": matrix, "dist_left": np.zeros((1, 5))})
    with pytest.warns(FileNote, match=rf"intri\.yml: no W_left and H_left: {size[0]} x {size[1]} px is a guess"):
        assert read_calibration(tmp_path / "extri.yml")["left"].size == size


@pytest.mark.parametrize(("name", "content"), [("calibration.toml", GOOD), ("head.yaml", ROS)])
def test_a_byte_order_mark_is_no_part_of_the_file(tmp_path, name, content):
    (tmp_path / name).write_text(content, encoding="utf-8-sig")
    assert list(read_lenses(tmp_path / name)) == ["webcam" if name == "head.yaml" else "left"]


ROI = "roi:\n  x_offset: 0\n  y_offset: 0\n  height: {}\n  width: {}\n  do_rectify: false\n"


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ("binning_x: 2\nbinning_y: 2\n", "binning_x = 2: allowed: 0 or 1"),
        ("binning_x: 1\nbinning_y: 4\n", "binning_y = 4: allowed: 0 or 1"),
        (ROI.format(240, 320), "roi = x_offset 0 y_offset 0 height 240 width 320: allowed: none, or the whole image"),
        (ROI.format(0, 0).replace("x_offset: 0", "x_offset: 8"), "roi = x_offset 8"),
        ("roi: {x_offset: 0, y_offset: 0, height: 240, width: 320, do_rectify: false}\n", "roi = x_offset 0"),
    ],
)
def test_ros_camera_info_of_a_part_of_the_pixels_is_refused(tmp_path, more, text):
    refused(tmp_path / "head.yaml", ROS + more, text)
    for whole in ("binning_x: 0\nbinning_y: 1\n", ROI.format(0, 0), ROI.format(480, 640)):
        (tmp_path / "head.yaml").write_text(ROS + whole)
        assert read_ros_info(tmp_path / "head.yaml").size == (640, 480)


ECHO = """header:
  stamp:
    sec: 17
    nanosec: 5
  frame_id: webcam
height: 480
width: 640
distortion_model: plumb_bob
d:
- 0.1
- -0.2
- 0.001
- 0.002
- 0.0
k:
- 600.0
- 0.0
- 319.5
- 0.0
- 601.0
- 239.5
- 0.0
- 0.0
- 1.0
r:
- 1.0
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
"""
ECHO_1 = """header:
  seq: 3
  frame_id: "webcam"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [0.1, -0.2, 0.001, 0.002, 0.0]
K: [600.0, 0.0, 319.5, 0.0, 601.0, 239.5, 0.0, 0.0, 1.0]
"""


@pytest.mark.parametrize("echo", [ECHO, ECHO + ECHO.replace("640", "10"), ECHO_1], ids=["ROS 2", "two messages", "ROS 1"])
def test_what_ros_topic_echo_prints_is_read(tmp_path, echo):
    (tmp_path / "echo.yaml").write_text(echo)
    (tmp_path / "head.yaml").write_text(ROS)
    found, expected = (read_lenses(tmp_path / name)["webcam"] for name in ("echo.yaml", "head.yaml"))
    assert found.size == expected.size
    np.testing.assert_array_equal(found.matrix, expected.matrix)
    np.testing.assert_array_equal(found.distortions, expected.distortions)
    binned = echo.replace("binning_x: 0", "binning_x: 2") if "binning" in echo else echo + "binning_x: 2\n"
    (tmp_path / "echo.yaml").write_text(binned)
    with pytest.raises(UserError, match="binning_x = 2"):
        read_lenses(tmp_path / "echo.yaml")


KALIBR = "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  intrinsics: [461.6, 460.2, 362.7, 248.1]\n"
CALIB_IO = (
    '{"Calibration": {"cameras": [{"model": {"polymorphic_id": 1, "polymorphic_name": "libCalib::CameraModelOpenCV"}}]}}'
)
COLMAP = "# Camera list with one line of data per camera:\n1 SIMPLE_RADIAL 1920 1080 1500 960 540 0.01\n"
METASHAPE = '<?xml version="1.0"?>\n<document version="1.5.0">\n  <chunk label="1"><sensors/></chunk></document>'
VICON = '<Cameras VERSION="1.0.0">\n  <Camera ACTIVE_THRESHOLD="3" DEVICEID="7" SENSOR_SIZE="4704 3456"/>\n</Cameras>'


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("camchain.yaml", KALIBR, "is Kalibr's camchain, without the floor, which is not read: allowed: .toml"),
        ("results-camchain.yaml", "%YAML:1.0\n" + KALIBR, "is Kalibr's camchain"),
        ("calibration.json", CALIB_IO, "is calib.io's JSON, which is not read: allowed: .toml"),
        ("room.xcp", VICON, r"is Vicon's \.xcp, which is not read: allowed: .toml"),
        ("room.xml", VICON, r"is Vicon's \.xcp"),
        ("cameras.txt", COLMAP, r"is COLMAP's cameras\.txt, without places, which is not read: allowed: \.toml"),
        ("cameras.txt", COLMAP.partition("\n")[2], r"is COLMAP's cameras\.txt"),
        ("cameras.xml", METASHAPE, "is the cameras of Agisoft Metashape, which is not read: allowed: .toml"),
    ],
)
def test_files_of_others_that_are_not_read_are_named_in_one_line(tmp_path, name, content, text):
    refused(tmp_path / name, content, text)
    refused(tmp_path / name, "\ufeff" + content, text)


@pytest.mark.clips
def test_the_two_calibrations_of_the_real_clip_agree():
    folder = CLIPS / "real_beam4"
    toml, qualisys = (read_calibration(folder / name, "z") for name in ("calibration.toml", "Calib.qca.txt"))
    assert list(toml) == list(qualisys)
    for name, camera in toml.items():
        for part, atol in (("matrix", 1e-6), ("rotation", 1e-9), ("translation", 1e-9), ("distortions", 1e-12)):
            np.testing.assert_allclose(getattr(qualisys[name], part), getattr(camera, part), atol=atol)
        assert 1 < camera.centre[1] < 3  # a tripod's height


CALISCOPE = """
CreationDate = 2023-03-31T09:56:43

[cameras.0]
cam_id = 0
size = [1280, 720]
rotation_count = 0
ignore = false
matrix = [[900.0, 0.0, 640.0], [0.0, 900.0, 360.0], [0.0, 0.0, 1.0]]
distortions = [-0.3, 0.04, -0.004, 0.004, 0.06]
translation = [0.1, -0.2, 0.6]
rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]

[cameras.3]
cam_id = 3
size = [1280, 720]
ignore = true
"""


def test_caliscope_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "camera_array.toml"
    path.write_text(CALISCOPE)
    (camera,) = read_calibration(path, "z").values()
    assert (camera.name, camera.size) == ("cam_0", (1280, 720))
    # At -R^T t = (-0.1, -0.6, -0.2) in the file's Z-up world.
    assert camera.centre == pytest.approx([-0.6, -0.2, -0.1])
    other = CALISCOPE.replace("rotation_count = 0", "rotation_count = 1")
    refused(path, other, r"cameras\.0\.rotation_count = 1: allowed: 0", "z")
    skewed = CALISCOPE.replace("[[1.0, 0.0, 0.0], [0.0, 0.0", "[[1.1, 0.0, 0.0], [0.0, 0.0")
    refused(path, skewed, r"cam_0\.rotation", "z")


def test_two_caliscope_cameras_of_one_number_are_refused_and_two_numbers_of_one_are_said(tmp_path: Path) -> None:
    path = tmp_path / "camera_array.toml"
    camera = CALISCOPE[CALISCOPE.index("[cameras.0]") : CALISCOPE.index("[cameras.3]")]
    twice = camera + camera.replace("[cameras.0]", "[cameras.1]")
    refused(path, twice, r"cameras\.1\.cam_id = 0: allowed: a number that no other camera has")
    refused(path, twice.replace("cam_id", "port"), r"cameras\.1\.port = 0: allowed: a number that no other")
    for numbers in ("cam_id = 2", "cam_id = 2\nport = 0"):
        path.write_text(camera.replace("cam_id = 0", numbers))
        text = ", ".join(numbers.splitlines())
        with pytest.warns(FileNote, match=rf"cameras\.0: {text}: taken for cam_2"):
            assert list(read_calibration(path)) == ["cam_2"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("T_a: !!binary |\n  " + "A" * 1000 + "\n", "!!binary: allowed: matrices of numbers as text"),
        ("T_a: !!opencv-matrix\n  rows: 100000\n  cols: 100000\n  dt: d\n  data: [ 0. ]\n", "rows: 100000: allowed: "),
        ("# " + "x" * (1 << 20) + "\n", "more than 1048576 bytes"),
    ],
    ids=["binary", "rows", "large"],
)
def test_opencv_storage_that_costs_time_or_memory_is_refused(tmp_path, monkeypatch, text, reason):
    monkeypatch.setattr(cv2, "FileStorage", Mock(side_effect=AssertionError("OpenCV's parser would not return")))
    refused(tmp_path / "extri.yml", "%YAML:1.0\n---\n" + text, reason)
