"""Film two network cameras that see a simulated person, and track the folder; Ctrl-C; a second try."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from tests.support.demo_rigs import written_rig
from tests.support.mjpeg_server import MjpegServer
from tests.support.networks import free_endpoint
from tests.support.processes import ended, output_of, run, started, wait_until
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.video.frame_times import Timing
from zenocap.common.video.reader import VideoReader
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

pytestmark = pytest.mark.nightly  # films in real time, whose rates other load changes
NAMES = ("cam01", "cam02")
SIZE, FPS, EMPTY_S, FILM_S, SHOWN_S = (320, 240), 15.0, 4.0, 12.0, 16.0


class Scene:
    """An empty room, then the simulated person; begins when the first camera is looked at."""

    def __init__(self) -> None:
        subject = person(0)
        script = demo_timeline(subject, 0)
        arrives_s = script.segments[0].end_s
        self.begin_s: float | None = None
        self.repeated = False
        self.images: list[list[np.ndarray]] = []
        for camera in paper_cameras(SIZE):
            renderer = SimulatedCamera(camera, subject, 0)
            times = [arrives_s - EMPTY_S + k / FPS for k in range(int(SHOWN_S * FPS))]
            self.images.append([renderer.render(script.pose_at(max(0.0, t)), k) for k, t in enumerate(times)])

    def picture(self, camera: int) -> Callable[[], np.ndarray]:
        def now() -> np.ndarray:
            self.begin_s = self.begin_s or time.monotonic()
            k = int((time.monotonic() - self.begin_s) * FPS)
            count = len(self.images[camera])
            return self.images[camera][k % count if self.repeated else min(k, count - 1)]

        return now


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory, scene: Scene) -> Iterator[Path]:
    """A rig file of two streams."""
    cameras = dict(zip(NAMES, paper_cameras(SIZE), strict=True))
    with ExitStack() as stack:
        urls = [stack.enter_context(MjpegServer(SIZE, FPS, picture=scene.picture(k))).url for k in range(2)]
        each = f'background = "first:15"\nfps = {FPS}'
        yield written_rig(tmp_path_factory.mktemp("film"), cameras, urls, name="film", head="film = true", each=each)


def timing_of(video: Path) -> Timing:
    """Of all frames, which are decoded."""
    with VideoReader(video) as reader:
        while reader.next() is not None:
            pass
        return reader.summary().timing


def test_a_film_of_two_streams_is_tracked(rig: Path) -> None:
    status, text = run(rig.parent, "film", "rig.toml", "-o", "walk", "--seconds", str(FILM_S))
    assert status == 0, text
    assert "cam01: " in text
    assert "next: zenocap track walk -o walk.mcap" in text
    for name in NAMES:
        timing = timing_of(rig.parent / "walk" / "videos" / f"{name}.mkv")
        assert timing.duration_s == pytest.approx(FILM_S, abs=0.5)
        assert timing.frames == pytest.approx(FILM_S * FPS, rel=0.1)
    status, text = run(rig.parent, "track", "walk", "-o", "walk.mcap")
    assert status in (0, 3, 4), text  # two views at 15 frames/s may show too little for a good verdict
    assert "no pose" not in text


def test_ctrl_c_ends_a_film_in_order(rig: Path) -> None:
    videos = [rig.parent / "short" / "videos" / f"{name}.mkv" for name in NAMES]
    with started(["film", "rig.toml", "-o", "short"], rig.parent) as process:
        wait_until(lambda: all(one.is_file() and one.stat().st_size > 50_000 for one in videos), rig.parent)
        assert ended(process, signal.SIGINT) == 0, output_of(rig.parent)
    assert min(timing_of(video).frames for video in videos) > 3


def test_a_camera_that_is_not_there_is_one_line(rig: Path) -> None:
    other = rig.with_name("other.toml")
    other.write_text(rig.read_text().replace("/stream", "/nothing"))
    status, text = run(rig.parent, "film", "other.toml", "-o", "none", "--seconds", "1")
    assert status == 1
    assert "error: http://127.0.0.1" in text
    assert "the stream does not open" in text


def test_cameras_without_a_calibration_are_filmed_by_name(rig: Path) -> None:
    urls = [line.split('"')[1] for line in rig.read_text().splitlines() if line.startswith("source")]
    named = [f"{name}={url}" for name, url in zip(("left", "right"), urls, strict=True)]
    shape = ("--size", "320x240", "--fps", "15")
    status, text = run(rig.parent, "film", *named, *shape, "--seconds", "2", "-o", "board")
    assert status == 0, text
    assert "next: zenocap calibrate board board --square MM" in text
    folder = rig.parent / "board"
    assert sorted(path.name for path in (folder / "videos").iterdir()) == ["left.mkv", "right.mkv"]
    assert not (folder / "calibration.toml").exists()
    for path in (folder / "videos").iterdir():
        with VideoReader(path) as reader:
            assert reader.size == SIZE


def test_a_running_rig_is_filmed_and_goes_on(rig: Path, scene: Scene) -> None:
    scene.repeated, scene.begin_s = True, None  # empty when the rig begins: it learned a person, and tracked none
    place = (free_endpoint(), "--no-multicast-scouting")
    with started(["up", "rig.toml", "--no-page", "-l", *place], rig.parent) as up:
        wait_until(lambda: "tracking" in output_of(rig.parent), rig.parent)
        status, text = run(rig.parent, "film", "rig.toml", "-o", "running", "--seconds", "20", "-e", *place)
        assert status == 0, text
        assert "filming 2 cameras; cam01 on " in text
        assert up.poll() is None
        assert ended(up, signal.SIGINT) in (0, 3)
    assert not (rig.parent / "running" / "clip.toml").exists()
    for name in NAMES:
        assert timing_of(rig.parent / "running" / "videos" / f"{name}.mkv").frames > 0.85 * 20 * FPS
    status, text = run(rig.parent, "track", "running", "-o", "running.mcap")
    assert status in (0, 3, 4), text  # whether it has poses depends on where in the repeated scene the film begins
    assert int(text.split("running.mcap: ")[1].split(" frames")[0]) > 0.85 * 20 * FPS
