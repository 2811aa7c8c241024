"""Frames of videos, pictures and cameras: numbers, times, live playback, errors."""

import os
import struct
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from pathlib import Path
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.common.runtime.test_frame_rate import reduced
from tests.common.vision import test_empty_scene as empty_scene
from tests.support import video_file
from tests.support.places import CLIPS, ROOT
from tests.support.videos import GREY_STEP, grey_frames, with_orientation
from zenocap.common.arrays import LARGEST_PX
from zenocap.common.errors import AccessDenied, EndedEarly, OpenError, SizeMismatch
from zenocap.common.rig.camera_settings import CameraSettings
from zenocap.common.rig.rig import demo_rig, load_rig
from zenocap.common.rig.sources import Device, Images, Stream, VideoFile
from zenocap.common.video import reader
from zenocap.common.video.reader import MIRRORED
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import LONGEST_RUN_NS, RUNS_ON_NS
from zenocap.services.viewer.sources import device, images, source, video
from zenocap.services.viewer.sources.device import camera_frames
from zenocap.services.viewer.sources.images import image_frames, read_picture
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import Fit
from zenocap.services.viewer.sources.source import longest_run_ns, open_source
from zenocap.services.viewer.sources.stamps import SourceRate
from zenocap.services.viewer.sources.video import Thinning, median_picture, video_frames

SIZE, WORKING = (64, 48), (32, 24)
FIT = Fit(SIZE, WORKING)
S = 1_000_000_000
READ = """
import os, sys
import zenocap
import cv2, numpy
print(os.environ["OPENCV_IO_MAX_IMAGE_PIXELS"])
try:
    cv2.imdecode(numpy.fromfile(sys.argv[1], dtype=numpy.uint8), cv2.IMREAD_COLOR)
except cv2.error:
    print("refused")
"""


@dataclass
class FakeTime:
    """A clock that advances by calls of sleep."""

    ns: int = 0
    sleeps: list[float] = field(default_factory=list)

    def now_ns(self) -> int:
        return self.ns

    def sleep(self, seconds: float) -> None:
        self.sleeps.append(seconds)
        self.ns += round(seconds * S)


def offline(epoch_ns: int = 0) -> Playback:
    return Playback(epoch_ns, FakeTime(), live=False)


def live(time: FakeTime, epoch_ns: int = 0, loop: bool = False, reports: list[str] | None = None) -> Playback:
    return Playback(epoch_ns, time, loop=loop, sleep=time.sleep, report=(reports if reports is not None else []).append)


def write_video(path: Path, frames: int, fps: int = 10, size: tuple[int, int] = SIZE, start: int = 0) -> Path:
    """Write a video; frame k has the grey value of number start + k."""
    return video_file.write_video(path, grey_frames(start + frames, size)[start:], fps=fps)


def frames_of(path: Path, playback: Playback, fps: float = 10.0) -> Iterator[Frame]:
    return video_frames(VideoFile(path), fps, FIT, playback)


def level(frame: Frame) -> int:
    """Number encoded in the grey value of a frame."""
    return round(float(frame.image.mean()) / GREY_STEP)


