"""Rig files and folders: values, defaults, sources, backgrounds, errors."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.places import ROOT
from tests.support.video_file import write_video
from tests.support.videos import grey_frames
from zenocap.common.errors import UserError
from zenocap.common.rig import sources
from zenocap.common.rig.camera_settings import CameraSettings
from zenocap.common.rig.rig import demo_rig, load_rig
from zenocap.common.rig.source_kinds import parse_source

CALIBRATION = (ROOT / "zenocap" / "data" / "rigs" / "demo-calibration.toml").read_text()
RIG = """name = "studio"
calibration = "calibration.toml"
up_axis = "y"
method = "two-view"

[[viewer]]
id = "1"
camera = "cam01"
source = 0
background = "first:60"
size = [160, 120]
fps = 15

[[viewer]]
id = "2"
camera = "cam02"
source = "rtsp://host/a"

[zenoh]
connect = ["tcp/localhost:7447"]

[log]
enabled = false
"""


def camera_table(number: int, heading_deg: float) -> str:
    """A level camera 5 m from the origin, `heading_deg` from -Z towards +X."""
    turn = cv2.Rodrigues(np.array([0.0, np.radians(heading_deg), 0.0]))[0]
    rotation = cv2.Rodrigues(np.diag([1.0, -1.0, -1.0]) @ turn)[0].ravel().tolist()
    return (
        CALIBRATION.split("[cam_02]")[0]
        .replace("cam_01", f"cam_{number:02d}")
        .replace("cam01", f"cam{number:02d}")
        .replace("[3.141592653589793, 0.0, 0.0]", str(rotation))
    )


def four_frames(path: Path) -> None:
    """A video of the demo's image size, 25 frames/s."""
    write_video(path, grey_frames(4, (640, 480)), fps=25)


def write_rig(folder: Path, text: str = RIG) -> Path:
    (folder / "calibration.toml").write_text(CALIBRATION)
    (folder / "rig.toml").write_text(text)
    return folder / "rig.toml"


def test_a_rig_file_is_read(tmp_path):
    settings = 'fps = 15\nformat = "YUYV"\nexposure = 200\nwhite_balance = "auto"\n'
    rig = load_rig(write_rig(tmp_path, RIG.replace("fps = 15\n", settings)))
    assert (rig.name, rig.method, rig.base) == ("studio", "two-view", tmp_path)
    one, two = rig.viewers
    source = sources.Device(0, None, CameraSettings("YUYV", 200, "locked", "auto", "locked"))
    assert (one.id, one.source, one.background, one.fps) == ("1", source, sources.FirstFrames(60), 15.0)
    assert (one.camera.size, one.calibrated_size) == ((160, 120), (640, 480))
    assert one.camera.matrix[0, 0] == pytest.approx(150)
    assert one.camera.matrix[0, 2] == pytest.approx(79.5)
    assert (two.source, two.fps, two.camera.size) == (sources.Stream("rtsp://host/a"), 30.0, (640, 480))
    assert (two.preview, two.silhouette) == (False, True)
    assert (rig.zenoh.mode, rig.zenoh.connect, rig.zenoh.multicast_scouting) == ("peer", ("tcp/localhost:7447",), True)
    assert (rig.log.folder, rig.log.enabled) == ("recordings", False)
    assert rig.viewer("2") is two
    with pytest.raises(UserError, match="rig studio: no viewer '3'; there are: 1, 2"):
        rig.viewer("3")


@pytest.mark.parametrize("stated", ["fps = 30\n", ""])
def test_pictures_know_whether_the_rig_states_their_rate(tmp_path, stated):
    text = RIG.replace("source = 0", 'source = "images/*.png"').replace("fps = 15\n", stated)
    one, _ = load_rig(write_rig(tmp_path, text), files=False).viewers
    assert (one.source, one.fps) == (sources.Images(tmp_path / "images", "*.png", bool(stated)), 30.0)


