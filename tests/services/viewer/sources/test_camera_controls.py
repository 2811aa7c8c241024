"""Controls of a camera: fixed values, automatic ones, and those that are fixed after a while and stay."""

from pathlib import Path

import pytest

from tests.support.fake_v4l2 import FakeDevice
from zenocap.common.errors import OpenError
from zenocap.common.rig.camera_settings import CameraSettings
from zenocap.services.viewer.sources.camera_controls import CameraControls

AUTO_WHITE, GAIN, WHITE, AUTO_EXPOSURE, EXPOSURE, CHANGES_RATE = (
    0x0098090C, 0x00980913, 0x0098091A, 0x009A0901, 0x009A0902, 0x009A0903,
)  # fmt: skip


def controls_of(device: FakeDevice, settings: CameraSettings) -> tuple[CameraControls, list[str]]:
    reports: list[str] = []
    return CameraControls("camera 0", Path("/dev/video0"), settings, reports.append, device.open), reports


def test_locked_controls_are_automatic_at_first_and_then_keep_what_the_camera_chose():
    device = FakeDevice()
    device.controls[AUTO_EXPOSURE].value = 1
    controls, reports = controls_of(device, CameraSettings())
    assert controls.begin()
    assert device.written == [(CHANGES_RATE, 0), (AUTO_EXPOSURE, 3), (AUTO_WHITE, 1)]
    device.controls[EXPOSURE].value, device.controls[WHITE].value = 250, 5000  # what the camera chooses
    device.written.clear()
    controls.lock()
    assert device.written == [(AUTO_EXPOSURE, 1), (EXPOSURE, 250), (GAIN, 12), (AUTO_WHITE, 0), (WHITE, 5000)]
    assert reports == [
        "camera 0: focus = locked: left out: the camera has no setting of this kind",
        "camera 0: fixed: exposure 250, gain 12, white_balance 5000",
    ]


def test_a_camera_that_comes_back_gets_the_same_values_at_once():
    controls, reports = controls_of(FakeDevice(), CameraSettings())
    controls.begin()
    controls.lock()
    again = FakeDevice()
    controls.open_camera = again.open
    again.controls[EXPOSURE].value = 9
    assert not controls.begin()
    assert again.controls[EXPOSURE].value == 312
    assert again.controls[AUTO_EXPOSURE].value == 1
    assert len(reports) == 2


def test_numbers_are_set_at_once_and_automatic_ones_stay_automatic():
    device = FakeDevice()
    controls, _ = controls_of(device, CameraSettings(exposure=100, gain=7, white_balance="auto", focus="auto"))
    assert not controls.begin()
    assert device.written == [(CHANGES_RATE, 0), (AUTO_EXPOSURE, 1), (EXPOSURE, 100), (GAIN, 7), (AUTO_WHITE, 1)]
    controls.lock()
    assert device.controls[AUTO_WHITE].value == 1
    slow = FakeDevice()
    controls_of(slow, CameraSettings(exposure="auto"))[0].begin()
    assert slow.controls[CHANGES_RATE].value == 1


def test_a_value_out_of_range_or_a_format_that_is_not_there_is_an_error_with_those_allowed():
    with pytest.raises(OpenError, match="camera 0: exposure = 9000: allowed: 1 to 5000"):
        controls_of(FakeDevice(), CameraSettings(exposure=9000))[0].begin()
    with pytest.raises(OpenError, match="camera 0: format = 'NV12': allowed: MJPG, YUYV"):
        controls_of(FakeDevice(), CameraSettings(format="NV12"))[0].begin()


def test_a_camera_without_controls_and_one_that_cannot_be_asked_go_on():
    controls, reports = controls_of(FakeDevice(controls={}), CameraSettings(gain=3))
    assert not controls.begin()
    assert len(reports) == 4
    assert "camera 0: gain = 3: left out: the camera has no setting of this kind" in reports
    assert not controls.begin()
    assert len(reports) == 4  # each once
    missing = CameraControls("camera 0", Path("/nothing"), CameraSettings(), reports.append)
    assert not missing.begin()
    assert reports[-1] == "camera 0: controls cannot be set: No such file or directory"
