"""Viewers that camera hosts run: the assignment has the whole viewer and nothing else."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace as replaced

from tests.support.simulated_cameras import paper_cameras
from zenocap.common import codec
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.errors import UserError
from zenocap.common.messages import AssignQuery
from zenocap.common.rig.camera_settings import CameraSettings
from zenocap.common.rig.hosted import assignment, hosted_cameras, hosted_rig
from zenocap.common.rig.rig import Rig, load_rig
from zenocap.common.rig.sources import Announced, Device, FirstFrames, Mog2, Stream

STREAM = Stream("rtsp://user:secret@1.2.3.4/s")


def rig(folder: Path, extra: str = "", method: str = "hybrid") -> Rig:
    cameras = zip(("cam01", "cam02"), paper_cameras((1280, 960)), strict=True)
    write_calibration(folder / "calibration.toml", dict(cameras))
    viewers = "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "{name}"\nsource = "discover:lab{k}/cam"\nfps = {25 - 5 * k}\n{extra}\n'
        for k, name in enumerate(("cam01", "cam02"))
    )
    (folder / "rig.toml").write_text(
        f'name = "studio"\ncalibration = "calibration.toml"\nmethod = "{method}"\n{viewers}', encoding="utf-8"
    )
    return load_rig(folder / "rig.toml")


def sent(query: AssignQuery) -> AssignQuery:
    return codec.decode(codec.encode(query), AssignQuery)


@pytest.mark.parametrize("method", ["hybrid", "two-view", "both"])
def test_the_viewer_of_a_host_is_that_of_the_rig(tmp_path, method):
    one = rig(tmp_path, 'background = "first:45"\npreview = true', method)
    assert [(camera.viewer, camera.source) for camera in hosted_cameras(one)] == [
        ("0", Announced("lab0", "cam")), ("1", Announced("lab1", "cam")),
    ]  # fmt: skip
    there = hosted_rig(sent(assignment(one, "0", 5)), STREAM, tmp_path, previews=True)
    own, other = one.viewer("0"), there.viewer("0")
    assert (there.name, there.digest, there.fps, there.additions) == (one.name, one.digest, 20.0, one.additions)
    assert (there.tracker is None) == (method != "hybrid")  # with both, viewers run the exchange
    assert replace(other, camera=own.camera, source=own.source) == own
    assert other.source == STREAM
    for name in ("matrix", "distortions", "rotation", "translation"):
        np.testing.assert_array_equal(getattr(other.camera, name), getattr(own.camera, name))
    assert (other.camera.name, other.camera.size) == (own.camera.name, own.camera.size)
    assert other.background == FirstFrames(45)


def test_small_pictures_stay_where_they_may_not_leave(tmp_path):
    query = assignment(rig(tmp_path, "preview = true"), "0", 5)
    assert not hosted_rig(query, STREAM, tmp_path, previews=False).viewers[0].preview


def test_settings_of_the_camera_and_other_backgrounds_are_sent(tmp_path):
    one = rig(tmp_path, 'background = "mog2"\nexposure = 120\nfocus = "auto"\nformat = "YUYV"')
    there = hosted_rig(sent(assignment(one, "1", 5)), Device(3), tmp_path, previews=False).viewers[0]
    assert there.source == Device(3, None, CameraSettings("YUYV", exposure=120, focus="auto"))
    assert there.background == Mog2()


def test_no_picture_of_the_scene_is_sent(tmp_path):
    (tmp_path / "empty.png").touch()
    with pytest.raises(UserError, match=r"viewer\[0\].background = 'image:empty.png': allowed .*first:N, .*median"):
        rig(tmp_path, 'background = "image:empty.png"')


@pytest.mark.parametrize("source", ["discover:", "discover:lab0", "discover:lab0/a/b", "discover:../a", "discover:a/.b"])
def test_other_names_are_refused(tmp_path, source):
    path = rig(tmp_path).base / "rig.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("discover:lab0/cam", source), encoding="utf-8")
    with pytest.raises(UserError, match=r"discover:MACHINE/CAMERA, as `zenocap cameras --discover` lists them"):
        load_rig(path)


def with_viewer(**changes: object) -> Callable[[AssignQuery], AssignQuery]:
    return lambda query: replaced(query, viewer=replaced(query.viewer, **changes))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (with_viewer(settings={"path": "/etc/passwd"}), "path = '/etc/passwd'"),
        (with_viewer(settings={"format": "../../x"}), "format = "),
        (with_viewer(size=(640, 640)), "the shape of the calibrated"),
        (with_viewer(size=(16384, 16384), calibrated_size=(16384, 16384)), "pixels at most"),
        (with_viewer(size=(1600, 1200)), r"size = \[1600, 1200\]: allowed: at most the calibrated 1280 x 960 px"),
        (
            with_viewer(background="first", empty_frames=10_000, size=(1280, 960)),
            "empty_frames = 10000: allowed: 1 to 3495 at 1280 x 960 px",
        ),
        (
            with_viewer(background="first", empty_frames=10_000, size=(6680, 5010), calibrated_size=(6680, 5010)),
            "empty_frames = 10000: allowed: 1 to 128 at 6680 x 5010 px",
        ),
        (with_viewer(rotation=[0.0] * 9), "no calibration"),
        (with_viewer(matrix=[0.0] * 9), "no calibration"),
        (lambda query: replaced(query, additions=["rm"]), "additions rm"),
        (lambda query: replaced(query, viewer=None), "no viewer"),
    ],
)
def test_an_assignment_that_makes_no_viewer_is_refused(tmp_path, change, reason):
    query = change(assignment(rig(tmp_path), "0", 5))
    with pytest.raises(UserError, match=reason):
        hosted_rig(sent(query), Device(0), tmp_path, previews=False)


def test_more_empty_frames_than_are_learnt_from_are_refused_in_the_rig_file(tmp_path: Path) -> None:
    rig(tmp_path, 'size = [1280, 960]\nbackground = "first:3495"')
    with pytest.raises(UserError) as raised:
        rig(tmp_path, 'size = [1280, 960]\nbackground = "first:3496"')
    allowed = "viewer[0].background = 'first:3496': allowed: first:N with N from 1 to 3495 at 1280 x 960 px"
    assert str(raised.value) == f"{tmp_path / 'rig.toml'}: {allowed}"