def test_the_digest_depends_on_content_and_not_on_location(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    first, second = load_rig(write_rig(tmp_path / "a")), load_rig(write_rig(tmp_path / "b"))
    assert first.digest == second.digest
    assert load_rig(write_rig(tmp_path / "b", RIG.replace("fps = 15", "fps = 16"))).digest != first.digest
    assert load_rig(tmp_path / "a" / "rig.toml", "hybrid").digest != first.digest
    calibration = tmp_path / "a" / "calibration.toml"
    calibration.write_text(CALIBRATION.replace("600.0", "601.0"))
    assert load_rig(tmp_path / "a" / "rig.toml").digest != first.digest


NAME, FPS, STREAM, HOSTED = 'name = "studio"', "fps = 15", 'source = "rtsp://host/a"', 'source = "discover:lab/a"'
VIEWERS, SECOND = RIG[RIG.index("[[viewer]]") :], RIG[RIG.index('[[viewer]]\nid = "2"') : RIG.index("[zenoh]")]


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('name = "studio"\n', "", "name is missing"),
        (NAME, 'name = "my studio"', "name = 'my studio': allowed: 1 to 64 letters, digits"),
        (NAME, "name = 3", "name = 3: allowed: str"),
        ("calibration =", "calibratoin =", "calibratoin = .*no such key; allowed: name, .*did you mean 'calibration'"),
        ('"calibration.toml"', '"other.toml"', "calibration = 'other.toml': no file "),
        ('up_axis = "y"', 'up_axis = "x"', "up_axis = 'x': allowed: 'y', 'z'"),
        ('"two-view"', '"two_view"', "method = 'two_view': allowed: 'auto', 'two-view', .*did you mean 'two-view'"),
        (FPS, "feedback = true", r"viewer\[0\].feedback = true: allowed: only with background = \"adaptive\""),
        ('background = "first:60"', 'background = "adaptive"\nfeedback = true',
         "viewer 1: feedback = true: allowed: false for method 'two-view', without a tracker"),
        (STREAM, HOSTED + "\nfeedback = true", "feedback = true: allowed for a camera of another machine"),
        (STREAM, HOSTED + "\nkeep_background = true",
         r"viewer\[1\].keep_background = true: allowed: only for a camera or stream of this machine"),
        (FPS, "keep_background = true", r"keep_background = true: allowed: only with background = \"adaptive\""),
        (STREAM, STREAM + "\nkeep_background = true",
         "viewer 2: keep_background = true: allowed: false for method 'two-view'"),
        (NAME, 'name = "studio"\ndelays = "x"', "delays = 'x': allowed: 'off', 'report', 'follow'"),
        (NAME, NAME + '\ndelays = "follow"',
         "delays = 'follow': allowed for method 'two-view': off, report"),
        (FPS, "fps = 0", r"viewer\[0\].fps = 0: allowed: float > 0"),
        (FPS, 'exposure = "manual"',
         r"viewer\[0\].exposure = 'manual': allowed: a whole number in the range .* \"locked\""),
        (FPS, "gain = 2.5", r"viewer\[0\].gain = 2.5: allowed: int"),
        (FPS, "focus = true", r"viewer\[0\].focus = .*: allowed: int"),
        (FPS, 'format = "H264"', r"viewer\[0\].format = 'H264': allowed: MJPG, JPEG, YUYV"),
        (STREAM, STREAM + "\ngain = 3", r"viewer\[1\].gain = 3: allowed: only where the source is a camera of a machine"),
        (FPS, "fps = 5000", r"viewer\[0\].fps = 5000: allowed: float <= 1000"),
        (FPS, 'fps = "fast"', r"viewer\[0\].fps = 'fast': allowed: float"),
        (FPS, "fsp = 15", r"viewer\[0\].fsp = 15: no such key; .*did you mean 'fps'"),
        ("[160, 120]", "[160]", r"viewer\[0\].size = \[160\]: allowed: list of length 2"),
        ("[160, 120]", "[160, 4]", r"viewer\[0\].size\[1\] = 4: allowed: int >= 16"),
        ("[160, 120]", "[160, 160]",
         r"viewer\[0\].size = \[160, 160\]: allowed: the shape of the .* 640 x 480 px, such as \[160, 120\]"),
        ("[160, 120]", "[960, 720]", r"viewer\[0\].size = \[960, 720\]: allowed: at most the calibrated 640 x 480 px"),
        ('id = "2"', 'id = "1"', r"viewer\[1\].id = '1': allowed: an id that viewer\[0\] does not have"),
        ('id = "2"', 'id = "a/b"', r"viewer\[1\].id = 'a/b': allowed: 1 to 64 letters"),
        ('camera = "cam02"', 'camera = "cam03"', r"viewer\[1\].camera: no camera 'cam03'; there are: cam01, cam02"),
        ('camera = "cam02"', 'camera = "cam01"', r"viewer\[1\].camera = 'cam01': viewer '1' uses it already"),
        ('camera = "cam02"\n', "", r"viewer\[1\].camera is missing"),
        ("first:60", "first:0", r"viewer\[0\].background = 'first:0': allowed: first:N with N from 1 to 10000 frames"),
        ("first:60", "mean", r"viewer\[0\].background = 'mean': allowed: adaptive, first:N, first:SECONDSs, median"),
        ("first:60", "first:0s", r"'first:0s': allowed: first:N .*, or first:SECONDSs up to 60, such as first:2s"),
        ("first:60", "image:none.png", r"viewer\[0\].background = 'image:none.png': no file "),
        ("source = 0", "source = 200", r"viewer\[0\].source = 200: allowed: a device number from 0 to 99"),
        ("source = 0", 'source = "ftp://a"', r"viewer\[0\].source = 'ftp://a': allowed: a device number, /dev/videoN"),
        ("source = 0", 'source = "none.mp4"', r"viewer\[0\].source = 'none.mp4': no file "),
        ("source = 0", 'source = "none/*.png"', r"viewer\[0\].source = 'none/\*.png': no file matches"),
        ("source = 0", 'source = "rig.toml"\ninitial = "none.mp4"', r"viewer\[0\].initial = 'none.mp4': no file "),
        ("source = 0", 'source = 0\ninitial = "a.mp4"',
         r"viewer\[0\].initial = 'a.mp4': allowed: only where the source is"),
        (STREAM, 'source = "rig.toml"', r"viewer\[1\].source: .*not a video that can be decoded"),
        ("[zenoh]", '[zenoh]\nmode = "pear"', "zenoh.mode = 'pear': allowed: 'peer', .*did you mean 'peer'"),
        ("connect =", "conect =", "zenoh.conect = .*did you mean 'connect'"),
        ("enabled", "enable", "log.enable = False: no such key; .*did you mean 'enabled'"),
        ("[log]", "[log", "not TOML"),
        ("[[viewer]]", "[[viewers]]", "viewers = .*did you mean 'viewer'"),
        (VIEWERS, '[viewer]\nid = "1"\n', r"\[viewer\] is one table: allowed: \[\[viewer\]\], once per viewer"),
        (
            'up_axis = "y"', 'up_axis = "z"', r"camera cam01 points within 10 degrees of straight up or down: allowed for "
            r"method 'two-view': 2 cameras that do not; is another axis vertical \(up_axis\)\?",
        ),
        (SECOND, "", r"1 viewer\(s\): allowed: 2 or more \[\[viewer\]\] for method 'two-view'"),
    ],
)  # fmt: skip
def test_every_error_names_file_key_value_and_what_is_allowed(tmp_path, old, new, text):
    assert old in RIG
    path = write_rig(tmp_path, RIG.replace(old, new))
    with pytest.raises(UserError, match=text) as caught:
        load_rig(path)
    assert str(caught.value).startswith(str(path))


