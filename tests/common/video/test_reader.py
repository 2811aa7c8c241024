"""Reading of video files: times of their containers, formats, rotation, damage."""

import struct
import wave
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from unittest.mock import Mock

import av
import cv2
import numpy as np
import pytest
from av.stream import Disposition

from tests.support.video_file import ask_for_turn, copied, write_video
from tests.support.videos import GREY_STEP, UPRIGHT, grey_frames, with_orientation
from zenocap.common.errors import EndedEarly, OpenError
from zenocap.common.video.reader import MIRRORED, VideoFrame, VideoReader, VideoSummary
from zenocap.tools.takes.take_videos import SeekableVideo


def read(path: Path, *, hardware: bool = False) -> tuple[list[VideoFrame], VideoSummary]:
    with VideoReader(path, hardware=hardware) as reader:
        return list(iter(reader.next, None)), reader.summary()


def levels(frames: Sequence[VideoFrame]) -> list[int]:
    """Numbers encoded in the grey values."""
    return [round(float(frame.image().mean()) / GREY_STEP) for frame in frames]


def noisy(count: int) -> list[np.ndarray]:
    return [np.random.default_rng(k).integers(0, 255, (48, 64, 3), np.uint8) for k in range(count)]


OPEN = "keyint=20:min-keyint=20:bframes=3:b-adapt=0:scenecut=0"  # groups of pictures
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


@pytest.mark.parametrize("at", [1, 10, 19])
@pytest.mark.parametrize("codec", ["mjpeg", "mpeg4"])
def test_an_avi_with_dropped_frames_is_whole(tmp_path: Path, codec: str, at: int) -> None:
    """Capture programs write an empty chunk for a dropped frame, and count it."""
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    times = [(k + 3 * (k >= at)) / 30 for k in range(20)]
    path = write_video(tmp_path / "a.avi", noisy(20), times, codec=codec, pixels=pixels, clock=30)
    frames, summary = read(path)
    assert np.abs([frame.time_ns / 1e9 - time for frame, time in zip(frames, times, strict=True)]).max() < 1e-6
    assert [gap.missing for gap in summary.timing.gaps] == [3]
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(EndedEarly, match="the file is cut or damaged"):
        read(path)


def test_times_begin_with_the_first_frame(tmp_path: Path) -> None:
    frames, _ = read(write_video(tmp_path / "a.mkv", grey_frames(5), [3.0 + k / 10 for k in range(5)]))
    assert [round(frame.time_ns / 1e9, 3) for frame in frames] == [0.0, 0.1, 0.2, 0.3, 0.4]


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_rotation_is_that_of_opencv(tmp_path: Path, degrees: int) -> None:
    image = np.zeros((48, 64, 3), np.uint8)
    image[:24, :32] = 250
    path = write_video(tmp_path / "a.mp4", [image] * 5)
    ask_for_turn(path, degrees)
    expected = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG).read()[1]
    assert expected.shape[:2] == ((64, 48) if degrees in (90, 270) else (48, 64))
    assert np.array_equal(read(path)[0][0].image(), expected)
    with VideoReader(path) as reader:
        assert reader.size == expected.shape[1::-1]


@pytest.mark.parametrize(("suffix", "order"), [("mjpeg", b"MM"), ("mkv", b"II")])
@pytest.mark.parametrize(
    ("orientation", "turn"),
    [(UPRIGHT, cv2.ROTATE_90_CLOCKWISE), (2, None), (3, cv2.ROTATE_180), (4, None), (5, cv2.ROTATE_90_CLOCKWISE),
     (7, cv2.ROTATE_90_COUNTERCLOCKWISE)],
)  # fmt: skip
def test_a_film_of_jpeg_pictures_with_exif_data_is_turned_as_they_ask_for(
    tmp_path: Path, suffix: str, order: bytes, orientation: int, turn: int | None
) -> None:
    """And not mirrored, which is noted.  PyAV raises a ValueError where it does not know a kind of side data."""
    path, image = tmp_path / "a.mjpeg", np.zeros((48, 64, 3), np.uint8)
    image[:24, :32] = 250
    picture = cv2.imencode(".jpg", image)[1].tobytes()
    path.write_bytes(5 * with_orientation(picture, orientation, order))
    if suffix == "mkv":
        path = copied(path, tmp_path / "a.mkv")
    frames, summary = read(path)
    assert len(frames) == 5
    expected, found = image if turn is None else cv2.rotate(image, turn), frames[0].image()
    assert np.abs(np.subtract(found, expected, dtype=int)).mean() < 3
    np.testing.assert_array_equal(SeekableVideo(path).at(0.0), found)
    assert (MIRRORED in summary.notes) is (orientation in (2, 4, 5, 7))


