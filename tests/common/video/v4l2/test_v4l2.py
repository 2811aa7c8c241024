"""Cameras of Linux: modes, controls and stable names from the kernel's answers."""

import errno
import os
from unittest.mock import Mock

import pytest

from tests.support import fake_v4l2
from tests.support.fake_v4l2 import METADATA_NODE, FakeDevice, fake_dev
from zenocap.common.errors import UserError
from zenocap.common.video.v4l2 import listing, structures
from zenocap.common.video.v4l2.camera import Mode, V4l2Camera, fourcc_text
from zenocap.common.video.v4l2.listing import FoundCamera, found_cameras


@pytest.mark.parametrize(
    "name",
    ["QUERYCAP", "ENUM_FMT", "G_CTRL", "S_CTRL", "QUERYMENU", "ENUM_FRAMESIZES", "ENUM_FRAMEINTERVALS", "QUERY_EXT_CTRL"],
)
def test_request_numbers_which_contain_the_sizes_of_the_structures_are_those_of_the_kernel(name):
    assert getattr(structures, name) == getattr(fake_v4l2, name)


def test_modes_have_format_size_and_rates(tmp_path):
    with FakeDevice().open(tmp_path) as camera:
        assert (camera.name, camera.driver, camera.bus) == ("Webcam: Webcam", "uvcvideo", "usb-0000:00:14.0-1")
        assert camera.is_camera
        assert camera.modes() == (
            Mode("MJPG", (1280, 720), (60.0, 30.0)),
            Mode("MJPG", (640, 480), (30.0,)),
            Mode("YUYV", (640, 480), (30.0, 15.0)),
        )
    with FakeDevice(sizes={"NV12": {(1920, 1080): [50]}}, stepwise=True).open(tmp_path) as camera:
        assert camera.modes() == (Mode("NV12", (1920, 1080), (50.0,), (32, 16)),)


def test_controls_have_range_default_value_and_menu(tmp_path):
    with FakeDevice().open(tmp_path) as camera:
        controls = {control.name: control for control in camera.controls()}
        assert "Reset" not in controls
        brightness, exposure = controls["Brightness"], controls["Exposure Time, Absolute"]
        assert (brightness.minimum, brightness.maximum, brightness.default, brightness.value) == (-64, 64, 0, 3)
        assert exposure.inactive
        assert not brightness.inactive
        assert controls["Auto Exposure"].menu == {1: "Manual Mode", 3: "Aperture Priority Mode"}
        camera.set(0x00980900, -7)
        assert camera.get(0x00980900) == -7
        with pytest.raises(OSError, match="out of range"):
            camera.set(0x00980900, 65)


def test_a_driver_that_repeats_a_control_or_never_ends_a_list_does_not_stop_the_program(tmp_path):
    class Endless(FakeDevice):
        def _control(self, view: memoryview) -> None:
            view[0:4] = (0x80000000 | 5).to_bytes(4, "little")

        def _interval(self, view: memoryview) -> None:
            view[16:28] = b"\1\0\0\0" * 3

    with Endless().open(tmp_path) as camera:
        assert len(camera.controls()) <= 1
        assert camera.modes()[0].rates == (1.0,)


def test_a_file_that_is_no_device_is_refused_and_closed(tmp_path):
    path = tmp_path / "video0"
    path.write_bytes(b"")
    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(OSError, match="Inappropriate ioctl") as caught:
        V4l2Camera(path)
    assert caught.value.errno == errno.ENOTTY
    assert len(os.listdir("/proc/self/fd")) == before


def test_cameras_are_listed_with_stable_names_and_without_nodes_of_metadata(tmp_path):
    devices = {10: FakeDevice(name="Ten"), 2: FakeDevice(name="Two"), 3: FakeDevice(capabilities=METADATA_NODE)}
    links = {"v4l/by-id/usb-Two-index0": 2, "v4l/by-path/pci-usb-0:1-index0": 2, "v4l/by-path/pci-usb-0:2-index0": 10}
    opener = fake_dev(tmp_path, devices, links)
    (tmp_path / "video-codec").touch()
    two, ten = found_cameras(tmp_path, opener)
    assert (two.name, two.source, two.is_stable) == ("Two", f"{tmp_path}/v4l/by-id/usb-Two-index0", True)
    assert (ten.name, ten.source) == ("Ten", f"{tmp_path}/v4l/by-path/pci-usb-0:2-index0")


def test_a_camera_that_cannot_be_asked_is_listed_with_the_reason(tmp_path):
    path = tmp_path / "video0"
    path.touch()
    assert found_cameras(tmp_path, Mock(side_effect=PermissionError(errno.EACCES, "Permission denied"))) == (
        FoundCamera(path, str(path), problem="no permission: add this user to the group `video` and log in again"),
    )
    assert "Inappropriate ioctl" in found_cameras(tmp_path)[0].problem


def test_a_machine_without_cameras_is_told_why(tmp_path, monkeypatch):
    with pytest.raises(UserError, match=r"video\*: no such device: no camera is plugged in, its driver .* a container"):
        found_cameras(tmp_path)
    monkeypatch.setattr(listing.sys, "platform", "darwin")
    with pytest.raises(UserError, match="listed on Linux only, not on darwin: a rig file takes them by number"):
        found_cameras(tmp_path)


def test_names_of_formats():
    assert fourcc_text(0x47504A4D) == "MJPG"
    assert fourcc_text(0x20363159 | 1 << 31) == "Y16-BE"
