"""Lens files: what OpenCV's calibration programs write, folders of them, and wrong ones."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.common.camera.test_calibration_files import GOOD, ROS, storage
from tests.common.camera.test_fisheye import FILE as FISHEYE
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens, of_images
from zenocap.common.camera.lens_files import read_lenses
from zenocap.common.errors import UserError

MATRIX = np.array([[600.0, 0, 319.5], [0, 601.0, 239.5], [0, 0, 1]])


def opencv_file(path: Path, capitals: bool = False, fisheye: int | None = None) -> Path:
    """As OpenCV's calibration.cpp and camera_calibration.cpp write it."""
    values = {"calibration_time": "Mon Nov 23 2026", "image_width": 640, "image_height": 480}
    if fisheye is not None:
        values["fisheye_model"] = fisheye
    values["Camera_Matrix" if capitals else "camera_matrix"] = MATRIX
    coefficients = np.array([[0.1, -0.2, 0.001, 0.002] + [0.01] * (not fisheye)]).T
    values["Distortion_Coefficients" if capitals else "distortion_coefficients"] = coefficients
    storage(path, values)
    return path


@pytest.mark.parametrize(
    ("name", "capitals", "fisheye"), [("a.yml", False, None), ("a.xml", False, 0), ("a.xml", True, 1), ("a.yaml", True, 1)]
)
def test_files_of_opencvs_programs_are_read(tmp_path, name, capitals, fisheye):
    path = opencv_file(tmp_path / name, capitals, fisheye)
    for _ in range(2):  # then with a byte-order mark
        lens = read_lenses(path)["a"]
        assert (lens.size, lens.fisheye) == ((640, 480), bool(fisheye))
        np.testing.assert_array_equal(lens.matrix, MATRIX)
        np.testing.assert_array_equal(lens.distortions[:4], [0.1, -0.2, 0.001, 0.002])
        path.write_text(path.read_text(), encoding="utf-8-sig")


def test_a_folder_has_one_file_for_each_camera(tmp_path):
    opencv_file(tmp_path / "left.xml")
    (tmp_path / "head.yaml").write_text(ROS)
    assert list(read_lenses(tmp_path)) == ["webcam", "left"]
    (tmp_path / "again.yaml").write_text(ROS)
    with pytest.raises(UserError, match="camera 'webcam' twice"):
        read_lenses(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match=r"no \.yaml, \.yml, \.xml in this folder"):
        read_lenses(tmp_path / "empty")


def test_a_calibration_has_lenses_too_and_a_lens_is_no_calibration(tmp_path):
    (tmp_path / "calibration.toml").write_text(GOOD)
    assert read_lenses(tmp_path / "calibration.toml")["left"].size == (640, 480)
    for path in (opencv_file(tmp_path / "a.yml"), opencv_file(tmp_path / "a.xml")):
        with pytest.raises(UserError, match="has intrinsics only, no position and orientation; allowed: a calibration"):
            read_calibration(path)


def test_a_fisheye_lens_that_shows_directions_twice_is_refused(tmp_path):
    path = opencv_file(tmp_path / "a.yml", fisheye=1)
    path.write_text(re.sub(r"-[02.]+\d*(e-01)?,", "-0.9,", path.read_text()))
    with pytest.raises(UserError, match=r"coefficients = .*-0\.9.*: allowed: a lens that shows no direction twice within"):
        read_lenses(path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("image_width: 640", "image_width: 0", "size = .*whole pixels"),
        ("image_height: 480\n", "",
         "image_height is missing; there are: camera_matrix, distortion_coefficients, image_width"),
        ("rows: 5", "rows: 3", "distortion_coefficients = .*: allowed: 4 or 5 or 8"),
    ],
)  # fmt: skip
def test_errors_name_file_and_key(tmp_path, old, new, text):
    path = opencv_file(tmp_path / "a.yml")
    content = path.read_text()
    assert old in content
    content = content.replace(old, new)
    if "rows: 3" in new:
        content = re.sub(r"(rows: 3\n +cols: 1\n +dt: d\n +data: \[)[^]]*", r"\1 0.1, 0.2, 0.3 ", content)
    path.write_text(content)
    with pytest.raises(UserError, match=rf"a\.yml: {text}"):
        read_lenses(path)


def test_opencv_xml_in_easymocaps_layout_is_a_calibration(tmp_path):
    (tmp_path / "calibration.toml").write_text(GOOD)
    left = read_calibration(tmp_path / "calibration.toml")["left"]
    storage(tmp_path / "intri.xml", {"K_left": left.matrix, "dist_left": np.zeros((1, 5))})
    storage(tmp_path / "extri.xml", {"Rot_left": left.rotation, "T_left": left.translation.reshape(3, 1)})
    (tmp_path / "extri.xml").write_text((tmp_path / "extri.xml").read_text(), encoding="utf-8-sig")
    read = read_calibration(tmp_path / "extri.xml")["left"]
    np.testing.assert_allclose(read.centre, left.centre)


@pytest.mark.parametrize("content", [GOOD, FISHEYE])
@pytest.mark.parametrize(
    ("guessed", "images", "size", "left"),
    [
        (("size", "vertical"), (656, 492), (656, 492), ("vertical",)),
        (("size",), (640, 480), (640, 480), ()),
        (("size",), (320, 240), (640, 480), ("size",)),
        (("size",), (960, 720), (640, 480), ("size",)),
        ((), (656, 492), (640, 480), ()),
    ],
)
def test_the_size_of_images_replaces_a_guess_unless_they_are_scaled(tmp_path, content, guessed, images, size, left):
    (tmp_path / "calibration.toml").write_text(content)
    (camera,) = read_calibration(tmp_path / "calibration.toml").values()
    camera = replace(camera, guessed=guessed)
    found, lens = of_images(camera, images), of_images(Lens.of(camera), images)
    assert (found.size, found.guessed) == (size, left)
    assert (lens.size, lens.guessed) == (size, tuple(name for name in left if name == "size"))
    assert Lens.of(found).size == size
    np.testing.assert_array_equal(lens.matrix, Lens.of(camera).matrix)
