"""Cameras that a live page shows."""

import pytest

from tests.support.video_file import write_video
from tests.support.videos import grey_frames
from zenocap.common.errors import UserError
from zenocap.common.rig.rig import demo_rig_file, load_rig
from zenocap.common.rig.sources import Device, Stream, VideoFile
from zenocap.common.video.v4l2.listing import FoundCamera
from zenocap.tools.setup.page.sources import live_viewers


def none(path):
    raise AssertionError(path)


def test_named_sources_may_be_video_files_with_their_size_and_rate(tmp_path):
    write_video(tmp_path / "film.mp4", grey_frames(5, (96, 64)), fps=12)
    found, notes = live_viewers(["left=0", f"right={tmp_path / 'film.mp4'}", "door=rtsp://h/1"], (640, 480), 25.0, none)
    assert [type(one.source) for one in found] == [Device, VideoFile, Stream]
    assert [(one.calibrated_size, one.fps) for one in found[:2]] == [((640, 480), 25.0), ((96, 64), 12.0)]
    assert notes == []


def test_without_names_all_cameras_of_the_machine_are_shown():
    cameras = [
        FoundCamera("/dev/video0", "/dev/v4l/by-id/usb-A", name="A"),
        FoundCamera("/dev/video2", "/dev/video2", problem="no permission"),
        FoundCamera("/dev/video4", "/dev/video4", name="B"),
    ]
    found, notes = live_viewers([], (640, 480), 30.0, none, lambda: cameras)
    assert [one.camera.name for one in found] == ["cam01", "cam02"]
    assert found[1].source == Device(4)
    assert "/dev/video2: no permission" in notes[0]


def test_no_usable_camera_is_one_error_with_the_reason():
    cameras = [FoundCamera("/dev/video2", "/dev/video2", problem="no permission")]
    with pytest.raises(UserError, match="no camera of this machine gives images: /dev/video2: no permission: allowed"):
        live_viewers([], (640, 480), 30.0, none, lambda: cameras)


def test_the_viewers_of_a_rig_are_shown():
    found, notes = live_viewers([str(demo_rig_file())], (640, 480), 30.0, load_rig)
    assert len(found) == len(load_rig(demo_rig_file()).viewers)
    assert notes == []


@pytest.mark.parametrize(
    ("texts", "text"),
    [
        (["left=0", "right"], "right: allowed: a rig file with cameras, or NAME=SOURCE"),
        (["left=missing.mp4"], "missing.mp4: no such video file"),
        (["left=actor:demo"], "no camera and no stream and no video"),
    ],
)
def test_wrong_sources_are_refused(texts, text):
    with pytest.raises(UserError) as raised:
        live_viewers(texts, (640, 480), 30.0, none)
    assert text in str(raised.value)
