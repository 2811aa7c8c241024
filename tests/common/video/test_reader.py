"""Reading of video files: times of their containers, formats, rotation, damage."""

import wave
from collections.abc import Sequence
from pathlib import Path
from unittest.mock import Mock

import cv2
import numpy as np
import pytest

from tests.support.video_file import write_video
from tests.support.videos import GREY_STEP, grey_frames
from zenocap.common.errors import EndedEarly, OpenError
from zenocap.common.video.reader import VideoFrame, VideoReader, VideoSummary


def read(path: Path, *, hardware: bool = False) -> tuple[list[VideoFrame], VideoSummary]:
    with VideoReader(path, hardware=hardware) as reader:
        return list(iter(reader.next, None)), reader.summary()


def levels(frames: Sequence[VideoFrame]) -> list[int]:
    """Numbers encoded in the grey values."""
    return [round(float(frame.image().mean()) / GREY_STEP) for frame in frames]


def noisy(count: int) -> list[np.ndarray]:
    return [np.random.default_rng(k).integers(0, 255, (48, 64, 3), np.uint8) for k in range(count)]


FORMATS = [
    ("mp4", "libx264", "yuv420p"), ("mov", "libx264", "yuv422p10le"), ("mkv", "libx264", "gray"),
    ("mp4", "libx265", "yuv420p10le"), ("webm", "libvpx-vp9", "yuv420p"), ("mov", "prores_ks", "yuv422p10le"),
    ("avi", "mjpeg", "yuvj420p"), ("avi", "rawvideo", "bgr24"), ("mkv", "ffv1", "gray16le"), ("mp4", "mpeg4", "yuv420p"),
    ("mpg", "mpeg2video", "yuv420p"),
]  # fmt: skip


@pytest.mark.parametrize(("suffix", "codec", "pixels"), FORMATS, ids=["-".join(row) for row in FORMATS])
def test_formats_are_decoded_with_their_times(tmp_path: Path, suffix: str, codec: str, pixels: str) -> None:
    path = write_video(tmp_path / f"a.{suffix}", grey_frames(20), fps=30, codec=codec, pixels=pixels)
    frames, summary = read(path)
    greys = [float(frame.image().mean()) / GREY_STEP for frame in frames]
    assert np.abs(np.subtract(greys, range(20))).max() < 1.7, "the range of grey values is stretched by some"
    assert np.diff(greys[2:]).min() > 0.5
    assert [frame.index for frame in frames] == list(range(20))
    late = 1 / 30 if suffix == "mpg" else 6e-4  # the writer of MPEG leaves a gap; times of webm and mkv are in ms
    assert np.abs([frame.time_ns / 1e9 - k / 30 for k, frame in enumerate(frames)]).max() <= late + 1e-6
    assert (summary.damaged, summary.estimated, summary.timing.variable) == (0, 0, False)
    assert len(summary.timing.gaps) == (suffix == "mpg")


def test_raw_video_of_48_columns_is_read(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.avi", grey_frames(5, (48, 48)), codec="rawvideo", pixels="bgr24")
    assert levels(read(path)[0]) == list(range(5))


def test_images_are_those_of_opencv(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mp4", [cv2.GaussianBlur(image, (9, 9), 0) for image in noisy(5)])
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    for frame in read(path)[0]:
        assert np.array_equal(frame.image(), capture.read()[1])


def test_variable_rate_keeps_the_times_of_the_container(tmp_path: Path) -> None:
    times = np.concatenate([[0.0], np.cumsum(np.random.default_rng(1).uniform(0.02, 0.06, 60))])
    frames, summary = read(write_video(tmp_path / "a.mp4", grey_frames(61), list(times)))
    assert len(frames) == 61
    assert np.abs([frame.time_ns / 1e9 for frame in frames] - times).max() < 1e-4
    assert (summary.timing.variable, summary.timing.gaps) == (True, ())


def test_dropped_frames_are_a_gap(tmp_path: Path) -> None:
    times = [k / 30 for k in range(60) if not 20 <= k < 32]
    frames, summary = read(write_video(tmp_path / "a.mp4", grey_frames(48), times))
    assert frames[20].time_ns == pytest.approx(32e9 / 30, abs=1e5)
    (gap,) = summary.timing.gaps
    assert (gap.missing, round(gap.before_s, 3), round(gap.after_s, 3)) == (12, 0.633, 1.067)
    assert not summary.timing.variable
    with VideoReader(tmp_path / "a.mp4") as reader:
        assert reader.fps == pytest.approx(30.0, rel=0.001), "the mean of 48 frames is 24 a second"


def test_times_begin_with_the_first_frame(tmp_path: Path) -> None:
    frames, _ = read(write_video(tmp_path / "a.mkv", grey_frames(5), [3.0 + k / 10 for k in range(5)]))
    assert [round(frame.time_ns / 1e9, 3) for frame in frames] == [0.0, 0.1, 0.2, 0.3, 0.4]


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_rotation_is_that_of_opencv(tmp_path: Path, degrees: int) -> None:
    """The matrix of the track header, as phones write it."""
    image = np.zeros((48, 64, 3), np.uint8)
    image[:24, :32] = 250
    path = write_video(tmp_path / "a.mp4", [image] * 5)
    content = bytearray(path.read_bytes())
    c, s = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}[degrees]
    at = content.index(b"tkhd") + 4 + 4 + 20 + 16  # version, times and ids; layer, volume
    matrix = b"".join((value * 65536).to_bytes(4, "big", signed=True) for value in (c, s, 0, -s, c, 0, 0, 0))
    content[at : at + 32] = matrix
    path.write_bytes(content)
    expected = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG).read()[1]
    assert expected.shape[:2] == ((64, 48) if degrees in (90, 270) else (48, 64))
    assert np.array_equal(read(path)[0][0].image(), expected)
    with VideoReader(path) as reader:
        assert reader.size == expected.shape[1::-1]