def test_a_missing_rig_and_an_unknown_method_are_refused(tmp_path):
    with pytest.raises(UserError, match="no such rig: allowed: a TOML file, or a folder with"):
        load_rig(tmp_path / "none.toml")
    with pytest.raises(UserError, match="method = 'magic': allowed: auto, two-view, hybrid"):
        load_rig(write_rig(tmp_path), "magic")


def test_sources_on_other_machines_may_be_missing_here(tmp_path):
    path = write_rig(tmp_path, RIG.replace("source = 0", 'source = "none.mp4"').replace("first:60", "image:none.png"))
    rig = load_rig(path, files=False)
    assert rig.viewers[0].source == sources.VideoFile(tmp_path / "none.mp4")
    assert rig.viewers[0].background == sources.BackgroundImage(tmp_path / "none.png")


def write_folder(folder: Path, headings: list[float], clip: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "calibration.toml").write_text("\n".join(camera_table(k, h) for k, h in enumerate(headings, start=1)))
    for k in range(1, len(headings) + 1):
        four_frames(folder / "videos" / f"cam{k:02d}.mp4")
    if clip:
        (folder / "clip.toml").write_text(clip)
    return folder


def test_a_folder_is_a_rig(tmp_path):
    folder = write_folder(tmp_path / "my take", [0, 90], "empty_frames = 3\nframes = 4\n")
    four_frames(folder / "stretched" / "cam02.mp4")
    rig = load_rig(folder)
    one, two = rig.viewers
    assert rig.name == "my-take"
    assert [v.id for v in rig.viewers] == ["cam01", "cam02"]
    assert one.source == sources.VideoFile(folder / "videos/cam01.mp4")
    assert two.source == sources.VideoFile(folder / "videos/cam02.mp4", folder / "stretched/cam02.mp4")
    assert (one.background, one.fps) == (sources.FirstFrames(3), 25.0)
    assert rig.notes == ()


