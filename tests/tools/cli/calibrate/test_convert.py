"""`calibrate convert`: every layout is read again, by zenocap and by the readers of other programs."""

import os
import tomllib
import xml.etree.ElementTree as ElementTree
from functools import partial

import cv2
import numpy as np
import pytest

from tests.common.camera.test_fisheye import FILE as FISHEYE
from tests.support.command import printed
from tests.support.places import ROOT
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.lens_files import read_lenses
from zenocap.common.camera.pinhole import Camera

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