def with_key_frames(path: Path, count: int = 60, every: int = 20) -> Path:
    return write_video(path, grey_frames(count), options={"g": str(every), "bf": "0", "sc_threshold": "0"})


@pytest.mark.parametrize("suffix", ["mp4", "mov"])
@pytest.mark.parametrize(("first_s", "shown"), [(0.5, 45), (1.0, 30)])
def test_a_film_that_an_edit_list_trims_is_whole(tmp_path: Path, suffix: str, first_s: float, shown: int) -> None:
    """As phones and `ffmpeg -ss 0.5 -c copy` trim."""
    whole = with_key_frames(tmp_path / f"whole.{suffix}", every=60)
    frames, summary = read(copied(whole, tmp_path / f"a.{suffix}", shift_s=-first_s))
    assert (len(frames), frames[0].time_ns, levels(frames)[0]) == (shown, 0, (60 - shown) % 24)
    cut_away = f"{60 - shown} frames are in the file and cut away by its edit list: they are left out"
    assert summary.notes == (cut_away,)
    with VideoReader(tmp_path / f"a.{suffix}") as reader:
        assert reader.declared == shown


def test_parts_that_an_edit_list_joins_are_said(tmp_path: Path) -> None:
    """As QuickTime Player removes the middle of a film."""
    path = copied(with_key_frames(tmp_path / "whole.mov", every=15), tmp_path / "a.mov", shift_s=0.5)
    data = bytearray(path.read_bytes())
    (scale,) = struct.unpack_from(">I", data, data.index(b"mdhd") + 16)
    struct.pack_into(">IiIIiI", data, data.index(b"elst") + 12, 500, 0, 1 << 16, 500, scale, 1 << 16)
    path.write_bytes(data)
    frames, summary = read(path)
    assert levels(frames) == [k % 24 for k in (*range(15), *range(30, 45))]
    assert summary.notes == (
        "30 frames are in the file and cut away by its edit list: they are left out",
        "its edit list joins parts of the film: their times follow each other, without what was between them",
    )


def test_of_two_rates_in_an_avi_that_of_the_film_is_used_and_said(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.avi", grey_frames(10), fps=25, codec="mpeg4")
    assert read(path)[1].notes == ()
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.index(b"avih") + 8, 33333)
    path.write_bytes(data)
    frames, summary = read(path)
    assert frames[1].time_ns == 40_000_000
    assert summary.notes == ("30/s in the file's header, 25/s in the film's: the latter is used",)


@pytest.mark.parametrize("suffix", ["h264", "hevc"])
def test_a_bare_stream_has_the_rate_of_its_headers(tmp_path: Path, suffix: str) -> None:
    codec = "libx264" if suffix == "h264" else "libx265"
    frames, summary = read(write_video(tmp_path / f"a.{suffix}", grey_frames(10), codec=codec))
    assert [round(1e-6 * frame.time_ns) for frame in frames[:4]] == [0, 33, 67, 100]
    assert summary.notes == ("has no times: 30 frames/s, as its headers state",)