def test_seconds_of_the_empty_scene_are_frames_of_each_camera(tmp_path):
    for text in ("empty_seconds = 0.1", ""):
        folder = write_folder(tmp_path / "take", [0, 90], text or "up_axis = 'y'")
        rig = load_rig(folder, background=None if text else "first:0.1s")
        assert [one.background for one in rig.viewers] == [sources.FirstFrames(2)] * 2  # of 25/s: whole periods in 0.1 s
    assert sources.parse_background("first:2s", tmp_path, 29.97) == sources.FirstFrames(59)
    assert sources.parse_background("first:2s", tmp_path, 30.0) == sources.FirstFrames(60)
    with pytest.raises(UserError, match=r"a rig file has the backgrounds of its viewers: allowed with a folder"):
        load_rig(write_rig(tmp_path, RIG), background="first:2s")


def test_first_frames_of_cameras_of_different_rates_end_at_the_same_time(tmp_path):
    """30 frames are 1.2 s of the slow camera, in which somebody enters, and 1 s of the fast one."""
    folder = write_folder(tmp_path / "take", [0, 90], "empty_frames = 30")
    write_video(folder / "videos" / "cam02.mp4", grey_frames(4, (640, 480)), fps=30)
    assert [one.background for one in load_rig(folder).viewers] == [sources.FirstFrames(25)] * 2


def test_a_background_image_overrides_empty_frames(tmp_path):
    folder = write_folder(tmp_path / "take", [0, 90], "empty_frames = 3\nfps = 12.5\n")
    (folder / "background").mkdir()
    cv2.imwrite(str(folder / "background" / "cam01.png"), np.zeros((480, 640, 3), np.uint8))
    one, two = load_rig(folder).viewers
    assert one.background == sources.BackgroundImage(folder / "background/cam01.png")
    assert two.background == sources.FirstFrames(3)
    assert one.fps == 12.5


def test_the_background_is_the_median_without_image_and_empty_frames(tmp_path):
    rig = load_rig(write_folder(tmp_path / "take", [0, 90]))
    assert rig.viewers[0].background == sources.MedianFrames()
    words = "no background picture and no empty_seconds: the median of the video is used; "
    assert rig.notes[0].startswith(f"cam01, cam02: {words}")


def test_two_view_uses_the_most_orthogonal_pair_front_view_first_and_notes_it(tmp_path):
    folder = write_folder(tmp_path / "take", [40, 88, -2], "empty_frames = 3")
    rig = load_rig(folder, "two-view")
    assert [v.id for v in rig.viewers] == ["cam03", "cam02"]
    cameras = "cam03 (front) and cam02, 90 degrees apart, the most nearly orthogonal pair"
    assert rig.notes == (f"method two-view uses two of the 3 cameras: {cameras}",)
    assert len(load_rig(folder).viewers) == len(load_rig(folder, "hybrid").viewers) == 3


def test_two_view_uses_no_camera_that_looks_straight_down(tmp_path):
    folder = write_folder(tmp_path / "take", [0, 90, 60], 'up_axis = "z"')
    assert [viewer.id for viewer in load_rig(folder, "two-view").viewers] == ["cam02", "cam03"]
    assert len(load_rig(folder).viewers) == 3


def test_a_camera_without_video_is_not_used(tmp_path):
    folder = write_folder(tmp_path / "take", [40, 88, -2], "empty_frames = 3")
    (folder / "videos" / "cam01.mp4").unlink()
    rig = load_rig(folder, "hybrid")
    assert [v.id for v in rig.viewers] == ["cam02", "cam03"]
    assert rig.notes == ("cam01: no video: this camera is not used",)
    (folder / "videos" / "cam03.mp4").unlink()
    with pytest.raises(UserError, match="videos/ has no video of cam01, cam03: allowed: those of two cameras or more"):
        load_rig(folder, "hybrid")


