"""`calibrate convert`: every layout is read again, by zenocap and by the readers of other programs."""

import os
import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.common.camera.test_fisheye import FILE as FISHEYE
from tests.support.command import printed
from tests.support.places import ROOT
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.lens_files import read_lenses
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import FileNote

DISTORTED = """[cam_01]
name = "left"
size = [640.0, 480.0]
matrix = [[600.0, 0.0, 310.5], [0.0, 601.0, 239.5], [0.0, 0.0, 1.0]]
distortions = {}
rotation = [3.0, 0.2, 0.1]
translation = [0.0, 1.0, 5.2]
"""
RING = ROOT / "zenocap" / "data" / "rigs" / "ring-calibration.toml"
convert = partial(printed, "calibrate", "convert")


def assert_equal(one: Camera, other: Camera) -> None:
    assert one.size == other.size
    np.testing.assert_allclose(one.matrix, other.matrix)
    np.testing.assert_allclose(one.distortions, other.distortions)
    np.testing.assert_allclose(one.rotation, other.rotation, atol=1e-12)
    np.testing.assert_allclose(one.translation, other.translation, atol=1e-12)


@pytest.mark.parametrize("axis", ["y", "z"])
@pytest.mark.parametrize(
    ("layout", "name"),
    [("anipose", "a.toml"), ("caliscope", "camera_array.toml"), ("easymocap", "extri.yml"), ("qualisys", "a.qca.txt")],
)
def test_positions_and_lenses_are_the_same_in_every_layout(tmp_path, layout, name, axis):
    output = convert(RING, "-o", tmp_path / name, "--layout", layout, "--output-up-axis", axis)
    assert f"written: {tmp_path / name}" in output
    cameras, again = read_calibration(RING), read_calibration(tmp_path / name, axis)
    for one, other in zip(cameras.values(), again.values(), strict=True):
        assert_equal(one, other)
    if layout != "caliscope":  # which has numbers instead of names
        assert list(again) == list(cameras)


def test_cameras_of_caliscope_have_the_numbers_of_their_names(tmp_path):
    convert(RING, "-o", tmp_path / "camera_array.toml", "--layout", "caliscope")
    tables = tomllib.loads((tmp_path / "camera_array.toml").read_text())["cameras"]
    assert [int(number) for number in tables] == [int(name[-2:]) for name in read_calibration(RING)]


def test_easymocap_reads_names_matrices_and_sizes(tmp_path):
    convert(RING, "-o", tmp_path / "extri.yml", "--layout", "easymocap")
    cameras = read_calibration(RING)
    intrinsics, extrinsics = (
        cv2.FileStorage(str(tmp_path / file), cv2.FILE_STORAGE_READ) for file in ("intri.yml", "extri.yml")
    )
    for storage in (intrinsics, extrinsics):
        names = storage.getNode("names")
        assert [names.at(n).string() for n in range(names.size())] == list(cameras)
    for name, camera in cameras.items():
        np.testing.assert_array_equal(intrinsics.getNode(f"K_{name}").mat(), camera.matrix)
        assert (intrinsics.getNode(f"W_{name}").real(), intrinsics.getNode(f"H_{name}").real()) == camera.size
        rotation = cv2.Rodrigues(extrinsics.getNode(f"R_{name}").mat())[0]
        np.testing.assert_allclose(rotation, camera.rotation, atol=1e-9)


def test_lenses_of_ros_are_read_by_a_yaml_library_and_again(tmp_path):
    yaml = pytest.importorskip("yaml")
    assert "without the positions" in convert(RING, "-o", tmp_path / "info", "--layout", "ros")
    lenses = read_lenses(tmp_path / "info")
    for name, camera in read_calibration(RING).items():
        info = yaml.safe_load((tmp_path / "info" / f"{name}.yaml").read_text())
        assert (info["image_width"], info["image_height"], info["camera_name"]) == (*camera.size, name)
        assert info["distortion_model"] == "plumb_bob"
        np.testing.assert_array_equal(np.reshape(info["camera_matrix"]["data"], (3, 3)), camera.matrix)
        np.testing.assert_array_equal(lenses[name].matrix, camera.matrix)


