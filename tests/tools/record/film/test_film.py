"""`zenocap film`: videos of all cameras together, with their times, and every way to end."""

import csv
import itertools
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from zenocap.common.arrays import Image
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.errors import EndedEarly, OpenError, UserError
from zenocap.common.rig.rig import Viewer, demo_rig, load_rig
from zenocap.common.rig.sources import Device, FirstFrames
from zenocap.common.video import video_writer
from zenocap.common.video.reader import VideoReader
from zenocap.common.video.video_writer import VideoWriter
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.tools.record.film import camera as camera_module
from zenocap.tools.record.film import film as film_module
from zenocap.tools.record.film.camera import Filmed, LocalCamera
from zenocap.tools.record.film.film import film, filmed_viewers
from zenocap.tools.record.film.layout import late_texts, prepare, write_layout

SIZE, FPS = (64, 48), 50.0


def viewers(folder: Path) -> list[Viewer]:
    (folder / "rig").mkdir(exist_ok=True)
    cameras = {one.camera.name: one.camera.resized(SIZE) for one in demo_rig().viewers}
    write_calibration(folder / "rig" / "calibration.toml", cameras)
    tables = "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "{name}"\nsource = {k}\nfps = {FPS}\nbackground = "first:7"\n'
        for k, name in enumerate(cameras)
    )
    (folder / "rig" / "rig.toml").write_text(f'name = "r"\ncalibration = "calibration.toml"\n{tables}')
    return filmed_viewers(load_rig(folder / "rig" / "rig.toml", files=False))