def test_videos_with_other_names_are_assigned_in_order(tmp_path):
    folder = write_folder(tmp_path / "take", [0, 90], "empty_frames = 3")
    for k in (1, 2):
        (folder / "videos" / f"cam{k:02d}.mp4").rename(folder / "videos" / f"GOPRO{k}.mp4")
    rig = load_rig(folder)
    assert rig.viewers[1].source == sources.VideoFile(folder / "videos/GOPRO2.mp4")
    assert "assigned in order: cam01 = GOPRO1.mp4, cam02 = GOPRO2.mp4" in rig.notes[0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('up_axis = "x"', "up_axis = 'x': allowed: 'y' or 'z'"),
        ("fps = -1", "fps = -1: allowed: above 0 to 1000"),
        ("empty_frames = 2.5", "empty_frames = 2.5: allowed: a whole number from 0 to 10000"),
        ("empty_seconds = 61", "empty_seconds = 61: allowed: seconds from 0 to 60"),
        ('empty_seconds = "2s"', "empty_seconds = '2s': allowed: seconds from 0 to 60"),
        ("empty_frames = 3\nempty_seconds = 1", "empty_frames = 3 and empty_seconds = 1: allowed: one of them"),
    ],
)
def test_errors_of_clip_toml(tmp_path, text, reason):
    with pytest.raises(UserError, match=f"clip.toml: {reason}"):
        load_rig(write_folder(tmp_path / "take", [0, 90], text))


def test_a_misspelt_key_of_clip_toml_is_noted_and_keys_of_others_are_not(tmp_path):
    text = "empty_second = 0.1\nempty_frames = 2\nframes = 4\nstretched_frames = 4\nmotion_from_frame = 2\nunits = 'm'"
    rig = load_rig(write_folder(tmp_path / "take", [0, 90], text))
    assert rig.notes == ("clip.toml: 'empty_second' is not used: did you mean empty_seconds?",)


def test_errors_of_a_folder(tmp_path):
    def refused(path, reason):
        with pytest.raises(UserError, match=reason):
            load_rig(path)

    refused(tmp_path, r"calibration\.toml is missing: allowed: a rig file or a folder with it")
    folder = write_folder(tmp_path / "take", [0, 90])
    four_frames(folder / "videos" / "cam01.avi")
    refused(folder, "allowed: one video per camera")
    (folder / "videos" / "cam01.avi").rename(folder / "videos" / "cam09.avi")
    refused(folder, r"videos/cam09.avi: belongs to no camera of .*calibration.toml; there are: cam01, cam02")
    for video in (folder / "videos").iterdir():
        video.unlink()
    refused(folder, "videos/ has no video")
    (folder / "calibration.toml").write_text("")
    refused(folder, "no camera in it")


@pytest.mark.parametrize(
    ("text", "source"),
    [
        (0, sources.Device(0)),
        ("1", sources.Device(1)),
        ("/dev/video2", sources.Device(2)),
        ("/dev/v4l/by-id/usb-A-index0", sources.Device(None, Path("/dev/v4l/by-id/usb-A-index0"))),
        ("rtsp://u:p@host:554/a", sources.Stream("rtsp://u:p@host:554/a")),
        ("http://host/a.mjpg?x=*", sources.Stream("http://host/a.mjpg?x=*")),
        ("videos/a.mp4", sources.VideoFile(Path("/b/videos/a.mp4"))),
        ("/c/a.mp4", sources.VideoFile(Path("/c/a.mp4"))),
        ("images/*.png", sources.Images(Path("/b/images"), "*.png")),
        ("actor:walking?seed=3", sources.Actor("walking", 3)),
    ],
)
def test_source_texts_are_parsed(text, source):
    assert parse_source(text, Path("/b")) == source


@pytest.mark.parametrize(
    "text",
    ["", "rtsp://", "actor:", "actor:demo?sead=1", "actor:demo?seed=x", "/dev/videox", -1, "/dev/v4l/by-id/", "/dev/sda"],
)
def test_invalid_source_texts_are_refused(text):
    with pytest.raises(sources.SpecError):
        parse_source(text, Path("/b"))


def test_background_texts_are_parsed():
    assert sources.parse_background("median", Path("/b")) == sources.MedianFrames()
    assert sources.parse_background("mog2", Path("/b")) == sources.Mog2()
    assert sources.parse_background("image:a.png", Path("/b")) == sources.BackgroundImage(Path("/b/a.png"))


def test_the_demo_rig_has_the_camera_layout_of_the_paper():
    with pytest.raises(UserError, match="method = 'hybrid': allowed for the demo: both, auto, two-view"):
        demo_rig("hybrid")
    assert [viewer.source for viewer in demo_rig().viewers] == [sources.Actor("demo", 4)] * 2
    rig = demo_rig("two-view")
    assert [(v.source, v.camera.size, v.fps) for v in rig.viewers] == [(sources.Actor("demo", 4), (160, 120), 15.0)] * 2
    np.testing.assert_allclose(rig.viewers[0].camera.centre, [0, 1.0, 5.2], atol=1e-9)
    np.testing.assert_allclose(rig.viewers[1].camera.centre, [-5.2, 1.0, 0], atol=1e-9)
