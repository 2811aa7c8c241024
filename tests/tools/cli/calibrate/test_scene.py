"""`calibrate scene`: the example, lens files, verdicts, and wrong files."""

import json
from functools import partial

import pytest

from tests.support.command import printed
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.ros_camera_info import GUESSED_SIZE
from zenocap.tools.cli.calibrate.scene import SCENE_EXAMPLE

LENS = """image_width: 640
image_height: 480
camera_name: any
camera_matrix:
  rows: 3
  cols: 3
  data: [600.0, 0.0, 319.5, 0.0, 600.0, 239.5, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.0, 0.0, 0.0, 0.0, 0.0]
"""
WITHOUT_SIZE = "\n".join(line for line in SCENE_EXAMPLE.splitlines() if not line.startswith("size"))
scene = partial(printed, "calibrate", "scene")


@pytest.fixture
def points(tmp_path):
    (tmp_path / "points.toml").write_text(scene("--example"))
    (tmp_path / "lens.yaml").write_text(LENS)
    return tmp_path / "points.toml"


@pytest.mark.parametrize("known", [False, True])
def test_the_example_gives_a_calibration(points, tmp_path, known):
    options = ("--lenses", tmp_path / "lens.yaml") if known else ()
    output = scene(points, *options, "-o", tmp_path / "a.toml")
    for text in ("cam01: at (", "expected error of a person in the middle: ", "without being noticed", "verdict: good"):
        assert text in output
    assert read_calibration(tmp_path / "a.toml")["cam01"].centre == pytest.approx([0.0, 1.0, 5.2], abs=0.02)


@pytest.mark.filterwarnings("ignore::zenocap.common.errors.FileNote")
def test_a_guessed_size_of_a_lens_stays_marked_unless_the_images_give_it(points, tmp_path):
    (tmp_path / "lens.yaml").write_text(GUESSED_SIZE + LENS.replace("image_height: 480", "image_height: 500"))
    for text, size, guessed in ((SCENE_EXAMPLE, (640, 480), ()), (WITHOUT_SIZE, (640, 500), ("size",))):
        points.write_text(text)
        scene(points, "--lenses", tmp_path / "lens.yaml", "-o", tmp_path / "a.toml", "--force")
        camera = read_calibration(tmp_path / "a.toml")["cam01"]
        assert (camera.size, camera.guessed) == (size, guessed)


def test_few_points_are_called_unchecked(points, tmp_path):
    text = "\n".join(line for line in SCENE_EXAMPLE.splitlines() if not line.startswith(("pole", "shelf", "size")))
    points.write_text(text)
    output = scene(points, "--lenses", tmp_path / "lens.yaml", "-o", tmp_path / "a.toml")
    assert "verdict: unchecked\n  cam01: an error in " in output


@pytest.mark.slow
def test_a_wrong_pick_is_poor_and_named_also_in_json(points, tmp_path):
    points.write_text(SCENE_EXAMPLE.replace("[448.7, 221.0]", "[348.7, 221.0]"))
    options = ("--lenses", tmp_path / "lens.yaml", "-o", tmp_path / "a.toml")
    assert "verdict: poor\n  cam01: pole is " in scene(points, *options, status=3)
    assert "exists already: allowed: another name, or --force" in scene(points, *options, status=1)
    data = json.loads(scene(points, *options, "--force", "--json", status=3))
    assert data["verdict"] == "poor"
    assert data["cameras"][0]["name"] == "cam01"


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("[points]", "[pints]", "points is missing; there are: cam01, pints; did you mean 'pints'"),
        ("corner = [0.0, 0.0, 0.0]", "corner = [0.0, 0.0]", "points: Expected `array` of length 3"),
        ("[1.5, 0.0, 0.0]", "[1500.0, 0.0, 0.0]", "points.door = [1500.0, 0.0, 0.0]: allowed: metres, up to 1000"),
        ("door = [492.6, 354.9]", "dor = [492.6, 354.9]", "cam01.dor: no such point; there are: corner, mark, door"),
        ("[492.6, 354.9]", "[792.6, 354.9]", "cam01.door = [792.6, 354.9]: allowed: inside the image of 640 x 480 px"),
        ("size = [640, 480]", "", "size is missing: allowed: width and height of the images, or --lenses"),
        ("size = [640, 480]", "size = [640, 0]", "size = [640, 0]: allowed: width and height in whole pixels"),
        ("[cam01]", "[points.more]", "points: Expected"),
        ("[448.7, 221.0]", "[448.7, ", "not TOML"),
    ],
)
def test_wrong_files_are_refused(points, tmp_path, old, new, text):
    assert old in SCENE_EXAMPLE
    points.write_text(SCENE_EXAMPLE.replace(old, new))
    assert text in scene(points, "-o", tmp_path / "a.toml", status=1)
    assert not (tmp_path / "a.toml").exists()


def test_lenses_must_fit(points, tmp_path):
    (tmp_path / "lens.yaml").write_text(LENS.replace("image_width: 640", "image_width: 1280"))
    output = scene(points, "--lenses", tmp_path / "lens.yaml", "-o", tmp_path / "a.toml", status=1)
    assert "size = [640, 480]: allowed: that of the lens of cam01, [1280, 480]" in output
    two = tmp_path / "two"
    two.mkdir()
    for name in ("left", "right"):
        (two / f"{name}.yaml").write_text(LENS.replace("camera_name: any", f"camera_name: {name}"))
    output = scene(points, "--lenses", two, "-o", tmp_path / "a.toml", status=1)
    assert "no lens of cam01; there are: left, right; allowed: one lens for all" in output


def test_without_a_file_the_command_says_how_to_get_one():
    assert "--example prints one" in scene(status=2)