def images(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    """A camera of 50 frames/s with the number of the frame as its grey value."""
    for k in itertools.count():
        playback.sleep(1 / FPS)
        yield Frame(k, time.time_ns(), np.full((SIZE[1], SIZE[0], 3), k % 200, np.uint8))


def filmed(folder: Path, seconds: float | None, opener=images, **options) -> tuple[list[Filmed], str]:
    """The result of a film of both cameras in the folder `a`, which is ended by a time or for another reason."""
    given = {"stop": lambda: False, "report": lambda _: None} | options
    return film(viewers(folder), folder / "a", seconds, given.pop("stop"), given.pop("report"), opener, **given)


@pytest.mark.slow
def test_all_cameras_are_filmed_together_with_their_times(tmp_path):
    two, folder, reports = viewers(tmp_path), tmp_path / "a", []
    prepare(folder, two, force=False)
    found, reason = filmed(tmp_path, 1.0, report=reports.append)
    write_layout(folder, two, found)
    assert (reason, reports) == ("", ["filming 2 cameras"])
    for one in found:
        assert one.frames > 20
        assert (one.lost, one.away) == (0, 0)
        rows = list(csv.DictReader((folder / "times" / f"{one.name}.csv").open()))
        exact = np.array([int(row["captured_ns"]) for row in rows])
        assert len(exact) == one.frames
        with VideoReader(folder / "videos" / f"{one.name}.mkv") as reader:
            read = []
            while (frame := reader.next()) is not None:
                read.append((frame.time_ns, int(frame.image().mean())))
        assert np.abs(np.array([t for t, _ in read]) - (exact - exact[0])).max() <= 1_000_000
        assert set(np.diff([grey for _, grey in read])) <= {1, 0, 2}
    first = [one.first_ns for one in found]
    assert abs(first[0] - first[1]) < 200_000_000
    rig = load_rig(folder)
    assert [viewer.camera.name for viewer in rig.viewers] == [one.name for one in found]
    offsets = [viewer.source.offset_ns for viewer in rig.viewers]
    assert offsets[1] - offsets[0] == pytest.approx(first[1] - first[0], abs=200_000)
    assert all(viewer.background == FirstFrames(7) for viewer in rig.viewers)
    np.testing.assert_allclose(rig.viewers[0].camera.matrix, two[0].camera.matrix, rtol=1e-6)


def test_frames_that_wait_for_a_disk_that_hangs_at_the_end_are_lost(tmp_path, monkeypatch):
    """They were in no count, and those before as well: "no frame"."""
    monkeypatch.setattr(camera_module, "ENDS_S", 0.01)
    disk, hangs = threading.Event(), threading.Event()
    writer = VideoWriter(tmp_path / "a.mkv", tmp_path / "a.csv", SIZE, FPS)
    write = writer.write

    def hanging(image: Image, captured_ns: int) -> None:
        if writer.frames == 2:
            hangs.set()
            disk.wait(60.0)
        write(image, captured_ns)

    monkeypatch.setattr(writer, "write", hanging)
    camera = LocalCamera(
        viewers(tmp_path)[0], writer, lambda *given: itertools.islice(images(*given), 5), threading.Event(), 0
    )
    camera.start()
    assert hangs.wait(60.0)
    camera._threads[0].join(60.0)
    camera.join()
    assert "the disk does not respond" in str(camera.failure)
    assert (camera.result.frames, camera.result.lost) == (2, 3)
    disk.set()


@pytest.mark.slow
def test_it_ends_before_the_disk_is_full_and_says_so(tmp_path):
    free = iter([10**9] * 2)
    found, reason = filmed(tmp_path, None, free_bytes=lambda path: next(free, 400_000_000))
    assert reason == "the disk is nearly full: 400 MB are left"
    assert all(one.frames > 5 for one in found)
    with pytest.raises(UserError, match="a: 3 MB free: allowed: at least 500 MB"):
        filmed(tmp_path, None, free_bytes=lambda path: 3_000_000)


@pytest.mark.slow
def test_the_size_is_estimated_from_what_is_encoded(tmp_path, monkeypatch):
    monkeypatch.setattr(film_module, "ESTIMATE_S", 0.5)
    reports: list[str] = []
    found, _ = filmed(tmp_path, 1.0, report=reports.append, free_bytes=lambda path: 500_400_000)
    rate, lasts = reports[1].split(" MB a minute; the disk lasts for ")
    size = sum(path.stat().st_size for path in (tmp_path / "a" / "videos").iterdir())
    seconds = max(one.last_ns - one.first_ns for one in found) / 1e9
    assert float(rate) == pytest.approx(size / seconds * 60 / 1e6, abs=1.5)
    assert lasts.endswith("minutes")


def test_a_film_whose_process_is_killed_lacks_the_last_second_at_most(tmp_path):
    writer = VideoWriter(tmp_path / "a.mkv", tmp_path / "a.csv", SIZE, FPS)
    for k in range(200):
        writer.write(np.full((SIZE[1], SIZE[0], 3), k, np.uint8), round(k * 1e9 / FPS))
    (tmp_path / "b.mkv").write_bytes((tmp_path / "a.mkv").read_bytes())  # not closed
    writer.close()
    with VideoReader(tmp_path / "b.mkv") as reader, suppress(EndedEarly):
        while reader.next() is not None:
            pass
    assert 200 - FPS - 5 <= reader.read <= 200


@pytest.mark.slow
def test_a_signal_ends_the_files(tmp_path):
    end_s = time.monotonic() + 0.6
    found, reason = filmed(tmp_path, None, stop=lambda: time.monotonic() > end_s)
    assert reason == ""
    for one in found:
        with VideoReader(tmp_path / "a" / "videos" / f"{one.name}.mkv") as reader:
            assert reader.fps == pytest.approx(FPS, rel=0.3)


@pytest.mark.slow
def test_a_camera_that_does_not_open_is_an_error_and_one_that_is_silent_too(tmp_path, monkeypatch):
    def opener(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
        if viewer.id == "1":
            raise OpenError("camera 1: no such camera")
        yield from images(viewer, playback)

    with pytest.raises(OpenError, match="camera 1: no such camera"):
        filmed(tmp_path, 1.0, opener)
    assert [path for path in (tmp_path / "a").rglob("*") if path.is_file()] == []  # so that a second try needs no --force

    def silent(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
        while True:
            playback.sleep(0.1)
        yield

    monkeypatch.setattr(film_module, "READY_S", 0.3)
    with pytest.raises(UserError, match="no image within 0 s: see zenocap cameras"):
        filmed(tmp_path, 1.0, silent)


@pytest.mark.slow
def test_frames_that_the_writer_cannot_take_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(video_writer, "QUEUE", 1)
    write = VideoWriter.write

    def slow(self: VideoWriter, image: np.ndarray, captured_ns: int) -> None:
        time.sleep(0.1)
        write(self, image, captured_ns)

    monkeypatch.setattr(VideoWriter, "write", slow)
    found, _ = filmed(tmp_path, 1.0)
    assert all(one.lost > 10 for one in found)


def test_a_full_disk_ends_the_film_with_the_reason(tmp_path, monkeypatch):
    monkeypatch.setattr(VideoWriter, "write", Mock(side_effect=OSError(28, "No space left on device")))
    _, reason = filmed(tmp_path, 20.0)
    assert "No space left on device" in reason


def test_an_earlier_film_is_kept_without_force(tmp_path):
    two, folder = viewers(tmp_path), tmp_path / "a"
    prepare(folder, two, force=False)
    for part in ("corners", "times"):
        (folder / part).mkdir()
    for name in ("sync.toml", "corners/cam09.corners", "times/cam09.csv"):  # the last ones of the film that is replaced
        (folder / name).touch()
        with pytest.raises(UserError, match=rf"{name} exists: allowed: another folder, or --force to replace it"):
            prepare(folder, two, force=False)
        prepare(folder, two, force=True)
        assert not (folder / name).exists()
    (folder / "videos").mkdir()
    (folder / "videos" / f"{two[0].camera.name}.h264").touch()  # of another program
    (folder / "videos" / "other.mp4").touch()
    with pytest.raises(UserError, match=r"other.mp4: of a camera that is not filmed"):
        prepare(folder, two, force=True)
    (folder / "videos" / "other.mp4").unlink()
    prepare(folder, two, force=True)
    assert [path.suffix for path in (folder / "videos").iterdir()] == [".h264"]


def test_a_rig_without_cameras_has_nothing_to_film():
    with pytest.raises(UserError, match="rig demo: no viewer has a camera or stream as source: nothing to film"):
        filmed_viewers(demo_rig())
    assert Filmed("a").rate == 0.0
    assert Device(0).file == Path("/dev/video0")


def test_a_film_before_the_calibration_keeps_one_that_was_made_from_an_earlier_film(tmp_path):
    two, folder = viewers(tmp_path), tmp_path / "a"
    (folder / "videos").mkdir(parents=True)
    (folder / "calibration.toml").write_text("mine")
    prepare(folder, two, force=False, calibrated=False)
    (folder / "videos" / f"{two[0].camera.name}.mkv").write_text("old")
    with pytest.raises(UserError, match="exists: allowed: another folder, or --force"):
        prepare(folder, two, force=False, calibrated=False)
    prepare(folder, two, force=True, calibrated=False)
    assert (folder / "calibration.toml").read_text() == "mine"


@pytest.mark.slow
def test_a_first_image_long_after_the_start_is_named_in_the_report_and_in_the_folder(tmp_path):
    two, folder = viewers(tmp_path), tmp_path / "a"
    late = two[1].camera.name

    begun_s, seen = [], []

    def with_pause(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
        """After its first image the second camera has none until 0.25 s after the start of the film."""
        for k, frame in enumerate(images(viewer, playback)):
            if viewer.camera.name != late or k == 0:
                yield frame
            elif begun_s and time.monotonic() - begun_s[0] > 0.25:
                yield frame
                seen.append(frame)

    prepare(folder, two, force=False)
    found, _ = filmed(
        tmp_path, 60.0, with_pause, report=lambda _: begun_s.append(time.monotonic()), stop=lambda: len(seen) > 5
    )
    write_layout(folder, two, found)
    (text,) = late_texts(two, found)
    assert int(text.removeprefix(f"{late}: first image ").partition(" ms")[0]) >= 200
    assert text in (folder / "sync.toml").read_text()
    load_rig(folder)
    assert Filmed("a", 5, first_ns=39_000_000, begin_ns=1).late_text(50.0) == ""
