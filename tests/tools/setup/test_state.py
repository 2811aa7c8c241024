"""The steps of a set-up follow from the files in its folder."""

import os
from dataclasses import replace

import pytest

from tests.support.simulated_cameras import paper_cameras
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.errors import UserError
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.sources import AdaptiveBackground
from zenocap.tools.setup import state
from zenocap.tools.setup.state import CALIBRATION, CAMERAS, RIG, TAKES, Cameras, named, next_step, write_cameras

SOURCES = {"cam01": "/dev/video0", "cam02": 'rtsp://user:a"b\\c@192.168.1.20/stream'}
CAMERAS_1 = Cameras(SOURCES, (1280, 720), 25.0)


def calibrate(folder, *names):
    cameras = [replace(one, size=(1280, 720)) for one in paper_cameras((640, 480))]
    write_calibration(folder / CALIBRATION, {name: replace(cameras[k % 2], name=name) for k, name in enumerate(names)})


def test_the_steps_follow_from_the_files(tmp_path):
    folder = tmp_path / "studio"
    assert next_step(folder) == "cameras"
    write_cameras(folder, CAMERAS_1)
    assert next_step(folder) == "look"
    write_cameras(folder, replace(CAMERAS_1, looked=True))
    assert next_step(folder) == "calibration"
    calibrate(folder, "cam01", "cam02")
    assert next_step(folder) == "rig"
    (folder / RIG).write_text(state.rig_text("studio", CAMERAS_1), encoding="utf-8")
    assert next_step(folder) == "take"
    (folder / TAKES).mkdir()
    (folder / TAKES / "one.mcap").touch()
    assert next_step(folder) is None


def test_cameras_are_read_as_written_and_only_for_their_owner(tmp_path):
    write_cameras(tmp_path, CAMERAS_1)
    assert state.read_cameras(tmp_path) == CAMERAS_1
    assert os.stat(tmp_path / CAMERAS).st_mode & 0o077 == 0


def test_the_rig_file_is_a_rig(tmp_path):
    calibrate(tmp_path, "cam01", "cam02")
    (tmp_path / RIG).write_text(state.rig_text("my studio", CAMERAS_1), encoding="utf-8")
    rig = load_rig(tmp_path / RIG, files=False)
    assert rig.name == "my-studio"
    assert [viewer.id for viewer in rig.viewers] == ["cam01", "cam02"]
    assert rig.viewers[0].fps == 25.0
    assert {viewer.background for viewer in rig.viewers} == {AdaptiveBackground()}
    assert rig.viewers[0].camera.size == (640, 360)  # reduced


def test_a_calibration_of_other_cameras_is_refused(tmp_path):
    write_cameras(tmp_path, replace(CAMERAS_1, looked=True))
    calibrate(tmp_path, "cam01", "left")
    with pytest.raises(UserError, match="no camera cam02; there are: cam01, left"):
        next_step(tmp_path)


def test_a_calibration_of_another_shape_is_refused_before_the_rig_file_and_the_step_can_be_repeated(tmp_path):
    write_cameras(tmp_path, replace(CAMERAS_1, size=(640, 480), looked=True))
    calibrate(tmp_path, "cam01", "cam02")
    with pytest.raises(
        state.StepError,
        match=r"cam01: for images of 1280 x 720, and cameras.toml requests 640 x 480, .* --again calibration",
    ):
        next_step(tmp_path)
    assert state.reached_step(tmp_path) == "calibration"
    write_cameras(tmp_path, replace(CAMERAS_1, size=(640, 360), looked=True))  # of the same shape
    assert next_step(tmp_path) == "rig"
    (tmp_path / RIG).write_text("name = 3")
    with pytest.raises(state.StepError, match=r"--again rig"):
        next_step(tmp_path)
    assert state.reached_step(tmp_path) == "rig"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("sources = 3", "sources"),
        ('size = [1280, 720]\nfps = 30\n[sources]\none = "0"', "two cameras or more"),
        ('size = [1280]\nfps = 30\n[sources]\none = "0"\ntwo = "1"', "size"),
        ('size = [1280, 720]\nfps = 0\n[sources]\none = "0"\ntwo = "1"', "fps"),
        ('size = [1280, 720]\nfps = 30\n[sources]\none = "0"\ntwo = "/dev/nothing"', "two=/dev/nothing"),
    ],
)
def test_a_wrong_file_is_named(tmp_path, text, reason):
    (tmp_path / CAMERAS).write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=reason):
        next_step(tmp_path)


@pytest.mark.parametrize("text", ["left", "=0", "left=", "le ft=0", "left=/dev/nothing", "le ft=rtsp://user:secret@h/s"])
def test_wrong_names_and_sources_are_refused_without_their_password(text):
    with pytest.raises(UserError, match="allowed") as caught:
        named(text)
    assert "secret" not in str(caught.value)


def test_takes_are_in_the_order_of_their_time(tmp_path):
    (tmp_path / TAKES).mkdir()
    for k, name in enumerate(("b.mcap", "a.mcap")):
        (tmp_path / TAKES / name).touch()
        os.utime(tmp_path / TAKES / name, (k, k))
    assert [path.name for path in state.takes_in(tmp_path)] == ["b.mcap", "a.mcap"]
