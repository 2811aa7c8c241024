"""`zenocap cameras`: the list of this machine, streams that are tried, pictures, reasons."""

import json
from collections.abc import Iterator
from itertools import repeat
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from tests.support.command import zenocap
from tests.support.fake_v4l2 import METADATA_NODE, FakeDevice, fake_dev
from tests.support.mjpeg_server import MjpegServer
from zenocap.common.errors import UserError
from zenocap.common.rig.sources import without_password
from zenocap.common.video.v4l2 import listing
from zenocap.common.video.v4l2.listing import found_cameras
from zenocap.tools.setup.cameras import pictures, streams
from zenocap.tools.setup.cameras.pictures import written_pictures
from zenocap.tools.setup.cameras.streams import check_address, tried_streams
from zenocap.tools.setup.cameras.text import camera_data, camera_lines, stream_lines


@pytest.fixture
def server() -> Iterator[MjpegServer]:
    with MjpegServer(size=(96, 64), fps=20.0) as running:
        yield running


def test_the_list_names_source_modes_and_controls(tmp_path):
    opener = fake_dev(tmp_path, {0: FakeDevice(), 1: FakeDevice(capabilities=METADATA_NODE)}, {"v4l/by-id/usb-A": 0})
    text = "\n".join(camera_lines(found_cameras(tmp_path, opener)))
    assert f'source = "{tmp_path}/v4l/by-id/usb-A"' in text
    assert "video1" not in text
    assert "MJPG  1280 x 720: 60, 30 frames/s" in text
    assert "Brightness: 3 (-64 to 64; default 0)" in text
    assert "Auto Exposure: Aperture Priority Mode (1 Manual Mode, 3 Aperture Priority Mode; default 3)" in text
    assert "Exposure Time, Absolute: 312 (1 to 5000; default 157; at present automatic, or without effect)" in text


def test_a_camera_without_a_stable_name_says_so_and_one_without_answer_the_reason(tmp_path):
    opener = fake_dev(tmp_path, {0: FakeDevice(sizes={})}, {})
    (found,) = found_cameras(tmp_path, opener)
    assert any("may change when plugged in again" in line for line in camera_lines([found]))
    data = json.loads(json.dumps(camera_data(found, None, "")))
    assert (data["stable"], data["modes"], data["problem"]) == (False, [], "")
    assert list(camera_lines([])) == ["no camera: the video devices of this machine give no images"]


@pytest.mark.slow
def test_a_stream_is_tried(server):
    (found,) = tried_streams([server.url], 0.5)
    assert (found.size, found.codec, found.problem) == ((96, 64), "mjpeg", "")
    assert found.image is not None
    assert found.image.shape == (64, 96, 3)
    assert 5 < found.rate < 40
    assert 0 < found.first_s < 5
    assert f"{server.url}: 96 x 64, " in next(iter(stream_lines([found])))


def test_a_stream_without_image_has_a_reason_and_no_password(server):
    refused, wrong = tried_streams(["rtsp://me:secret@127.0.0.1:9/a", server.url.replace("stream", "other")])
    assert refused.problem.startswith("Connection refused: nothing answers at this port")
    assert "secret" not in str(refused)
    assert "the camera has no stream of this name" in wrong.problem


@pytest.mark.parametrize(
    "url", ["rtsp://", "ftp://a:secret@host/b", "http://a:secret@host:99999/", "video.mp4", "http://[::1"]
)
def test_a_wrong_address_is_refused_without_its_password(url):
    with pytest.raises(UserError, match=r"allowed: rtsp://HOST") as caught:
        check_address(url)
    assert "secret" not in str(caught.value)


def test_passwords_with_signs_are_left_out():
    assert without_password("rtsp://me:a@b:c@host:1/x@y") == "rtsp://host:1/x@y"
    assert without_password("rtsp:me:a@host/x") == "rtsp:host/x"
    assert without_password("mjpeg:http://me:a@b@host:1/x@y") == "mjpeg:http://host:1/x@y"


def test_pictures_are_small_and_have_names_of_their_own(tmp_path):
    images = {"/dev/video0": np.zeros((1080, 1920, 3), np.uint8), "/dev/video-0": np.zeros((10, 20, 3), np.uint8)}
    paths = written_pictures(tmp_path / "a" / "b", images | {"http://h/..": images["/dev/video-0"]})
    assert [Path(path).name for path in paths.values()] == ["video0.jpg", "video-0.jpg", "h.jpg"]
    assert cv2.imread(paths["/dev/video0"]).shape == (270, 480, 3)
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match=r"--pictures .*: allowed: a folder that can be written"):
        written_pictures(tmp_path / "file" / "b", images)


@pytest.mark.slow
def test_the_command_lists_and_writes_pictures(tmp_path, monkeypatch):
    opener = fake_dev(tmp_path, {0: FakeDevice(), 1: FakeDevice()}, {})
    monkeypatch.setattr(listing.found_cameras, "__defaults__", (tmp_path, opener))
    grey = np.full((48, 64, 3), 128, np.uint8)
    monkeypatch.setattr(pictures, "camera_image", lambda camera: grey if camera.path.name == "video0" else None)
    status, out, err = zenocap("cameras", "-o", str(tmp_path / "seen"))
    assert status == 1
    assert f"picture of {tmp_path}/video0: " in out
    assert f"{tmp_path}/video1: no image: another program uses the camera" in err
    status, out, _ = zenocap("cameras", "--json")
    assert status == 0
    assert [one["device"] for one in json.loads(out)] == [f"{tmp_path}/video0", f"{tmp_path}/video1"]


@pytest.mark.nightly
def test_the_command_tries_streams(server):
    status, out, _ = zenocap("cameras", server.url, "http://127.0.0.1:9/", "--json")
    good, bad = json.loads(out)
    assert (status, good["size"], bad["size"]) == (1, [96, 64], None)
    assert "refused" in bad["problem"]
    status, _, err = zenocap("cameras", "0")
    assert status == 1
    assert err.startswith("error: 0: allowed: rtsp://")


def test_a_stream_whose_packets_give_no_image_is_left_after_a_while(monkeypatch):
    monkeypatch.setattr(streams, "NO_IMAGE_S", 0.0)
    endless = SimpleNamespace(demux=lambda stream: repeat(SimpleNamespace(decode=lambda: [])))
    assert list(streams._frames(endless, None, 0.0)) == []
