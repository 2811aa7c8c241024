"""One film of cameras on several machines, which are processes here."""

import shutil
import socket
import threading
import time
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import cv2
import msgpack
import msgspec
import numpy as np
import pytest

from tests.support.board_films import FILM_BOARD, VIDEO_SIZE, board_images
from tests.support.board_views import room
from tests.support.demo_rigs import written_rig
from tests.support.mjpeg_server import BITS, MjpegServer, time_in
from tests.support.networks import client, free_endpoint, listener, listens
from tests.support.processes import PATIENCE_S, output_of, run, started, wait_until
from tests.support.simulated_cameras import paper_cameras
from tests.system.test_film import NAMES
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.bus.zenoh_query_server import QueryServer
from zenocap.common.bus.zenoh_session import open_session
from zenocap.common.messages import FilmQuery
from zenocap.common.rig.rig import load_rig
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import FILM, HOST_FILM
from zenocap.common.video.reader import VideoReader
from zenocap.services.camera.endpoint import FilmEndpoint, Permission
from zenocap.services.viewer.sources.tap import Tap
from zenocap.tools.record.film.collect import collected
from zenocap.tools.record.film.film import film
from zenocap.tools.record.film.remote_film import cameras_of

pytestmark = pytest.mark.nightly  # films in real time, whose rates other load changes
SIZE, FPS, FILM_S = (320, 240), 30.0, 4.0
WALK = ("film", "rig.toml", "-o", "walk")


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Path]:
    """A rig file of two streams that show a time code."""
    with ExitStack() as stack:
        urls = [stack.enter_context(MjpegServer(SIZE, FPS)).url for _ in NAMES]
        cameras = dict(zip(NAMES, paper_cameras(SIZE), strict=True))
        yield written_rig(tmp_path, cameras, urls, name="machines-test", head="film = true", each=f"fps = {FPS}")


class Machines:
    """Two processes `zenocap viewer --discover`, each with one of the cameras and a folder."""

    def __init__(self, rig: Path, stack: ExitStack) -> None:
        self.endpoint = free_endpoint()
        self.network = ("-e", self.endpoint, "--no-multicast-scouting")
        sources = [viewer.source.url for viewer in load_rig(rig, files=False).viewers]
        self.folders = [rig.parent / f"lab{k}" for k in range(2)]
        self.processes = []
        for k, folder in enumerate(self.folders):
            folder.mkdir()
            place = ("-l", self.endpoint, "--no-multicast-scouting") if k == 0 else self.network
            camera = f"{NAMES[k]}={sources[k]}"
            arguments = ["viewer", "--discover", "--machine", f"lab{k}", "--camera", camera, *place]
            self.processes.append(stack.enter_context(started(arguments, folder)))
            wait_until(lambda folder=folder: "announces" in output_of(folder), folder)

    def films(self, k: int) -> list[Path]:
        return sorted(self.folders[k].glob("films/*/videos/*.mkv"))


def true_times(video: Path) -> np.ndarray:
    """Time codes in the images, ms."""
    times = []
    with VideoReader(video) as reader:
        while (frame := reader.next()) is not None:
            times.append(time_in(frame.image()))
    return np.array(times)


def test_cameras_of_two_machines_begin_together_and_are_copied_by_the_printed_commands(rig: Path, stack: ExitStack) -> None:
    machines = Machines(rig, stack)
    status, text = run(rig.parent, *WALK, "--seconds", str(FILM_S), *machines.network)
    assert status == 0, text
    assert "filming 2 cameras; cam01 on lab0, cam02 on lab1" in text
    for line in text.splitlines():
        if line.startswith("  scp -- lab"):
            source, target = line.split()[2:]
            target = rig.parent / target
            target.mkdir(parents=True, exist_ok=True)
            shutil.copy(source.partition(":")[2], target)
    videos = [rig.parent / "walk" / "videos" / f"{name}.mkv" for name in NAMES]
    times = [true_times(video) for video in videos]
    assert all(len(one) == pytest.approx(FILM_S * FPS, rel=0.15) for one in times)
    between_ms = (int(times[1][0]) - int(times[0][0]) + 2 ** (BITS - 1)) % 2**BITS - 2 ** (BITS - 1)
    assert abs(between_ms) < 150  # a period of the cameras and the delay of busy machines
    sync = tomllib.loads((rig.parent / "walk" / "sync.toml").read_text())["offset_s"]
    assert (sync["cam02"] - sync["cam01"]) * 1e3 == pytest.approx(between_ms, abs=60)
    assert [viewer.camera.name for viewer in load_rig(rig.parent / "walk").viewers] == list(NAMES)
    status, text = run(rig.parent, "cameras", "--discover", *machines.network)
    assert status == 0, text
    host = socket.gethostname()
    assert f"lab0 ({host}): cam01" in text
    assert f"lab1 ({host}): cam02" in text