def test_fisheye_lenses_keep_their_model(tmp_path):
    (tmp_path / "wide.toml").write_text(FISHEYE)
    convert(tmp_path / "wide.toml", "-o", tmp_path / "info", "--layout", "ros")
    convert(tmp_path / "wide.toml", "-o", tmp_path / "camera_array.toml", "--layout", "caliscope")
    camera = read_calibration(tmp_path / "wide.toml")["wide"]
    for lens in (
        read_lenses(tmp_path / "info")["wide"],
        read_lenses(tmp_path / "wide.toml")["wide"],
        Lens.of(read_calibration(tmp_path / "camera_array.toml")["cam_0"]),
    ):
        assert lens.fisheye
        assert camera.fisheye is not None
        np.testing.assert_array_equal(lens.matrix, camera.fisheye.matrix)
        np.testing.assert_array_equal(lens.distortions, camera.fisheye.coefficients)
    output = convert(tmp_path / "wide.toml", "-o", tmp_path / "extri.yml", "--layout", "easymocap", status=1)
    assert "has a fisheye lens: allowed in this layout" in output


@pytest.mark.parametrize(
    ("name", "lens", "text"),
    [
        ("a.qca.txt", "[0.1, -0.2, 0.001, 0.002, 0.05]", "a lens with 5 coefficients: allowed in this layout: the first 4"),
        ("a.toml", "[0.1, -0.2, 0.001, 0.002]", "allowed in the layout qualisys: .txt"),
    ],
)
def test_what_qualisys_cannot_hold_is_refused(tmp_path, name, lens, text):
    (tmp_path / "lens.toml").write_text(DISTORTED.format(lens))
    assert text in convert(tmp_path / "lens.toml", "-o", tmp_path / name, "--layout", "qualisys", status=1)
    assert not (tmp_path / name).exists()


def test_qualisys_keeps_distortion_and_writes_millimetres(tmp_path):
    (tmp_path / "lens.toml").write_text(DISTORTED.format("[0.1, -0.2, 0.001, 0.002]"))
    convert(tmp_path / "lens.toml", "-o", tmp_path / "a.qca.txt", "--layout", "qualisys", "--output-up-axis", "z")
    one, other = (
        read_calibration(tmp_path / name, axis)["left"] for name, axis in (("lens.toml", "y"), ("a.qca.txt", "z"))
    )
    assert_equal(one, other)
    element = ElementTree.parse(tmp_path / "a.qca.txt").getroot().find("cameras/camera/transform")
    assert element is not None
    x, y, z = (float(element.get(key, "")) for key in ("x", "y", "z"))
    np.testing.assert_allclose([y, z, x], 1000.0 * one.centre, atol=1e-6)


def test_nothing_is_overwritten_unless_wanted(tmp_path):
    target = tmp_path / "a.toml"
    target.write_text("mine")
    assert "exists already: allowed: another name, or --force" in convert(RING, "-o", target, status=1)
    assert target.read_text() == "mine"
    convert(RING, "-o", target, "--force")
    assert len(read_calibration(target)) > 1


def test_a_file_beside_the_output_is_not_overwritten_either(tmp_path):
    (tmp_path / "intri.yml").write_text("mine")
    options = ("-o", tmp_path / "extri.yml", "--layout", "easymocap")
    assert f"{tmp_path / 'intri.yml'}: exists already: allowed: another name, or --force" in convert(
        RING, *options, status=1
    )
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("intri.yml", "mine")]
    convert(RING, *options, "--force")
    assert len(read_calibration(tmp_path / "extri.yml")) > 1


@pytest.mark.parametrize(
    ("layout", "name", "text"),
    [
        ("easymocap", "cameras.yml", "allowed: a name with extri in it"),
        ("easymocap", "extri.toml", "suffix '.toml': allowed in the layout easymocap: .yml"),
        ("caliscope", "a.yml", "suffix '.yml': allowed in the layout caliscope: .toml"),
        ("anipose", "none/a.toml", "cannot be written: No such file"),
    ],
)
def test_wrong_outputs_are_refused_and_nothing_is_left(tmp_path, layout, name, text):
    assert text in convert(RING, "-o", tmp_path / name, "--layout", layout, status=1)
    assert os.listdir(tmp_path) == []


LAYOUTS = [
    ("anipose", "a.toml"), ("caliscope", "camera_array.toml"), ("qualisys", "a.qca.txt"),
    pytest.param("easymocap", "out/extri.yml", marks=pytest.mark.slow),  # read in a process of its own
]  # fmt: skip
SIZE_NOTE, VERTICAL_NOTE = "1920 x 1080 px is a guess", "the vertical and the floor are a guess"


