"""A folder with a calibration and videos: times at which the videos begin, and videos of another size."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.places import ROOT
from tests.support.video_file import write_video
from tests.support.videos import UPRIGHT, grey_frames, with_orientation
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.errors import UserError
from zenocap.common.rig.folder import _paired
from zenocap.common.rig.rig import Rig, load_rig, rig_of_videos
from zenocap.common.rig.sources import BackgroundImage, MedianFrames, Stream, VideoFile
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source
from zenocap.tools.cli.track_options import videos_in
from zenocap.tools.setup.calibration.board_films import board_films

CALIBRATION = ROOT / "zenocap" / "data" / "rigs" / "demo-calibration.toml"  # cam01 and cam02, 640 x 480


def folder(path: Path, sync: str | None = None, size: tuple[int, int] = (640, 480), fps: int = 30) -> Path:
    for name in ("cam01", "cam02"):
        write_video(path / "videos" / f"{name}.mp4", grey_frames(4, size), fps=fps)
    (path / "calibration.toml").write_text(CALIBRATION.read_text())
    if sync is not None:
        (path / "sync.toml").write_text(sync)
    return path


def test_hidden_files_beside_the_videos_are_none(tmp_path: Path) -> None:
    """macOS writes a ._NAME beside each file on disks of others."""
    for name in ("._cam01.mp4", "._cam02.mp4"):
        (tmp_path / "videos").mkdir(exist_ok=True)
        (tmp_path / "videos" / name).write_bytes(b"\0\5\x16\7")
    assert [viewer.id for viewer in load_rig(folder(tmp_path)).viewers] == ["cam01", "cam02"]
    assert [path.name for path in videos_in(tmp_path)] == ["cam01.mp4", "cam02.mp4"]


@pytest.mark.parametrize("renamed", ["cam01.MP4", "Cam01.mp4", "CAM01.MTS", "cam01.h264"])
@pytest.mark.parametrize("picture", ["cam01.PNG", "CAM01.jpg", "cam01.JPEG"])
def test_capitals_in_the_names_of_files_do_not_count(tmp_path: Path, renamed: str, picture: str) -> None:
    """As action cameras and camcorders write them; a T-pose and a background were ignored without a word."""
    first = folder(tmp_path) / "videos" / "cam01.mp4"
    (tmp_path / "stretched").mkdir()
    (tmp_path / "stretched" / renamed).write_bytes(first.read_bytes())
    first.rename(first.with_name(renamed))
    (tmp_path / "background").mkdir()
    cv2.imwrite(str(tmp_path / "background" / picture), grey_frames(1, (640, 480))[0])
    one, two = load_rig(tmp_path).viewers
    assert one.source == VideoFile(first.with_name(renamed), initial=tmp_path / "stretched" / renamed)
    assert (one.background, two.background) == (BackgroundImage(tmp_path / "background" / picture), MedianFrames())


def test_a_file_of_a_camera_that_is_not_taken_is_named(tmp_path: Path) -> None:
    second, calibration = folder(tmp_path) / "videos" / "cam02.mp4", tmp_path / "calibration.toml"
    text, third = calibration.read_text(), second.with_name("cam03.mp4")
    second.rename(third)
    third.with_name("cam01.thm").write_bytes(b"")
    third.with_name("cam02.insv").write_bytes(b"")
    another = re.sub(r"(cam_?0)2", r"\g<1>3", text[text.index("[cam_02]") : text.index("[metadata]")])
    calibration.write_text(another + text)
    notes = [note for note in load_rig(tmp_path).notes if "not used" in note]
    assert notes[0] == "cam02: no video: this camera is not used"
    assert [note.partition(" allowed")[0] for note in notes[1:]] == ["videos/cam02.insv: not used, by its suffix:"]
    third.unlink()
    with pytest.raises(UserError, match=r"videos/cam02\.insv: not used, by its suffix: allowed: \.mp4 "):
        load_rig(tmp_path)


def test_bare_streams_beside_videos_are_no_videos(tmp_path: Path) -> None:
    videos = folder(tmp_path) / "videos"
    for name in ("cam01.h264", "preview.mjpeg"):
        (videos / name).write_bytes(b"")
    rig = load_rig(tmp_path)
    assert [viewer.source.text for viewer in rig.viewers] == [f"{videos}/cam01.mp4", f"{videos}/cam02.mp4"]
    notes = [f"videos/{name}: not used: a spare bare stream" for name in ("cam01.h264", "preview.mjpeg")]
    assert [note for note in rig.notes if "not used" in note] == notes
    others = [*videos_in(tmp_path), *(film.path for film in board_films([tmp_path])[0])]  # of the other commands
    assert (others.count(videos / "cam01.mp4"), others.count(videos / "cam01.h264")) == (2, 0)


def rig_file(path: Path, viewers: str, method: str = "auto") -> Path:
    """A rig file in a `folder`."""
    file = folder(path) / "rig.toml"
    file.write_text(f'name = "a"\nmethod = "{method}"\ncalibration = "calibration.toml"\n{viewers}')
    return file


def replaced(file: Path, old: str, new: str) -> Path:
    file.write_text(file.read_text().replace(old, new))
    return file


def offsets(rig: Rig) -> list[int]:
    return [viewer.source.offset_ns for viewer in rig.viewers if isinstance(viewer.source, VideoFile)]


def test_times_of_the_videos_are_counted_from_the_first_one(tmp_path: Path) -> None:
    rig = load_rig(folder(tmp_path, "[offset_s]\ncam01 = -0.5\ncam02 = 0.25\n"))
    assert offsets(rig) == [0, 750_000_000]
    assert "sync.toml: videos begin at cam01 -0.500 s, cam02 +0.250 s" in rig.notes
    frames = list(open_source(rig.viewers[1], Playback(10**9, ManualClock(0), live=False)))
    assert [frame.captured_ns for frame in frames] == [1_750_000_000 + round(k * 1e9 / 30) for k in range(4)]
    assert [frame.frame for frame in frames] == [0, 1, 2, 3]


def test_rig_file_gives_the_same_offsets(tmp_path: Path) -> None:
    viewers = "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "cam0{k}"\nsource = "videos/cam0{k}.mp4"\noffset_s = {offset}\n'
        for k, offset in ((1, 2.0), (2, 1.4))
    )
    file = rig_file(tmp_path, viewers)
    assert offsets(load_rig(file)) == [600_000_000, 0]
    with pytest.raises(UserError, match=r"viewer\[0\].offset_s = 2.0: allowed: only where the source is a video file"):
        load_rig(replaced(file, "videos/cam01.mp4", "actor:walk"))


def streams(*delays_ms: float) -> str:
    """Viewers of network cameras with these delays."""
    return "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "cam0{k}"\nsource = "rtsp://camera{k}/live"\nfps = 25\ndelay_ms = {delay}\n'
        for k, delay in enumerate(delays_ms, 1)
    )


def test_without_a_tracker_delays_are_less_than_a_frame_period_apart(tmp_path: Path) -> None:
    file = rig_file(tmp_path, streams(50, 80.5), "two-view")
    assert load_rig(file, files=False).method == "two-view"
    allowed = "allowed for method 'two-view': less than a frame period, 40.0 ms"
    with pytest.raises(UserError, match=f"rig.toml: delay_ms of viewer 2 is 40 ms above that of viewer 1: {allowed}"):
        load_rig(replaced(file, "80.5", "90"), files=False)
    assert load_rig(replaced(file, "two-view", "hybrid"), files=False).method == "hybrid"


def test_a_delay_is_that_of_a_camera_or_stream(tmp_path: Path) -> None:
    file = rig_file(tmp_path, streams(0, 80.5))
    sources = [viewer.source for viewer in load_rig(file, files=False).viewers]
    assert [one.delay_ns for one in sources if isinstance(one, Stream)] == [0, 80_500_000]
    with pytest.raises(UserError, match="delay_ms"):
        load_rig(replaced(file, "80.5", "2500"), files=False)
    replaced(file, "2500", "80")
    with pytest.raises(UserError, match=r"viewer\[1\].delay_ms = 80.0: allowed: only where .* of a video file: offset_s"):
        load_rig(replaced(file, "rtsp://camera2/live", "videos/cam02.mp4"), files=False)


@pytest.mark.parametrize(
    ("sync", "text"),
    [
        ("[offset_s]\ncam03 = 0.0\n", r"sync\.toml: offset_s\.cam03: no such camera: allowed: cam01, cam02"),
        ("[offset_s]\ncam01 = true\n", r"sync\.toml: offset_s\.cam01 = True: allowed: seconds from -3600 to 3600"),
        ("[offset_s]\ncam01 = nan\n", r"sync\.toml: offset_s\.cam01 = nan: allowed: seconds from -3600 to 3600"),
        ("cam01 = 0.0\n", r"sync\.toml: allowed: one table \[offset_s\]"),
        ("cam01 = \n", r"sync\.toml"),
    ],
)
def test_wrong_file_of_offsets_is_refused(tmp_path: Path, sync: str, text: str) -> None:
    with pytest.raises(UserError, match=text):
        load_rig(folder(tmp_path, sync))


def test_videos_of_another_size_are_noted(tmp_path: Path) -> None:
    rig = load_rig(folder(tmp_path, size=(320, 240)))
    assert "viewer cam01: video of 320 x 240, calibration for 640 x 480: scaled" in " ".join(rig.notes)


@pytest.mark.filterwarnings("ignore::zenocap.common.errors.FileNote")
@pytest.mark.parametrize(
    ("size", "used", "guessed", "note"),
    [
        ((656, 492), (656, 492), (), "images of 656 x 492, as its files have: 640 x 480 in the calibration is a guess"),
        ((320, 240), (640, 480), ("size",), "video of 320 x 240, calibration for 640 x 480: scaled"),
    ],
)
def test_the_size_of_a_video_replaces_a_guess_and_no_known_size(
    tmp_path: Path, size: tuple[int, int], used: tuple[int, int], guessed: tuple[str, ...], note: str
) -> None:
    file = folder(tmp_path, size=size) / "calibration.toml"
    assert {one.calibrated_size for one in load_rig(tmp_path).viewers} == {(640, 480)}
    file.write_text(file.read_text().replace("fisheye = false", 'guessed = ["size"]'))
    known, rig = read_calibration(file), load_rig(tmp_path)
    assert {(one.calibrated_size, one.camera.guessed) for one in rig.viewers} == {(used, guessed)}
    assert f"viewer cam01: {note}" in " ".join(rig.notes)
    for one in rig.viewers:  # the pixels of the calibration are those of the video
        np.testing.assert_allclose(one.camera.resized(used).matrix, known[one.camera.name].matrix)


@pytest.mark.filterwarnings("ignore::zenocap.common.errors.FileNote")
def test_the_size_of_pictures_replaces_a_guess(tmp_path: Path) -> None:
    viewers = ""
    for name in ("cam01", "cam02"):
        (tmp_path / name).mkdir()
        path = tmp_path / name / "0.jpg"
        cv2.imwrite(str(path), np.zeros((656, 492, 3), np.uint8))
        path.write_bytes(with_orientation(path.read_bytes(), UPRIGHT))
        viewers += f'[[viewer]]\nid = "{name}"\ncamera = "{name}"\nsource = "{name}/*.jpg"\n'
    file = rig_file(tmp_path, viewers)
    replaced(tmp_path / "calibration.toml", "fisheye = false", 'guessed = ["size"]')
    assert {(one.calibrated_size, one.camera.guessed) for one in load_rig(file).viewers} == {((656, 492), ())}


def test_faster_videos_are_thinned_to_the_rate_of_the_slowest(tmp_path: Path) -> None:
    folder(tmp_path)
    write_video(tmp_path / "videos" / "cam02.mp4", grey_frames(8, (640, 480)), fps=60)
    rig = load_rig(tmp_path)
    assert [viewer.fps for viewer in rig.viewers] == [30.0, 30.0]
    note = "frames/s: cam01 30, cam02 60: of the faster ones, the frames nearest in time to 30 a second are used"
    assert note in rig.notes
    frames = list(open_source(rig.viewers[1], Playback(0, ManualClock(0), live=False)))
    assert [frame.frame for frame in frames] == [0, 2, 4, 6]


def test_videos_of_any_folders_are_a_rig_with_their_calibration(tmp_path: Path) -> None:
    folder(tmp_path / "a")
    first, second = (tmp_path / "a" / "videos" / f"cam0{k}.mp4" for k in (1, 2))
    rig = rig_of_videos([second, first], tmp_path / "a" / "calibration.toml")
    assert rig.name == "a"  # not of the folder `videos`, as many have
    sources = {viewer.id: viewer.source for viewer in rig.viewers}
    assert list(sources.items()) == [("cam01", VideoFile(first)), ("cam02", VideoFile(second))]
    (note,) = (note for note in rig.notes if "median" in note)
    assert note.startswith("cam01, cam02: no background picture and no empty_seconds: the median of the video is used; ")
    renamed = [file.rename(tmp_path / name) for file, name in ((first, "left.mp4"), (second, "right.mp4"))]
    rig = rig_of_videos(renamed, tmp_path / "a" / "calibration.toml", background="first:2")
    assert "assigned in order: cam01 = left.mp4, cam02 = right.mp4" in rig.notes[0]
    assert [len(list(open_source(one, Playback(0, ManualClock(0), live=False)))) for one in rig.viewers] == [4, 4]
    with pytest.raises(UserError, match=r"none\.mp4: no such file"):
        rig_of_videos([tmp_path / "none.mp4"], tmp_path / "a" / "calibration.toml")
    with pytest.raises(UserError, match=r"right\.mp4: belongs to no camera of .*; there are: cam01, cam02"):
        rig_of_videos(renamed[1:], tmp_path / "a" / "calibration.toml")


@pytest.mark.parametrize(
    ("cameras", "videos", "expected"),
    [
        ("cam8 cam9 cam10", "cam10_walk cam8_walk cam9_walk", "cam8_walk cam9_walk cam10_walk"),
        ("cam1 cam10", "cam10_walk cam1_walk", "cam1_walk cam10_walk"),
        ("cam_8 cam_9 cam_10", "9 8 10", "8 9 10"),
        ("cam1 cam2", "subject1_cam2 subject2_cam1", "subject2_cam1 subject1_cam2"),
        ("1 2", "trial1_2 trial1_1", "trial1_1 trial1_2"),
        ("1 2", "trial1_left trial1_right", "trial1_left trial1_right"),
        ("a b c", "shot-10 shot-8 shot-9", "shot-8 shot-9 shot-10"),
        ("cam10 cam8 cam9", "shot-10 shot-8 shot-9", "shot-10 shot-8 shot-9"),
        ("a b", "second first", "second first"),
        ("int_cam1_img int_cam2_img", "cam2 cam1", "cam1 cam2"),
        ("left right", "left_walk other", "left_walk other"),
        ("Left Right", "walk_right walk_left", "walk_left walk_right"),
        ("cam1 cam2", "cam1 walk_cam2", "cam1 walk_cam2"),
        ("k\u00fcche fl\u00fcr", "flu\u0308r ku\u0308che", "ku\u0308che flu\u0308r"),
        ("ku\u0308che flu\u0308r", "fl\u00fcr_1 k\u00fcche_1", "k\u00fcche_1 fl\u00fcr_1"),
        ("1 2", "trial1_cam2 trial2_cam1", "trial2_cam1 trial1_cam2"),
        ("cam_1 cam_2 cam_10", "cam_10 cam_02_walk cam_01_walk", "cam_01_walk cam_02_walk cam_10"),
        ("cam_1 cam_01", "cam_01_walk cam_1_walk", "cam_1_walk cam_01_walk"),
        ("1 2", "trial1_Camera-02 trial2_Camera-01", "trial2_Camera-01 trial1_Camera-02"),
    ],
)
def test_videos_belong_to_the_camera_whose_name_they_contain(cameras: str, videos: str, expected: str) -> None:
    found, _ = _paired(Path("calibration.toml"), cameras.split(), [Path(f"{name}.mp4") for name in videos.split()])
    assert [found[name].stem for name in cameras.split()] == expected.split()


@pytest.mark.parametrize("videos", ["cam_02 cam_03 cam_04", "2 3 0", "cam_2 cam_3 cam_4"])
def test_a_video_of_another_number_is_of_no_camera(videos: str) -> None:
    """That which is left over was assigned to the camera that is left over."""
    with pytest.raises(UserError, match=r"[40]\.mp4: belongs to no camera of .*; there are: cam_1, cam_2, cam_3"):
        _paired(Path("calibration.toml"), ["cam_1", "cam_2", "cam_3"], [Path(f"{one}.mp4") for one in videos.split()])


def test_two_videos_of_one_camera_are_refused_and_the_pairs_are_said() -> None:
    calibration, cameras = Path("calibration.toml"), ["cam1", "cam2"]
    with pytest.raises(UserError, match=r"cam1_b\.mp4: cam1_a\.mp4 is of camera cam1 too: allowed: one video per camera"):
        _paired(calibration, cameras, [Path("cam1_a.mp4"), Path("cam1_b.mp4")])
    _, notes = _paired(calibration, cameras, [Path("walk_cam2.mp4")])
    assert notes == ["assigned by the names within: cam2 = walk_cam2.mp4", "cam1: no video: this camera is not used"]