@pytest.mark.parametrize(
    ("suffix", "codec"), [("avi", "mjpeg"), ("mkv", "libx264"), ("webm", "libvpx-vp9"), ("mpg", "mpeg2video")]
)
def test_cut_file_is_an_error_after_its_frames(tmp_path: Path, suffix: str, codec: str) -> None:
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    path = write_video(tmp_path / f"a.{suffix}", noisy(60), codec=codec, pixels=pixels)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    if suffix == "mpg":  # a stream without a declared length
        assert 20 <= len(read(path)[0]) <= 40
        return
    with pytest.raises(EndedEarly, match=rf"a\.{suffix}: \d+ frames read, \d+ declared: the file is cut or damaged"):
        read(path)


def test_damaged_frames_are_left_out_and_counted(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.avi", noisy(60), codec="mjpeg", pixels="yuvj420p")
    whole, content = len(read(path)[0]), bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 6000] = bytes(6000)
    path.write_bytes(content)
    try:
        frames, summary = read(path)
    except EndedEarly:
        return
    assert len(frames) + summary.damaged <= whole
    assert np.diff([frame.time_ns for frame in frames]).min() > 0


@pytest.mark.parametrize("content", [b"", b"no video", b"RIFF0000AVI LIST", bytes(5000)])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.mp4").write_bytes(content)
    with pytest.raises(OpenError, match=r"a\.mp4: not a video that can be decoded"):
        VideoReader(tmp_path / "a.mp4")


def test_sound_alone_is_refused(tmp_path: Path) -> None:
    with wave.open(str(tmp_path / "a.wav"), "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(8000)
        sound.writeframes(bytes(16000))
    with pytest.raises(OpenError, match=r"a\.wav: has no video stream"):
        VideoReader(tmp_path / "a.wav")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["mp4", "avi", "mkv"])
def test_damaged_files_never_raise_anything_else(tmp_path: Path, suffix: str) -> None:
    codec, pixels = ("mjpeg", "yuvj420p") if suffix == "avi" else ("libx264", "yuv420p")
    path = write_video(tmp_path / f"a.{suffix}", noisy(10), codec=codec, pixels=pixels)
    whole, rng = path.read_bytes(), np.random.default_rng(1)
    for _ in range(60):
        content = bytearray(whole)
        for at in rng.integers(0, len(content), rng.integers(1, 40)):
            content[at] = rng.integers(256)
        path.write_bytes(bytes(content)[: rng.integers(len(content) // 2, len(content) + 1)])
        try:
            frames, _ = read(path)
        except (OpenError, EndedEarly):
            continue
        assert all(frame.image().ndim == 3 for frame in frames)


def test_without_hardware_the_frames_are_those_of_software_and_the_reason_is_known(tmp_path, monkeypatch):
    path = write_video(tmp_path / "a.mp4", grey_frames(5))
    monkeypatch.setattr("zenocap.common.video.reader.HWAccel", Mock(side_effect=RuntimeError("no such device")))
    (plain, summary), (asked, with_reason) = read(path), read(path, hardware=True)
    for first, second in zip(plain, asked, strict=True):
        assert first.time_ns == second.time_ns
        np.testing.assert_array_equal(first.image(), second.image())
    assert (len(plain), summary.software) == (5, "")
    reason = with_reason.software
    assert "no such device" in reason or reason == "this FFmpeg has no hardware decoder for h264"