def test_pictures_stay_where_they_are_without_permission(rig: Path, stack: ExitStack) -> None:
    machines = Machines(rig, stack)
    status, text = run(rig.parent, *WALK, "--seconds", "2", "--fetch", *machines.network)
    assert status == 1, text
    assert "cam01 on lab0: pictures do not leave that machine: allowed with --fetch: a rig with certificates" in text
    assert "without --fetch the film is made, and the commands that copy it are printed" in text
    assert not any(machines.films(k) for k in range(2))
    status, text = run(rig.parent, *WALK, "--seconds", "2", *machines.network)
    assert status == 0, text
    assert "next: copy videos/ and times/ of cam01, cam02 into walk" in text
    there = machines.films(1)[0]
    assert f"scp -- lab1:{there} walk/videos/" in text
    for command in (
        ("board", "walk", "--square", "30"),
        ("walk", "walk", "--height", "1.7", "--lenses", "calibration.toml"),
    ):
        status, refused = run(rig.parent, "calibrate", *command, "-o", "new.toml")
        assert status == 1, refused
        assert "videos still on the machines of their cameras: cam01 on lab0, cam02 on lab1" in refused
        assert f"scp -- lab1:{there} walk/videos/" in refused
    assert not list((rig.parent / "walk").rglob("*.mkv*"))
    assert [len(machines.films(k)) for k in range(2)] == [1, 1]


def test_a_board_is_searched_where_the_films_are_and_the_calibration_is_that_of_the_videos(tmp_path: Path) -> None:
    """Without permission to copy pictures."""
    cameras, fps = room(2, 0, VIDEO_SIZE), 10
    image_at, begin_s = board_images(cameras, FILM_BOARD, 0, key_s=0.7), time.monotonic()
    with ExitStack() as stack:
        urls = []
        for camera in cameras:
            shown = [cv2.cvtColor(image_at(camera, k / fps, k), cv2.COLOR_GRAY2BGR) for k in range(3 * fps)]

            def picture(shown: list[np.ndarray] = shown) -> np.ndarray:
                return shown[int(fps * (time.monotonic() - begin_s)) % len(shown)]

            urls.append(stack.enter_context(MjpegServer(VIDEO_SIZE, fps, picture=picture)).url)
        named = {camera.name: camera for camera in cameras}
        machines = Machines(written_rig(tmp_path, named, urls, name="board-test", each=f"fps = {fps}"), stack)
        status, text = run(tmp_path, *WALK, "--seconds", "4", "--square", "200", *machines.network)
        assert status == 0, text
        assert "searching the board where the films are: cam01 on lab0, cam02 on lab1" in text
        assert text.count("its corners copied") == 2
        assert "next: zenocap calibrate board walk --square=200.0" in text
        assert not list((tmp_path / "walk").rglob("*.mkv*"))
        (tmp_path / "copied" / "videos").mkdir(parents=True)
        shutil.copy(tmp_path / "walk" / "sync.toml", tmp_path / "copied")
        for k in range(2):
            shutil.copy(machines.films(k)[0], tmp_path / "copied" / "videos")
    for name in ("walk", "copied"):
        options = ("--square", "200", "--lenses", "calibration.toml", "-o", f"{name}.toml")
        status, text = run(tmp_path, "calibrate", "board", name, *options)
        assert status in (0, 3), text
    assert (tmp_path / "walk.toml").read_bytes() == (tmp_path / "copied.toml").read_bytes()


def test_a_machine_that_fails_is_named_and_the_other_goes_on(rig: Path, stack: ExitStack) -> None:
    machines = Machines(rig, stack)
    filming = stack.enter_context(started([*WALK, "--seconds", "18", *machines.network], rig.parent))
    wait_until(lambda: bool(machines.films(0) and machines.films(1)), machines.folders[1])
    time.sleep(3.0)
    machines.processes[1].kill()
    status, text = filming.wait(PATIENCE_S), output_of(rig.parent)
    assert status == 3, text
    assert "cam02 on lab1: no answer for 10 s" in text
    assert "the others go on" in text
    assert len(true_times(machines.films(0)[0])) > 15 * FPS
    assert machines.films(1)  # what it had is there


def test_a_film_ends_when_its_commander_is_killed(rig: Path, stack: ExitStack) -> None:
    machines = Machines(rig, stack)
    filming = stack.enter_context(started([*WALK, *machines.network], rig.parent))
    wait_until(lambda: all("recording" in output_of(folder) for folder in machines.folders), machines.folders[0])
    status, text = run(rig.parent, "film", "rig.toml", "-o", "second", "--seconds", "1", *machines.network)
    assert status == 1
    assert "is being recorded: allowed: one at a time" in text
    filming.kill()
    for folder in machines.folders:
        wait_until(lambda folder=folder: "who filmed is gone: no query for 10 s" in output_of(folder), folder)
    assert len(true_times(machines.films(0)[0])) > 0