def test_the_rate_of_a_bare_stream_that_states_none_is_said_to_be_assumed(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mjpeg", grey_frames(10), codec="mjpeg", pixels="yuvj420p")
    frames, summary = read(path)
    assert frames[1].time_ns == 40_000_000
    assert summary.notes == ("states no frame rate: 25/s assumed; put it into a container with its rate, such as .mp4",)


@pytest.mark.parametrize(
    ("suffix", "stated", "said"),
    [
        ("mp4", "240.000000", "slow motion it is 8 times slower"),
        ("mkv", "120", "slow motion it is 4 times slower"),
        ("mp4", "1.5", "a time lapse it is 20 times faster"),
        ("mp4", "29.4", ""),
        ("mp4", "nan", ""),
        ("mp4", "fast", ""),
    ],
)
def test_slow_motion_and_time_lapses_are_said(tmp_path: Path, suffix: str, stated: str, said: str) -> None:
    """Phones write the rate of capture into the file, and the times of the playback into its frames."""
    tags = {"com.android.capture.fps": stated}
    whole = write_video(tmp_path / f"whole.{suffix}", grey_frames(10))
    _, summary = read(copied(whole, tmp_path / f"a.{suffix}", tags=tags))
    rates = "when it was filmed, its times have 30/s: they are used; as"
    assert summary.notes == ((f"com.android.capture.fps = {float(stated):g}/s {rates} {said}",) if said else ())


@pytest.mark.parametrize("behind", [0, 3 << 20])
@pytest.mark.parametrize(("stated", "notes"), [("119.88p", 1), ("29.97p", 0), ("59.94i", 0), ("1.2.3", 0)])
def test_slow_motion_of_sonys_cameras_is_noted(tmp_path: Path, behind: int, stated: str, notes: int) -> None:
    """Their XML is in a box that FFmpeg skips."""
    path = write_video(tmp_path / "a.mp4", grey_frames(10))
    xml = bytes(behind) + f'<VideoFrame videoCodec="AVC" captureFps="{stated}" formatFps="29.97p"/>'.encode()
    path.write_bytes(path.read_bytes() + struct.pack(">I4s", 8 + len(xml), b"free") + xml)
    rates = "captureFps = 119.88/s when it was filmed, its times have 30/s: they are used; as"
    assert read(path)[1].notes == (f"{rates} slow motion it is 4 times slower",) * notes


def test_slow_motion_of_apples_telephones_has_the_times_of_the_capture(tmp_path: Path) -> None:
    whole = write_video(tmp_path / "whole.mov", grey_frames(10), fps=240)
    intent = {"com.apple.quicktime.full-frame-rate-playback-intent": "0"}
    frames, summary = read(copied(whole, tmp_path / "a.mov", tags=intent))
    assert (summary.notes, frames[-1].time_ns) == ((), pytest.approx(9 / 240 * 1e9, abs=1e6))


@pytest.mark.parametrize("suffix", ["ts", "h264"])
def test_a_recording_that_begins_between_key_frames_keeps_its_times_and_says_so(tmp_path: Path, suffix: str) -> None:
    whole = with_key_frames(tmp_path / f"whole.{suffix}")
    if suffix == "ts":
        path = copied(whole, tmp_path / "a.ts", first=5)
    else:
        content = whole.read_bytes()
        begins = [at for at in range(len(content) - 4) if content[at : at + 4] == b"\x00\x00\x01\x41"]  # no key frames
        path = tmp_path / "a.h264"
        path.write_bytes(content[begins[4] - 1 :])
    frames, summary = read(path)
    assert levels(frames)[0] == 20
    assert frames[0].time_ns == pytest.approx(15 / 30 * 1e9, abs=1e6)
    assert any("begins between two key frames: the first 15 frames (0.50 s) cannot be decoded" in n for n in summary.notes)


@pytest.mark.parametrize("packets", [1, 15], ids=["one of them", "many"])
@pytest.mark.parametrize("codec", ["libx264", "libx265"])
def test_a_film_without_key_frame_is_refused_for_that_reason(tmp_path: Path, codec: str, packets: int) -> None:
    """FFmpeg knows neither size nor, of one packet, rate: the film was called one of 0 x 0 px, or of 90,000 frames/s."""
    options = {"g": "60", "bf": "0"}
    whole = write_video(tmp_path / "whole.ts", grey_frames(20), codec=codec, options=options)
    path = copied(whole, tmp_path / "a.ts", first=5, end=5 + packets)
    with pytest.raises(OpenError, match=r"a\.ts: no picture of it can be decoded: damaged, or without a key frame"):
        VideoReader(path)


@pytest.mark.parametrize("suffix", ["mkv", "mp4", "mov"])
@pytest.mark.parametrize(("late_s", "said"), [(0.0, False), (0.6, True), (7200.0, False)])
def test_a_film_whose_beginning_is_missing_says_so(tmp_path: Path, suffix: str, late_s: float, said: bool) -> None:
    """An empty edit of MP4 and MOV; two hours are the time of a camera that runs on."""
    whole = with_key_frames(tmp_path / f"whole.{suffix}", 5)
    _, summary = read(path := copied(whole, tmp_path / f"a.{suffix}", shift_s=late_s))
    late = "its first frame is at 0.60 s: what came before is missing; times count from that frame"
    assert summary.notes == ((late,) if said else ())
    with VideoReader(path) as reader:
        assert reader.declared == 5


@pytest.mark.parametrize(
    ("suffix", "codec", "lost", "options"),
    [
        ("ts", "libx265", 3, {"x265-params": f"log-level=none:pools=none:open-gop=1:{OPEN}"}),
        ("mkv", "libx264", 3, {"x264-params": f"open-gop=1:{OPEN}", "preset": "medium"}),
        ("mpg", "mpeg2video", 2, {"g": "12", "bf": "2"}),
    ],
)
def test_a_film_that_begins_with_pictures_that_refer_to_earlier_ones_keeps_its_times(
    tmp_path: Path, suffix: str, codec: str, lost: int, options: dict[str, str]
) -> None:
    """Cut at a key frame of an open group of pictures, as broadcast and camcorders write them."""
    whole = write_video(tmp_path / f"whole.{suffix}", grey_frames(40), codec=codec, options=options)
    with av.open(str(whole)) as container:
        keys = [k for k, packet in enumerate(container.demux(video=0)) if packet.is_keyframe]
    frames, summary = read(path := copied(whole, tmp_path / f"a.{suffix}", first=keys[1]))
    assert frames[0].time_ns == pytest.approx(lost / 30 * 1e9, abs=1e6)
    assert any(f"the first {lost} frames ({lost / 30:.2f} s) cannot be decoded" in note for note in summary.notes)
    shown = SeekableVideo(path).at(frames[4].time_ns / 1e9)
    assert shown is not None
    assert round(float(shown.mean()) / GREY_STEP) == levels(frames)[4]


@pytest.mark.parametrize(
    ("matrix", "turn"),
    [((-1, 0, 0, 1), None), ((1, 0, 0, -1), None), ((0, 1, 1, 0), cv2.ROTATE_90_CLOCKWISE)],
    ids=["left and right", "top and bottom", "turned"],
)
def test_a_mirror_in_the_display_matrix_is_said_and_no_half_turn(
    tmp_path: Path, matrix: tuple[int, int, int, int], turn: int | None
) -> None:
    image = np.zeros((48, 64, 3), np.uint8)
    image[:24, :32] = 250
    path = write_video(tmp_path / "a.mp4", [image] * 5)
    stored = read(path)[0][0].image()
    a, b, c, d = matrix
    content = bytearray(path.read_bytes())
    at = content.index(b"tkhd") + 4 + 4 + 20 + 16
    content[at : at + 32] = b"".join((v * 65536).to_bytes(4, "big", signed=True) for v in (a, b, 0, c, d, 0, 0, 0))
    path.write_bytes(content)
    frames, summary = read(path)
    np.testing.assert_array_equal(frames[0].image(), stored if turn is None else cv2.rotate(stored, turn))
    assert summary.notes == ("asks for a mirrored picture: not mirrored, as cameras see it",)


@pytest.mark.parametrize(
    ("suffix", "codec", "options"),
    [("mp4", "libx264", {"x264-params": "tff=1"}), ("mpg", "mpeg2video", {"flags": "+ildct+ilme"})],
)
def test_an_interlaced_film_is_noted(tmp_path: Path, suffix: str, codec: str, options: dict[str, str]) -> None:
    """As camcorders film."""
    (note,) = read(write_video(tmp_path / f"a.{suffix}", grey_frames(5), codec=codec, options=options))[1].notes
    text = "states that its pictures are interlaced, of two moments: deinterlace it, unless filmed progressively"
    assert note == text


def test_pixels_that_are_not_square_are_said(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mkv", grey_frames(5), pixel_shape=Fraction(4, 3))
    assert read(path)[1].notes == ("its pixels are not square (4:3): used as stored, as in a calibration",)


@pytest.mark.parametrize("suffix", ["mp4", "mov"])
@pytest.mark.parametrize(
    ("stated", "said"), [(None, "4:3"), (Fraction(1), "4:3 in the container, in its headers 1:1")], ids=["once", "twice"]
)
def test_pixels_that_are_not_square_by_the_container_alone_are_said(
    tmp_path: Path, suffix: str, stated: Fraction | None, said: str
) -> None:
    """As anamorphic cameras and editors write them, without touching what the codec has."""
    path = write_video(tmp_path / f"a.{suffix}", grey_frames(5), pixel_shape=stated)
    content, shape = bytearray(path.read_bytes().replace(b"pasp", b"free")), struct.pack(">I4sII", 16, b"pasp", 4, 3)
    at = content.index(b"avcC") - 4
    content[at:at] = shape
    for name in (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsd", b"avc1"):
        box = content.index(name, content.index(b"moov")) - 4
        content[box : box + 4] = struct.pack(">I", struct.unpack_from(">I", content, box)[0] + len(shape))
    path.write_bytes(content)
    assert read(path)[1].notes == (f"its pixels are not square ({said}): used as stored, as in a calibration",)


@pytest.mark.parametrize("shape", [None, Fraction(4, 3)], ids=str)
def test_more_frames_than_declared_are_used_and_said(tmp_path: Path, shape: Fraction | None) -> None:
    path = write_video(tmp_path / "a.avi", grey_frames(20), codec="mjpeg", pixels="yuvj420p", pixel_shape=shape)
    content = bytearray(path.read_bytes())
    at = content.index(b"strh") + 8 + 32  # the length of the stream's header
    content[at : at + 4] = (10).to_bytes(4, "little")
    path.write_bytes(content)
    assert read(path)[1].notes[-1] == "10 frames declared, 20 read: all are used"


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


def with_streams(path: Path, sizes: Sequence[tuple[int, int]], cover: bool) -> Path:
    """Films of 10 frames in one file.  cover: the last is one picture beside the others."""
    with av.open(str(path), "w") as container:
        films = [
            container.add_stream("mjpeg", rate=30, width=size[0], height=size[1], pix_fmt="yuvj420p") for size in sizes
        ]
        films[-1].disposition = Disposition.attached_pic if cover else films[-1].disposition
        container.start_encoding()
        for k in range(10):
            for film in films[:-1] if cover and k else films:
                frame = av.VideoFrame.from_ndarray(grey_frames(10, (film.width, film.height))[k], format="bgr24")
                frame.pts = k
                container.mux(film.encode(frame))
        for film in films:
            container.mux(film.encode(None))
    return path


@pytest.mark.parametrize("suffix", ["mp4", "mov"])
def test_of_several_films_in_one_file_the_first_is_used_which_is_said_and_a_cover_is_none(
    tmp_path: Path, suffix: str
) -> None:
    """As stereo and 360-degree cameras write them; music has a cover, drones a thumbnail."""
    path, sizes = tmp_path / f"a.{suffix}", [(64, 48), (96, 48)]
    frames, summary = read(with_streams(path, sizes, cover=False))
    assert (len(frames), frames[0].image().shape) == (10, (48, 64, 3))
    assert summary.notes == ("has 2 films: the first, of 64 x 48 px, is used",)
    assert read(with_streams(path, sizes, cover=True))[1].notes == ()
    with pytest.raises(OpenError, match="has no video stream"):
        VideoReader(with_streams(path, sizes[:1], cover=True))


@pytest.mark.parametrize("opened", [VideoReader, SeekableVideo])
def test_too_large_images_are_refused_before_one_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, opened: Callable[[Path], object]
) -> None:
    path = write_video(tmp_path / "a.mp4", grey_frames(2))
    monkeypatch.setattr("zenocap.common.video.reader.LARGEST_PX", 64 * 48 - 1)
    monkeypatch.setattr(VideoReader, "_first", Mock(side_effect=AssertionError("decoded")))
    with pytest.raises(OpenError, match=r"a\.mp4: images of 64 x 48 px: allowed: at most 3071 pixels"):
        opened(path)


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