@pytest.mark.parametrize("size", [SIZE, (128, 96)], ids=["of-the-calibrated-size", "of-its-shape"])
def test_a_file_gives_every_frame_at_the_working_size_with_its_own_number_and_time(tmp_path, size):
    frames = list(frames_of(write_video(tmp_path / "a.mp4", 6, size=size), offline(5 * S)))
    assert [(f.frame, f.captured_ns, level(f)) for f in frames] == [(k, 5 * S + k * S // 10, k) for k in range(6)]
    assert all(f.image.shape == (24, 32, 3) and f.image.dtype == np.uint8 and not f.initial for f in frames)


def test_a_lower_rate_takes_the_first_frame_of_each_period_and_keeps_its_number(tmp_path):
    frames = list(frames_of(write_video(tmp_path / "a.mp4", 12, fps=30), offline(), 15.0))
    assert [(f.frame, level(f)) for f in frames] == [(k, k) for k in (0, 2, 4, 6, 8, 10)]


@given(fps=st.floats(0.5, 60), own=st.floats(1, 120), count=st.integers(2, 400))
def test_thinned_frames_are_never_more_than_the_rate_allows(fps, own, count):
    thinning = Thinning(fps, own)
    kept = [k for k in range(count) if thinning.takes(round(k * 1e9 / own))]
    assert kept[0] == 0
    if fps >= own:
        assert kept == list(range(count))
    else:
        assert abs(len(kept) - count * fps / own) <= 1
        assert all(abs((b - a) - own / fps) <= 1.001 for a, b in pairwise(kept))
        assert all(abs(k / own - round(k * fps / own) / fps) <= 0.51 / own for k in kept)


def test_thinning_follows_the_times_of_a_variable_rate():
    thinning, times = Thinning(10.0, 30.0), [0.0, 0.03, 0.06, 0.12, 0.19, 0.21, 0.5, 0.52, 0.6, 0.63, 0.7]
    assert [time for time in times if thinning.takes(round(time * S))] == [0.0, 0.12, 0.19, 0.5, 0.6, 0.7]


def test_the_initial_posture_comes_first_and_does_not_shift_the_files_numbers(tmp_path):
    main, stretched = write_video(tmp_path / "a.mp4", 3), write_video(tmp_path / "s.mp4", 2, start=7)
    frames = list(video_frames(VideoFile(main, stretched), 10.0, FIT, offline(S)))
    assert [(f.frame, f.initial, level(f)) for f in frames] == [
        (0, True, 7), (1, True, 8), (0, False, 0), (1, False, 1), (2, False, 2),
    ]  # fmt: skip
    assert [f.captured_ns for f in frames] == [S + k * S // 10 for k in (-2, -1, 0, 1, 2)]


def test_a_file_is_paced_by_its_own_times_in_live_playback(tmp_path):
    time = FakeTime(ns=3 * S)
    arrived = [time.now_ns() for _ in frames_of(write_video(tmp_path / "a.mp4", 4), live(time, 5 * S))]
    assert arrived == [5 * S + k * S // 10 for k in range(4)]


def test_late_frames_are_skipped_in_live_playback(tmp_path):
    time, indices = FakeTime(), []
    for frame in frames_of(write_video(tmp_path / "a.mp4", 10), live(time)):
        indices.append(frame.frame)
        if frame.frame == 2:
            time.ns += S // 2
    assert indices == [0, 1, 2, 6, 7, 8, 9]


def test_an_overloaded_viewer_skips_the_same_frames_of_a_file_whether_or_not_it_is_late(tmp_path):
    path = write_video(tmp_path / "a.mp4", 20)
    kept = []
    for late_at in (None, 6):
        time, choice = FakeTime(), reduced(1, 2, 10.0)
        kept.append([])
        for frame in frames_of(path, replace(live(time), choice=choice)):
            kept[-1].append(frame.frame)
            time.ns += S // 2 if frame.frame == late_at else 0
        assert (choice.skipped, choice.late) == (10, 0 if late_at is None else 1)
    assert kept[0] == list(range(0, 20, 2))
    assert kept[1] == [0, 2, 4, 6, 10, 12, 14, 16, 18]  # 8 was late


def test_frame_numbers_continue_in_a_looped_file(tmp_path):
    frames = list(islice(frames_of(write_video(tmp_path / "a.mp4", 3), live(FakeTime(), loop=True)), 7))
    assert [(f.frame, level(f)) for f in frames] == [(0, 0), (1, 1), (2, 2), (3, 0), (4, 1), (5, 2), (6, 0)]
    assert frames[-1].captured_ns == 6 * S // 10


def test_a_picture_goes_on_though_opening_it_takes_longer_than_a_frame_period(tmp_path, monkeypatch):
    path, time = tmp_path / "a.png", FakeTime()
    cv2.imwrite(str(path), np.full((SIZE[1], SIZE[0], 3), 70, np.uint8))

    class SlowReader(reader.VideoReader):
        def __init__(self, *arguments):
            time.ns += S // 3
            super().__init__(*arguments)

    monkeypatch.setattr(video, "VideoReader", SlowReader)
    frames = list(islice(frames_of(path, live(time, loop=True)), 30))
    assert {level(frame) for frame in frames} == {7}
    assert {later.captured_ns - one.captured_ns for one, later in pairwise(frames[1:])} == {S // 10}
    assert [later.frame - one.frame for one, later in pairwise(frames[1:])] == [1] * 28
    assert time.ns == frames[-1].captured_ns


def test_missing_forbidden_and_invalid_video_files_are_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.mp4"
    with pytest.raises(OpenError, match=r"a\.mp4: no such video file"):
        next(frames_of(path, offline()))
    path.write_bytes(b"no video")
    with pytest.raises(OpenError, match=r"a\.mp4: not a video that can be decoded: the file is damaged"):
        next(frames_of(path, offline()))
    monkeypatch.setattr(reader.os, "access", lambda path, mode: False)
    with pytest.raises(AccessDenied, match=r"a\.mp4: no permission to read this video file"):
        next(frames_of(path, offline()))


@pytest.mark.parametrize(
    ("size", "text"),
    [
        ((64, 64), r"a\.mp4: images of 64 x 64 px, but the calibration is for 64 x 48 px"),
        ((48, 64), "one of them is turned by 90 degrees"),
    ],
    ids=["of-another-shape", "turned"],
)
def test_images_that_do_not_fit_the_calibration_are_refused_with_both_sizes(tmp_path, size, text):
    with pytest.raises(SizeMismatch, match=text):
        list(frames_of(write_video(tmp_path / "a.mp4", 2, size=size), offline()))


@pytest.mark.parametrize(("real", "calibrated"), [((1080, 1920), (1088, 1920)), ((1088, 1920), (1080, 1920))])
def test_a_letterboxed_image_shows_every_point_where_the_calibrated_one_does(real, calibrated):
    """real_beam4: 1088 columns were scaled to 1080, and the height by the same factor, about the centre."""
    working = (calibrated[0] // 2, calibrated[1] // 2)
    scale = real[0] / calibrated[0]
    for point in ((100, 300), (700, 1500), (540, 960)):
        image = np.zeros((real[1], real[0], 3), np.uint8)
        x, y = ((p + 0.5 - c / 2) * scale + r / 2 for p, c, r in zip(point, calibrated, real, strict=True))
        cv2.circle(image, (round(x), round(y)), 6, (255, 255, 255), -1)
        seen = Fit(calibrated, working)(image)[..., 0] > 127
        rows, columns = np.nonzero(seen)
        assert columns.mean() * 2 == pytest.approx(point[0], abs=1.5)
        assert rows.mean() * 2 == pytest.approx(point[1], abs=1.5)


def pictures(folder: Path, playback: Playback, *numbers: int, fps: float = 10.0, rated: bool = False) -> Iterator[Frame]:
    """Write pictures with the grey values of their numbers; return the frames of the folder."""
    for k in numbers:
        cv2.imwrite(str(folder / f"{k}.png"), grey_frames(k + 1)[k])
    return image_frames(Images(folder, "*.png", rated), fps, FIT, playback)


def test_pictures_are_ordered_by_number_and_have_the_times_of_their_numbers(tmp_path):
    frames = [(f.frame, f.captured_ns, level(f)) for f in pictures(tmp_path, offline(S), 2, 10, 1)]
    assert frames == [(0, S, 1), (1, S + S // 10, 2), (9, S + 9 * S // 10, 10)]


EVEN = "the pictures follow each other without gaps"


@pytest.mark.parametrize(
    ("names", "places", "note"),
    [
        ("cam02_0000 cam02_0001 cam02_0004", [0, 1, 4], ""),
        ("0101_cam02 0102_cam02 0105_cam02", [0, 1, 4], "begins with number 101: times count from that picture"),
        ("a1_640x480 a3_640x480 a7_640x480", [0, 1, 3], ""),
        ("walk", [0], ""),
        ("1.966 2.000 2.033", [0, 1, 2], f"the numbers in the names do not rise by whole steps: {EVEN}"),
        ("1 2 20240101", [0, 1, 2], f"the numbers in the names do not rise by whole steps: {EVEN}"),
        ("1 2 end", [0, 1, 2], f"not every name has a number: {EVEN}"),
    ],
)
def test_numbers_that_are_left_out_in_the_names_of_pictures_are_gaps(names, places, note):
    found = images.places_of([Path(f"{name}.png") for name in names.split()])
    assert found == (places, [note] if note else [])


@pytest.mark.parametrize(("fps", "rated"), [(10.0, True), (30.0, True), (30.0, False)])
def test_pictures_state_their_gaps_and_an_assumed_rate(tmp_path, fps, rated):
    found = []
    list(pictures(tmp_path, replace(offline(), finished=found.append), 0, 1, 2, 5, fps=fps, rated=rated))
    (gap,) = found[0].timing.gaps
    assert (gap.missing, gap.after_s) == (2, pytest.approx(5 / fps))
    assumed = ("pictures have no times: 30/s assumed, unless `fps` of the rig file states it",)
    assert found[0].notes == (() if rated else assumed)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_pictures_are_turned_as_their_exif_data_ask_for_and_not_mirrored_which_is_noted(tmp_path, orientation):
    found, image = [], np.zeros((480, 480, 3), np.uint8)
    image[:240, :240] = 250
    jpeg = cv2.imencode(".jpg", image)[1].tobytes()
    (tmp_path / "1.jpg").write_bytes(with_orientation(jpeg, orientation))
    source, playback = Images(tmp_path, "*.jpg", True), replace(offline(), finished=found.append)
    (frame,) = image_frames(source, 30.0, Fit((480, 480), (480, 480)), playback)
    bright = [frame.image[y, x, 0] > 125 for y, x in ((5, 5), (5, -5), (-5, -5), (-5, 5))]  # clockwise
    assert bright.index(True) == {1: 0, 2: 0, 3: 2, 4: 0, 5: 1, 6: 1, 7: 3, 8: 3}[orientation]
    assert found[0].notes == ((MIRRORED,) if orientation in (2, 4, 5, 7) else ())


def test_pictures_are_paced_looped_and_skipped_when_late_in_live_playback(tmp_path):
    frames = islice(pictures(tmp_path, live(FakeTime(ns=S // 4), loop=True), 0, 1, 2), 3)
    assert [(f.frame, level(f)) for f in frames] == [(2, 2), (3, 0), (4, 1)]


def test_unreadable_pictures_are_refused(tmp_path, monkeypatch):
    with pytest.raises(OpenError, match=r"\*\.png: no file matches"):
        next(pictures(tmp_path, offline()))
    (tmp_path / "1.png").write_bytes(b"")
    with pytest.raises(EndedEarly, match=r"1\.png: not a picture that can be decoded: allowed: .*; it is picture 0 of 1"):
        next(pictures(tmp_path, offline()))
    monkeypatch.setattr(Path, "open", Mock(side_effect=PermissionError(13, "Permission denied")))
    with pytest.raises(AccessDenied, match=r"1\.png: no permission to read this picture"):
        next(pictures(tmp_path, offline()))


def square_of(path: Path, side: int) -> Path:
    """A picture file with a header alone."""
    path.write_bytes(struct.pack("<2sIHHIIiiHHIIiiII", b"BM", 54, 0, 0, 54, 40, side, side, 1, 24, 0, 0, 0, 0, 0, 0))
    return path


def test_too_large_pictures_are_refused(tmp_path, monkeypatch):
    with pytest.raises(OpenError, match=r"2\.bmp: not a picture"):  # an error of OpenCV
        read_picture(square_of(tmp_path / "2.bmp", 40_000))
    path = tmp_path / "1.png"
    cv2.imwrite(str(path), grey_frames(1)[0])
    assert read_picture(path, cv2.IMREAD_GRAYSCALE).shape == (48, 64)
    monkeypatch.setattr(images, "LARGEST_PX", 64 * 48 - 1)
    with pytest.raises(OpenError, match=r"1\.png: not a picture .*: allowed: PNG, JPEG or BMP of at most 3071 pixels"):
        read_picture(path)
    monkeypatch.setattr(images, "LARGEST_BYTES", path.stat().st_size - 1)
    with pytest.raises(OpenError, match=r"1\.png: a picture file of more than 0 MiB: allowed: a smaller one"):
        read_picture(path)


@pytest.mark.parametrize("side", [8193, 40_000])
def test_a_picture_of_too_many_pixels_is_refused_by_its_header(tmp_path, side):
    """OpenCV takes memory for up to 2^30 pixels, and raises an error of its own above.

    In a process of its own: the limit counts when OpenCV is first imported.
    """
    path = square_of(tmp_path / "large.bmp", side)
    environment = {name: value for name, value in os.environ.items() if name != "OPENCV_IO_MAX_IMAGE_PIXELS"}
    done = subprocess.run(
        [sys.executable, "-c", READ, path], env=environment | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.stdout.splitlines() == [str(LARGEST_PX), "refused"], done.stderr


class FakeCamera:
    """Stand-in of cv2.VideoCapture that takes 1 / fps s for a frame and ends after `frames` of them."""

    def __init__(self, time: FakeTime, frames: int, fps: float = 10.0, size: tuple[int, int] = SIZE) -> None:
        self.time, self.left, self.fps, self.size, self.released = time, frames, fps, size, False

    def isOpened(self) -> bool:
        return self.left > 0

    def grab(self) -> bool:
        self.time.ns += round(S / self.fps)
        self.left -= 1
        return self.left >= 0

    def retrieve(self) -> tuple[bool, object]:
        return True, np.zeros((self.size[1], self.size[0], 3), np.uint8)

    def get(self, propId: int) -> float:
        return 0.0  # no time

    def release(self) -> None:
        self.released = True


def opening(captures: list[FakeCamera]) -> device.Opener:
    """Return an opener that gives these captures one after the other."""
    rest: Iterator[FakeCamera] = iter(captures)
    return lambda source, size, fps: next(rest)


def first(source: Device | Stream, images: int = 0) -> Frame:
    """The first frame of a camera that gives some images and then fails."""
    time = FakeTime()
    return next(camera_frames(source, 10.0, SIZE, live(time), opening([FakeCamera(time, images)])))


@pytest.mark.parametrize(("loading_s", "opened_again"), [(device.HELD_S - 1.0, False), (60.0, True)])
def test_a_camera_that_was_open_during_a_long_loading_is_opened_again(monkeypatch, loading_s, opened_again):
    """Images that had waited for a minute got the present time."""
    time, viewer = FakeTime(), replace(demo_rig().viewers[0], source=Device(0))
    cameras = [FakeCamera(time, 9, size=viewer.camera.size) for _ in range(3)]
    monkeypatch.setattr(device, "time", Mock(monotonic=lambda: time.ns / S))
    monkeypatch.setattr(device, "opener_of", lambda _: opening(cameras))
    opener = device.of_working_size(viewer)
    time.sleep(loading_s)
    found = [opener(Device(0), SIZE, 10.0) for _ in range(2)]
    assert found == (cameras[1:] if opened_again else cameras[:2])
    assert cameras[0].released == opened_again


@pytest.mark.parametrize("source", [Device(0, delay_ns=80_000_000), Stream("rtsp://a/b", delay_ns=80_000_000)])
def test_the_delay_of_a_camera_is_subtracted_from_its_times(source):
    assert first(source, 3).captured_ns == first(replace(source, delay_ns=0), 3).captured_ns - 80_000_000


def test_frames_of_a_camera_have_the_time_when_they_were_grabbed():
    time = FakeTime(ns=S)
    camera = FakeCamera(time, 50)
    stream = camera_frames(Device(0), 10.0, SIZE, live(time), opening([camera]))
    frames = list(islice(stream, 3))
    assert [f.frame for f in frames] == [0, 1, 2]
    assert [f.captured_ns for f in frames] == [S + k * S // 10 for k in (2, 3, 4)]  # the first was the check
    stream.close()
    assert camera.released


class FakeControls:
    """Controls that settle when they are set first."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def begin(self) -> bool:
        self.calls.append("begin")
        return self.calls == ["begin"]

    def lock(self) -> None:
        self.calls.append("lock")


def test_frames_are_left_out_while_controls_settle_and_not_when_the_camera_is_back():
    time, controls, rate = FakeTime(ns=S), FakeControls(), SourceRate()
    captures = [FakeCamera(time, 40), FakeCamera(time, 50)]
    stream = camera_frames(Device(0), 10.0, SIZE, live(time), opening(captures), controls=controls, rate=rate)
    frames = list(islice(stream, 12))
    assert frames[0].captured_ns - S == int((0.1 + device.SETTLING_S + 0.1) * S)
    assert [f.frame for f in frames] == list(range(12))
    assert frames[9].captured_ns - frames[8].captured_ns < S  # it was lost after the ninth
    assert controls.calls == ["begin", "lock", "begin"]
    assert rate.counts()["source_returns"] == 1


def test_frames_of_a_camera_have_the_time_of_its_buffer(monkeypatch):
    monkeypatch.setattr(device.time, "monotonic_ns", lambda: 7 * S)
    monkeypatch.setattr(device.sys, "platform", "linux")
    time = FakeTime(ns=S)
    camera = FakeCamera(time, 50)
    camera.get = lambda propId: 7000.0 - 30.0  # ms
    stream = camera_frames(Device(0), 10.0, SIZE, live(time), opening([camera]))
    assert next(stream).captured_ns == S + 2 * S // 10 - 30_000_000


def test_on_other_systems_a_stable_name_is_refused_and_settings_are_left_out_with_a_line(monkeypatch):
    monkeypatch.setattr(device.sys, "platform", "darwin")
    with pytest.raises(OpenError, match="allowed on darwin: a number, such as 0"):
        device.open_device(Device(None, Path("/dev/v4l/by-id/a")), SIZE, 30.0)
    reports: list[str] = []
    source._controls(Device(0, settings=CameraSettings(gain=3)), live(FakeTime(), reports=reports))
    source._controls(Device(0), live(FakeTime(), reports=reports))
    assert reports == ["0: its settings in the rig file are left out: they are set on Linux only"]


def test_a_camera_with_a_stable_name_is_found_under_another_number(tmp_path, monkeypatch):
    capture = Mock()
    monkeypatch.setattr(device.cv2, "VideoCapture", capture)
    monkeypatch.setattr(device.sys, "platform", "linux")
    link = tmp_path / "usb-A"
    for number in (0, 4):
        link.unlink(missing_ok=True)
        link.symlink_to(f"/dev/video{number}")
        device.open_device(Device(None, link), SIZE, 30.0)
    assert [call.args[0] for call in capture.call_args_list] == ["/dev/video0", "/dev/video4"]


def test_frames_of_a_fast_camera_are_reduced_to_the_rate():
    time = FakeTime(ns=S)
    frames = list(islice(camera_frames(Device(0), 15.0, SIZE, live(time), opening([FakeCamera(time, 500, 60.0)])), 30))
    gaps = np.diff([f.captured_ns for f in frames]) / S
    assert gaps.mean() == pytest.approx(1 / 15, rel=0.02)
    assert [f.frame for f in frames] == list(range(30))


def test_overloaded_viewers_keep_the_frames_of_the_same_times_of_cameras_that_started_at_different_ones():
    kept = []
    for start_ns in (S, 5 * S + 30_000_000):
        time = FakeTime(ns=start_ns)
        playback = replace(live(time), choice=reduced(1, 2, 10.0))
        stream = camera_frames(Device(0), 10.0, SIZE, playback, opening([FakeCamera(time, 200)]))
        frames = [frame for frame in islice(stream, 50) if frame.captured_ns > 5.95 * S][:20]
        kept.append([frame.captured_ns for frame in frames])
        assert set(np.diff([frame.frame for frame in frames])) == {2}
    assert np.abs(np.subtract(*kept)).max() == 30_000_000


def test_an_unplugged_camera_is_reported_and_opened_again_with_growing_pauses():
    time, reports = FakeTime(ns=S), []
    unavailable = [FakeCamera(time, 0) for _ in range(6)]
    captures = [FakeCamera(time, 3), *unavailable, FakeCamera(time, 50)]
    stream = camera_frames(Device(0), 10.0, SIZE, live(time, reports=reports), opening(captures))
    frames = list(islice(stream, 4))
    assert [f.frame for f in frames] == [0, 1, 2, 3]
    assert time.sleeps == [0.5, 1.0, 2.0, 4.0, 8.0, 10.0, 10.0]
    assert "lost after 2 frames: unplugged, or the stream ended; trying again" in reports[0]
    assert "back after 7 tries" in reports[1]
    assert all(camera.released for camera in captures[:-1])


def test_a_camera_with_other_images_is_refused():
    time = FakeTime()
    stream = camera_frames(Device(0), 10.0, SIZE, live(time), opening([FakeCamera(time, 9, size=(128, 72))]))
    with pytest.raises(SizeMismatch, match="images of 128 x 72 px, but the calibration is for 64 x 48 px"):
        next(stream)


def test_error_gives_the_reason_why_a_camera_does_not_open(monkeypatch):
    monkeypatch.setattr(device.sys, "platform", "linux")
    monkeypatch.setattr(device.Path, "exists", lambda path: False)
    monkeypatch.setattr(device.Path, "glob", lambda path, pattern: iter([Path("/dev/video7")]))
    with pytest.raises(OpenError, match=r"camera 3 \(/dev/video3\): no such camera; there are: /dev/video7"):
        first(Device(3))
    monkeypatch.setattr(device.Path, "exists", lambda path: True)
    monkeypatch.setattr(device.os, "access", lambda path, mode: False)
    with pytest.raises(AccessDenied, match=r"/dev/video3\): no permission: add this user to the group `video`"):
        first(Device(3))
    monkeypatch.setattr(device.os, "access", lambda path, mode: True)
    with pytest.raises(OpenError, match="delivers no image: another program may be using it"):
        first(Device(3))


def test_error_names_a_failed_stream_without_its_password():
    with pytest.raises(OpenError, match="rtsp://host:554/a: the stream does not open within 5 s") as caught:
        first(Stream("rtsp://user:secret@host:554/a"))
    assert "secret" not in str(caught.value)


def test_a_viewer_opens_its_own_source(tmp_path):
    folder = tmp_path / "take"
    for name in ("cam01", "cam02"):
        write_video(folder / "videos" / f"{name}.mp4", 3, size=(640, 480))
    demo = ROOT / "zenocap" / "data" / "rigs" / "demo-calibration.toml"
    (folder / "calibration.toml").write_text(demo.read_text())
    viewer = load_rig(folder).viewers[0]
    assert [f.image.shape for f in open_source(viewer, offline())] == [(480, 640, 3)] * 3
    (folder / "videos" / "cam01.mp4").unlink()
    with pytest.raises(OpenError, match="no such video file"):
        next(open_source(viewer, offline()))


def test_a_live_viewer_of_a_film_runs_for_its_length_and_another_one_without_end(tmp_path):
    person = load_rig(ROOT / "zenocap" / "data" / "rigs" / "demo.toml").viewers[0]
    film = replace(person, source=VideoFile(write_video(tmp_path / "a.mp4", 20), offset_ns=S), fps=30.0)
    missing = replace(person, source=VideoFile(tmp_path / "missing.mp4", offset_ns=S))
    assert longest_run_ns(film) == 3 * S + RUNS_ON_NS
    assert longest_run_ns(person) == longest_run_ns(missing) == LONGEST_RUN_NS


@pytest.mark.slow
@pytest.mark.clips
def test_the_real_clip_is_read_at_its_working_size_initial_posture_first():
    rig = load_rig(CLIPS / "real_beam4")
    for viewer in rig.viewers:
        frames = list(islice(open_source(viewer, offline(S)), 14))
        assert [(f.frame, f.initial) for f in frames] == [(k, True) for k in range(11)] + [(k, False) for k in range(3)]
        assert {f.image.shape for f in frames} == {(viewer.camera.size[1], viewer.camera.size[0], 3)}


def test_the_background_of_a_film_is_that_of_its_empty_part(tmp_path: Path) -> None:
    """A person stands in one place for two thirds of it."""
    empty, walking, masks = empty_scene.film()
    path = video_file.write_video(tmp_path / "a.mp4", [*empty[:14], *[walking[0]] * 28], fps=empty_scene.FPS)
    found = median_picture(path, Fit(empty_scene.SIZE, empty_scene.SIZE)).astype(np.float64)
    person, room = masks[0] != 0, np.median(np.stack(empty), axis=0)
    assert np.abs(found - room)[person].mean() < 6.0
    assert np.abs(walking[0] - room)[person].mean() > 20.0
