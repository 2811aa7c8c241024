"""Cameras that are filmed before they are calibrated."""

from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.common.rig.sources import Device, Stream
from zenocap.tools.setup.cameras.named_sources import named_sources


def test_cameras_have_their_names_sources_and_the_size():
    one, two = named_sources(["left=/dev/video0", "right=rtsp://camera/stream?a=b"], (1280, 720), 25.0)
    assert (one.id, one.camera.name, one.calibrated_size, one.fps) == ("left", "left", (1280, 720), 25.0)
    assert one.source == Device(0)
    assert two.source == Stream("rtsp://camera/stream?a=b")


def test_stable_names_are_sources():
    (one,) = named_sources(["left=/dev/v4l/by-id/usb-Maker-index0"], (640, 480), 30.0)
    assert one.source == Device(None, Path("/dev/v4l/by-id/usb-Maker-index0"))


@pytest.mark.parametrize(
    ("texts", "text"),
    [
        (["rig.tml", "left=0"], "rig.tml: allowed: NAME=SOURCE"),
        (["=0"], "=0: allowed: NAME=SOURCE"),
        (["left="], "left=: allowed: NAME=SOURCE"),
        (["my cam=0"], "my cam=0: allowed: NAME=SOURCE"),
        (["left=/dev/videoX"], "left=/dev/videoX: allowed: /dev/video0 and so on"),
        (["left=film.mp4"], "left=film.mp4: no camera and no stream"),
        (["left=0", "left=1"], "left=1: this name or this source was given already"),
        (["a=rtsp://me:secret@host/1", "b=rtsp://me:secret@host/1"], "b=rtsp://host/1: this name or this source"),
        (["left=0", "right=0"], "right=0: this name or this source was given already"),
    ],
)
def test_wrong_sources_are_refused(texts, text):
    with pytest.raises(UserError) as raised:
        named_sources(texts, (640, 480), 30.0)
    assert text in str(raised.value)