def without_size(folder: Path) -> Path:
    """A calibration of EasyMocap that states no size."""
    matrix = np.array([[1500.0, 0.0, 962.0], [0.0, 1500.0, 541.5], [0.0, 0.0, 1.0]])
    contents: dict[str, dict[str, np.ndarray]] = {
        "intri.yml": {"K_left": matrix, "dist_left": np.zeros((1, 5))},
        "extri.yml": {"Rot_left": np.diag([1.0, -1.0, -1.0]), "T_left": np.array([[0.0], [1.0], [5.0]])},
    }
    for name, matrices in contents.items():
        storage = cv2.FileStorage(str(folder / name), cv2.FILE_STORAGE_WRITE)
        for key, value in matrices.items():
            storage.write(key, value)
        storage.release()
    return folder / "extri.yml"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::zenocap.common.errors.FileNote")
@pytest.mark.parametrize(("layout", "name"), LAYOUTS)
def test_a_guessed_size_is_marked_in_what_is_written_and_noted_where_that_is_read(tmp_path, layout, name):
    source, target = without_size(tmp_path), tmp_path / name
    target.parent.mkdir(exist_ok=True)
    output = convert(source, "-o", target, "--layout", layout)
    assert "the size of camera left is a guess, and marked as one in what is written" in output
    assert SIZE_NOTE in output
    again = convert(target, "-o", tmp_path / "again.toml")
    assert SIZE_NOTE in again
    assert SIZE_NOTE in convert(tmp_path / "again.toml", "-o", tmp_path / "third.toml")
    assert [camera.guessed for camera in read_calibration(target).values()] == [("size",)]
    certain = convert(RING, "-o", target, "--layout", layout, "--force")
    assert "is a guess" not in certain + convert(target, "-o", tmp_path / "again.toml", "--force")
    assert "guessed" not in target.read_text()


def test_a_guessed_size_is_marked_in_a_camera_info_too(tmp_path):
    convert(without_size(tmp_path), "-o", tmp_path / "info", "--layout", "ros")
    assert "are a guess" in (tmp_path / "info" / "left.yaml").read_text()
    with pytest.warns(FileNote, match="image_width and image_height, 1920 x 1080 px, are a guess"):
        lens = read_lenses(tmp_path / "info")["left"]
    assert (lens.size, lens.guessed) == ((1920, 1080), ("size",))


@pytest.mark.filterwarnings("ignore::zenocap.common.errors.FileNote")
@pytest.mark.parametrize(("layout", "name"), LAYOUTS)
def test_a_guessed_vertical_is_marked_in_every_layout(tmp_path, layout, name):
    cameras = {key: replace(camera, guessed=("vertical",)) for key, camera in read_calibration(RING).items()}
    write_calibration(tmp_path / "ring.toml", cameras)
    target = tmp_path / name
    target.parent.mkdir(exist_ok=True)
    output = convert(tmp_path / "ring.toml", "-o", target, "--layout", layout)
    assert output.count(VERTICAL_NOTE) == 1
    assert f"the vertical of camera {', '.join(cameras)} is a guess" in output
    assert convert(target, "-o", tmp_path / "again.toml").count(VERTICAL_NOTE) == 1
    assert {camera.guessed for camera in read_calibration(tmp_path / "again.toml").values()} == {("vertical",)}


def test_an_unknown_error_is_not_written_as_none(tmp_path):
    convert(RING, "-o", tmp_path / "a.toml")
    assert "error" not in tomllib.loads((tmp_path / "a.toml").read_text())["metadata"]
    write_calibration(tmp_path / "b.toml", read_calibration(RING), error_px=0.25)
    assert tomllib.loads((tmp_path / "b.toml").read_text())["metadata"]["error"] == 0.25


@pytest.mark.parametrize("value", ['"size"', '["focal length"]', "[1]"])
def test_what_is_no_name_of_a_guess_is_refused(tmp_path, value):
    (tmp_path / "a.toml").write_text(DISTORTED.format("[0.0, 0.0, 0.0, 0.0]") + f"guessed = {value}\n")
    assert "cam_01.guessed = " in convert(tmp_path / "a.toml", "-o", tmp_path / "b.toml", status=1)