def test_messages_of_a_stranger_write_nothing_elsewhere(rig: Path, stack: ExitStack) -> None:
    machines = Machines(rig, stack)
    session = stack.enter_context(open_session(client(machines.endpoint, "peer")))
    before = sorted(rig.parent.rglob("*"))
    key = HOST_FILM.format(machine="lab0", camera="cam01")
    for name in ("..", "../../x", "/tmp/x", "a\nb"):
        query = FilmQuery(frame=1, captured_ns=1, what="open", sender="x", film="a", camera="cam01")
        payload = msgpack.packb(msgspec.to_builtins(query) | {"film": name})
        assert not [reply for reply in session.get(key, payload=payload, timeout=1.0) if reply.ok is not None]
    created = [path for path in sorted(rig.parent.rglob("*")) if path not in before]
    assert not created
    query = FilmQuery(frame=1, captured_ns=1, what="state", sender="x")
    reply = FilmSession(session).ask(key, query, 2.0)[key]
    assert (reply.state, reply.film) == ("idle", None)


class ShiftedClock(RealClock):
    """The clock of a machine that is 7 s ahead."""

    def now_ns(self) -> int:
        return super().now_ns() + 7_000_000_000


def test_differing_clocks_are_corrected_and_films_copied(rig: Path, tmp_path: Path) -> None:
    """Viewer 1 has a clock that is 7 s ahead.  Its rig is taken for one with certificates."""
    endpoint, loaded = free_endpoint(), load_rig(rig, files=False)
    with ExitStack() as stack:
        session = stack.enter_context(open_session(listener(endpoint)))
        ended = False
        for viewer, clock in zip(loaded.viewers, (RealClock(), ShiftedClock()), strict=True):
            tap = Tap(SIZE, FPS)
            camera = FilmEndpoint(tap, viewer.camera.name, tmp_path / viewer.id, Permission(True, read=True), clock, "lab")
            key = FILM.format(rig=loaded.name, viewer=viewer.id)
            server = QueryServer(session, key, FilmQuery, camera.answer, camera.check)
            stack.callback(server.undeclare)

            def give(tap: Tap = tap, clock: RealClock = clock) -> None:
                while not ended:
                    tap.offer(np.zeros((SIZE[1], SIZE[0], 3), np.uint8), clock.now_ns())
                    time.sleep(0.01)

            thread = threading.Thread(target=give)
            thread.start()
            stack.callback(thread.join)
        try:
            with cameras_of(loaded, loaded.viewers, client(endpoint, "peer"), "walk", print) as (own, remote):
                assert own == []
                remote.secured = True
                filmed, reason = film([], tmp_path / "out", 2.0, lambda: False, print, remote=remote)
                clocks = [camera.clock for camera in remote.cameras]
                _, failures = collected(remote, tmp_path / "out", fetch=True, report=print)
        finally:
            ended = True
    assert (reason, failures) == ("", [])
    for viewer in loaded.viewers:
        (video,) = (tmp_path / viewer.id).rglob("*.mkv")
        assert (tmp_path / "out" / "videos" / video.name).read_bytes() == video.read_bytes()
    assert abs(filmed[0].first_ns - filmed[1].first_ns) < 60_000_000
    assert all(one.frames > 20 for one in filmed)
    assert abs(clocks[0].offset_ns) <= clocks[0].error_ns
    assert abs(clocks[1].offset_ns - 7_000_000_000) <= clocks[1].error_ns


def test_nobody_announces_a_camera(tmp_path: Path) -> None:
    status, text = run(tmp_path, "cameras", "--discover", "--no-multicast-scouting")
    assert status == 1
    assert "no machine of this network announces a camera: run `zenocap viewer --discover`" in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "RIG and --id are missing"),
        (("rig.toml", "--id", "1", "--discover"), "--discover: allowed without RIG and --id"),
        (("--discover", "--camera", "../x=0"), "--camera ../x=0: allowed: NAME=SOURCE"),
        (("--discover", "--camera", "a=film.mp4"), "no camera and no stream"),
        (("--discover", "--machine", "a/b"), "--machine 'a/b': allowed"),
    ],
)
def test_wrong_use_of_discover_is_named(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    status, text = run(tmp_path, "viewer", *arguments)
    assert status in (1, 2), text
    assert words in " ".join(text.replace("│", " ").split()), text


def test_a_running_rig_without_permission_is_not_filmed(rig: Path) -> None:
    rig.write_text(rig.read_text().replace("film = true\n", ""))
    place = (free_endpoint(), "--no-multicast-scouting")
    with started(["viewer", "rig.toml", "--id", "0", "-l", *place], rig.parent):
        wait_until(lambda: listens(place[0]), rig.parent)
        status, text = run(rig.parent, *WALK, "--seconds", "1", "-e", *place)
    assert status == 1
    assert "viewer 0 runs on" in text
    assert "allowed: film = true in the rig file" in text
