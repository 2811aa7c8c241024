"""Frames of the videos of a take at any time, and the take that a folder means."""

from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track
from tests.support.foxglove_reader import in_envelope
from tests.support.pose_tracks import moving
from tests.support.simulated_cameras import paper_cameras
from tests.support.video_file import ask_for_turn, write_video
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.errors import OpenError, UserError
from zenocap.common.recording.opening import new_recording
from zenocap.common.rig.rig import load_rig
from zenocap.common.video.reader import VideoReader
from zenocap.tools.cli.track import next_commands
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.take_videos import SeekableVideo, take_of, videos_of

FPS, FRAMES = 30, 150


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Frame k is of brightness 20 + k."""
    images = [np.full((48, 64, 3), 20 + k, np.uint8) for k in range(FRAMES)]
    return write_video(tmp_path_factory.mktemp("video") / "cam01.mp4", images, fps=FPS)


def frame_at(video: SeekableVideo, path: Path, time_s: float) -> int:
    """Number of the frame whose brightness an image has, by reading the file from its beginning."""
    with VideoReader(path) as reader:
        levels = [float(frame.image().mean()) for frame in iter(reader.next, None)]
    image = video.at(time_s)
    assert image is not None
    return int(np.argmin(np.abs(np.array(levels) - float(image.mean()))))


@pytest.mark.nightly
def test_frames_are_those_of_the_time_forwards_backwards_and_far_away(video: Path) -> None:
    one = SeekableVideo(video)
    for time_s in (0.0, 0.5, 0.5, 0.6, 4.5, 1.0, 0.1, 2.0, 4.9):
        assert abs(frame_at(one, video, time_s) - time_s * FPS) <= 1, time_s
    one.close()


@pytest.mark.slow
def test_there_is_no_frame_outside_of_the_file(video: Path) -> None:
    one = SeekableVideo(video)
    assert one.at(-0.1) is None
    assert one.at(60.0) is None
    assert abs(frame_at(one, video, 1.0) - FPS) <= 1


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_pictures_are_turned_as_the_file_asks_for(tmp_path: Path, degrees: int) -> None:
    image = np.zeros((48, 64, 3), np.uint8)
    image[:24, :32] = 250
    path = write_video(tmp_path / "a.mp4", [image] * 90, fps=FPS)
    ask_for_turn(path, degrees)
    with VideoReader(path) as reader:
        frame = reader.next()
        assert frame is not None
        shape, bright = frame.image().shape, frame.image() > 125
    one = SeekableVideo(path)
    for time_s in (0.0, 2.5, 0.5):
        found = one.at(time_s)
        assert found is not None
        assert found.shape == shape
        assert np.mean((found > 125) == bright) > 0.99
    one.close()


@pytest.mark.parametrize("suffix", ["h264", "mjpeg"])
def test_a_bare_stream_has_the_pictures_of_its_times(tmp_path: Path, suffix: str) -> None:
    images = [np.full((48, 64, 3), 20 + 2 * k, np.uint8) for k in range(90)]
    more = {"codec": "mjpeg", "pixels": "yuvj420p"} if suffix == "mjpeg" else {}
    path = write_video(tmp_path / f"a.{suffix}", images, fps=FPS, **more)
    with VideoReader(path) as reader:
        fps = reader.fps
    one = SeekableVideo(path)
    for time_s in (0.0, 1.0, 2.5, 0.5):
        assert abs(frame_at(one, path, time_s) - time_s * fps) <= 1, time_s
    one.close()


def test_a_file_that_is_no_video_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    with pytest.raises(OpenError, match=r"text\.mp4: not a video"):
        SeekableVideo(tmp_path / "text.mp4")


def test_a_folder_means_its_take(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "walk"
    folder.mkdir()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=r"walk: no walk\.mcap here, beside the folder or in it"):
        take_of(folder)
    (folder / "walk.mcap").touch()
    assert take_of(folder) == folder / "walk.mcap"
    (tmp_path / "walk.mcap").touch()
    assert take_of(folder).resolve() == tmp_path / "walk.mcap"
    assert take_of(tmp_path / "gone.mcap") == tmp_path / "gone.mcap"


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """A folder of two videos whose name is not that of its rig, and its take in another folder."""
    cameras = dict(zip(("cam01", "cam02"), paper_cameras((64, 48)), strict=True))
    folder = tmp_path / "my films" / "a walk"
    (folder / "videos").mkdir(parents=True)
    for name in cameras:
        write_video(folder / "videos" / f"{name}.mp4", [np.full((48, 64, 3), 90, np.uint8)] * 3, fps=FPS)
    write_calibration(folder / "calibration.toml", cameras)
    (tmp_path / "takes").mkdir()
    tracked_take(folder, tmp_path / "takes" / "a.mcap")
    return folder


def tracked_take(folder: Path, path: Path, start_ns: int = EPOCH_NS) -> Path:
    recording = new_recording(load_rig(folder, "two-view"), path, start_ns, {})
    recording.record(in_envelope(messages_of_track(moving(1))[0], received_ns=start_ns))
    recording.close()
    return path


def test_videos_are_found_by_the_name_of_the_rig_and_a_take_without_is_said(
    walk: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    away, inside = tmp_path / "takes" / "a.mcap", tracked_take(walk, walk / "a.mcap")
    monkeypatch.chdir(walk)
    beside = tracked_take(walk, walk.parent / "a.mcap")
    for take, shown in ((beside, None), (inside, None), (Path("a.mcap"), None), (away, walk)):
        assert videos_of(take, None, shown) is not None
    assert not caplog.messages
    for take in (away, tracked_take(walk, tmp_path / "takes" / "b.mcap")):
        assert videos_of(take, None) is None
        assert caplog.messages[-1] == (
            f"{take}: no pictures: no folder a-walk with videos/ beside it: allowed: --videos FOLDER"
        )
    (walk / "videos" / "cam02.mp4").write_text("no video")
    assert videos_of(beside, None) is None
    assert "no pictures: " in caplog.messages[-1]
    assert len(caplog.messages) == 3


def test_a_recorded_take_has_no_videos_to_be_said(walk: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    take = tracked_take(walk, tmp_path / "live.mcap", start_ns=1_800_000_000_000_000_000)
    assert videos_of(take, None) is None
    assert not caplog.messages
    with pytest.raises(UserError, match=r"live\.mcap: the take was recorded from cameras"):
        videos_of(take, walk)


def test_the_next_command_names_a_folder_that_is_not_beside_the_take(walk: Path) -> None:
    take = walk.parent.parent / "takes" / "a.mcap"
    assert next_commands(take, walk).splitlines()[0] == f"next: zenocap show {take} --videos '{walk}'"
    for place in (walk, walk.parent):
        assert "--videos" not in next_commands(place / "a.mcap", walk)
