"""`zenocap track` with the user's decisions: hardware, cameras, next commands."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

import zenocap
from tests.support.command import zenocap as command
from tests.support.places import GOLDEN
from tests.support.simulated_cameras import paper_cameras
from tests.support.video_file import write_video
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import SETUP_FILE, VIDEO_NOTES, read_setup
from zenocap.common.recording.writer import Recording
from zenocap.common.topics import SILHOUETTE
from zenocap.common.vision.mask_codec import unpack
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.takes.take_videos import videos_of

pytestmark = pytest.mark.slow
SIZE, FPS, EMPTY, FRAMES = (160, 120), 15.0, 15, 45


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two videos of the simulated person in the T-pose."""
    folder = tmp_path_factory.mktemp("films") / "walk"
    subject = person(0)
    script = demo_timeline(subject, 0)
    first_s = script.segments[0].end_s - EMPTY / FPS
    (folder / "videos").mkdir(parents=True)
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(SIZE), strict=True))
    for name, camera in cameras.items():
        renderer = SimulatedCamera(camera, subject, 0)
        video = cv2.VideoWriter(str(folder / "videos" / f"{name}.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), FPS, SIZE)
        for k in range(FRAMES):
            video.write(renderer.render(script.pose_at(first_s + k / FPS), k))
        video.release()
    write_calibration(folder / "calibration.toml", cameras)
    (folder / "clip.toml").write_text(f"empty_frames = {EMPTY - 1}\n")
    return folder


@pytest.fixture(scope="module")
def take(walk: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("take") / "walk.mcap"
    run("track", walk, "-o", path, "--no-both-ways")
    return path


def run(*arguments: object) -> tuple[int, str]:
    status, out, err = command(*arguments)
    return status, out + err


def test_an_assumed_frame_rate_is_stated_by_the_take_and_its_exports(walk: Path, tmp_path: Path) -> None:
    """A film of another rate would have a wrong time axis in all of them."""
    films = []
    for path in sorted((walk / "videos").glob("*.mp4")):
        film = cv2.VideoCapture(str(path))
        images = [image for _, image in iter(film.read, (False, None))]
        films.append(write_video(tmp_path / f"{path.stem}.mjpeg", images, codec="mjpeg", pixels="yuvj420p"))
    about = ("--calibration", walk / "calibration.toml", "--empty-frames", EMPTY - 1)
    _, text = run("track", *films, *about, "-o", tmp_path / "a.mcap")
    assert "note: cam01: states no frame rate: 25/s assumed" in text
    assert "cam02 states no frame rate: 25/s assumed" in run("info", tmp_path / "a.mcap")[1]
    recording = Recording(tmp_path / "b.mcap", rig="ring", start_ns=0, metadata={VIDEO_NOTES: {"1": "25/s assumed\x1b[2J"}})
    for envelope in TakeReader(GOLDEN / "ring.mcap").envelopes():
        recording.record(envelope)
    recording.close()
    _, text = run("export", recording.path, "-o", tmp_path / "b.csv")
    assert "note: video of viewer 1: 25/s assumed" in text
    assert "\x1b" not in text  # takes come from others


@pytest.mark.nightly
def test_the_take_is_equal_where_there_is_no_hardware_and_a_note_says_why(walk: Path, tmp_path: Path) -> None:
    status, text = run("track", walk, "-o", tmp_path / "a.mcap", "--no-both-ways")
    assert "note: " not in text
    again, text = run("track", walk, "-o", tmp_path / "b.mcap", "--no-both-ways", "--hardware-decoding")
    assert again == status
    if "decoded in software" in text:  # else this machine has such a decoder, whose pixels may differ
        assert "note: cam01: decoded in software, not by hardware: " in text
        assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.nightly
def test_next_commands_name_the_take(walk: Path, tmp_path: Path) -> None:
    take = tmp_path / "my take.mcap"
    _, text = run("track", walk, "-o", take, "--no-both-ways")
    assert f"next: zenocap show '{take}' --videos {walk}\n" in text
    assert f"zenocap export '{take}' -o '{tmp_path / 'my take.bvh'}'" in text
    _, text = run("track", walk, "-o", tmp_path / "a.bvh", "--no-both-ways")
    assert "next:" not in text


@pytest.mark.nightly
def test_frames_of_a_separate_video_of_the_t_pose_are_counted_apart(walk: Path, tmp_path: Path) -> None:
    shutil.copytree(walk, tmp_path / "walk")
    shutil.copytree(walk / "videos", tmp_path / "walk" / "stretched")
    _, text = run("track", tmp_path / "walk", "-o", tmp_path / "a.mcap", "--no-both-ways")
    assert f"a.mcap: {2 * FRAMES} frames ({FRAMES} of the separate T-pose), " in text


@pytest.mark.nightly
def test_the_decision_is_part_of_the_take(walk: Path, tmp_path: Path) -> None:
    run("track", walk, "-o", tmp_path / "a.mcap", "--no-both-ways", "--front", "cam01")
    take = TakeReader(tmp_path / "a.mcap")
    assert list(take.messages())
    tracker = read_setup(tmp_path / "a.mcap", take.attachments[SETUP_FILE]).tracker
    assert tracker is not None
    assert tracker.front == "cam01"
    status, text = run("verify", tmp_path / "a.mcap")
    assert status == 0, text
    found = zenocap.track(walk, tmp_path / "b.mcap", both_ways=False, front="cam01")
    assert (tmp_path / "b.mcap").read_bytes() == (tmp_path / "a.mcap").read_bytes()
    assert found.frame_count


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--front", "cam09"], "error: --front = 'cam09': no such camera: allowed: cam01, cam02"),
        (["--front", "cam01", "--heading", "9"], "error: --heading = 9: allowed: only without front, which is 'cam01'"),
        (["--method", "two-view", "--front", "cam01"], "'two-view' has no tracker: allowed with --prior, "),
        (["--method", "two-view", "--heading", "9"], "--heading: hybrid, image-force, particle-filter"),
        (["--cameras", "cam01, cam03"], "cameras: 'cam03': no such camera: allowed: cam01, cam02"),
    ],
)
def test_wrong_decisions_are_refused(walk: Path, tmp_path: Path, options: list[str], words: str) -> None:
    status, text = run("track", walk, "-o", tmp_path / "a.mcap", *options)
    assert (status, words in text) == (1, True), text
    assert not (tmp_path / "a.mcap").exists()


def test_cameras_of_a_loaded_rig_are_refused(walk: Path, tmp_path: Path) -> None:
    rig = zenocap.Rig.load(walk, cameras=["cam01", "cam02"])
    with pytest.raises(UserError, match=r"cameras: allowed with files or a folder; for a rig: Rig\.load"):
        zenocap.track(rig, tmp_path / "a.mcap", cameras=["cam01", "cam02"])


@pytest.mark.nightly
def test_pictures_behind_a_take_are_those_of_its_silhouettes(walk: Path, take: Path) -> None:
    assert videos_of(take, None) is None  # the folder is not beside the take
    videos = videos_of(take, walk)
    assert videos is not None
    _, empty = cv2.VideoCapture(str(walk / "videos" / "cam01.mp4")).read()  # the first frame
    checked = 0
    for received in TakeReader(take).envelopes((SILHOUETTE,)):
        silhouette = received.message
        if not silhouette.data:
            continue
        picture = cv2.imdecode(np.frombuffer(dict(videos.at(silhouette.captured_ns))["cam01"], np.uint8), cv2.IMREAD_COLOR)
        if silhouette.viewer == "cam01":
            person_px = unpack(silhouette.size, silhouette.region, silhouette.data) != 0
            changed = np.abs(picture.astype(float) - empty).max(axis=2) > 25
            assert np.mean(changed[person_px]) > 0.4
            assert np.mean(changed[~person_px]) < 0.1
            checked += 1
    assert checked > 10
    videos.close()


@pytest.mark.nightly
def test_videos_of_other_cameras_are_refused(walk: Path, take: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(walk, other)
    (other / "videos" / "cam02.mp4").rename(other / "videos" / "cam03.mp4")
    text = (other / "calibration.toml").read_text(encoding="utf-8")
    (other / "calibration.toml").write_text(text.replace("cam02", "cam03"), encoding="utf-8")
    with pytest.raises(
        UserError, match=r"--videos .*other: cameras cam01, cam03: allowed: .* those of the take: cam01, cam02"
    ):
        videos_of(take, other)
