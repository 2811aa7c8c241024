"""Every `zenocap` command of README and documentation is run, in a folder that has the files they name.

Commands on files run to their end.  Services and other commands that run until Ctrl-C are stopped after a few seconds: they
must start, accept their options and end in order; their messages are tested elsewhere.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.board_films import board_pictures
from tests.support.documentation import command_of, distinct_commands, words_of
from tests.support.opensim_models import write_model
from tests.support.places import ROOT
from tests.support.simulated_cameras import paper_cameras
from tests.support.walkers import walker
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.ros_camera_info import ros_info_text
from zenocap.common.rig.rig import demo_rig_file
from zenocap.data import POSTURES, PRIORS
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.simulation.rendering.video_file import write_video
from zenocap.tools.calibration.board import checked_board
from zenocap.tools.cli.calibrate.scene import SCENE_EXAMPLE
from zenocap.tools.launcher.peer_mesh import free_ports

pytestmark = [pytest.mark.nightly, pytest.mark.timeout(600)]
DONE, FAILED, WRONG_USAGE, LOSS, UNUSABLE = 0, 1, 2, 3, 4
SIZE, FPS, EMPTY, FRAMES = (320, 240), 15, 15, 150
RUN_S, END_S = 4.0, 60.0
# Commands that run until Ctrl-C, and long ones: stopped after RUN_S.
LIVE = {
    "animator", "integrator", "load", "metrics", "posture act", "recognizer", "record", "replay", "router", "show", "top",
    "traces", "tracker", "up", "viewer",
}  # fmt: skip
# Commands whose result depends on the environment: the network, cameras, enough examples, answers.
MAY_FAIL = {
    "cameras",
    "doctor",
    "film",
    "health",
    "models add",
    "posture add",
    "posture evaluate",
    "posture train",
    "setup",
}
UNCERTAIN = {
    "calibrate board": {LOSS},
    "calibrate drift": {LOSS},
    "calibrate walk": {LOSS},
    "certs": {LOSS},
    "sync": {LOSS},
    "mirror": {LOSS},
    "setup": {LOSS},
    "track": {LOSS, UNUSABLE},
}  # two views at 15 frames/s may show too little; no router runs
STAND_INS = {
    "192.168.1.10": "127.0.0.1", "192.168.1.5": "127.0.0.1", "/etc/zenocap/rig.toml": "machines.toml",
    "RIG": "studio.toml", "SERVICE": "integrator", "NAME": "integrator",
}  # fmt: skip
COPIES = ("monday.mcap", "monday-2.mcap", "ann.mcap", "take.mcap", "recordings/demo-20260101T120000Z.mcap")


COMMANDS = distinct_commands()


def film(folder: Path) -> None:
    """Videos of the simulated person by two cameras, in the folder layout of the README."""
    subject = person(0)
    script = demo_timeline(subject, 0)
    first_s = script.segments[0].end_s - EMPTY / FPS
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(SIZE), strict=True))
    (folder / "videos").mkdir(parents=True)
    for name, camera in cameras.items():
        renderer = SimulatedCamera(camera, subject, 0)
        images = [renderer.render(script.pose_at(first_s + k / FPS), k) for k in range(FRAMES)]
        write_video(folder / "videos" / f"{name}.mp4", images, fps=FPS)
    write_calibration(folder / "calibration.toml", cameras)
    (folder / "clip.toml").write_text(f"empty_frames = {EMPTY - 1}\n")


def walker_film(folder: Path) -> None:
    """Videos of a simulated person who walks about, and the lenses of the cameras."""
    one = walker(0, 2)
    (folder / "videos").mkdir(parents=True)
    for name, camera in one.cameras.items():
        renderer, end_s = SimulatedCamera(camera, one.person, 0), one.motion.duration_s
        poses = [None] * EMPTY + [one.motion.pose_at(k / FPS) for k in range(int(end_s * FPS))]
        write_video(folder / "videos" / f"{name}.mp4", [renderer.render(pose, k) for k, pose in enumerate(poses)], fps=FPS)
    write_calibration(folder.parent / "known.toml", dict(one.cameras))
    (folder / "clip.toml").write_text(f"empty_frames = {EMPTY - 1}\n")


def zenocap(arguments: list[str], folder: Path, seconds: float | None = None) -> tuple[int, str]:
    """Status and output of a command.  seconds: terminate it after this time; None: wait for its end."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "200", "XDG_DATA_HOME": str(folder / "data-home")}
    command = [sys.executable, "-P", "-m", "zenocap", *arguments]
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(command, cwd=folder, env=environment, text=True, **pipes) as process:
        try:
            if seconds is not None:
                end_s = time.monotonic() + seconds
                while process.poll() is None and time.monotonic() < end_s:
                    time.sleep(0.1)
                process.terminate()
            output, _ = process.communicate(timeout=500 if seconds is None else END_S)
        finally:
            process.kill()
    return process.returncode, output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the rigs, videos, takes and models that the documentation names."""
    place = tmp_path_factory.mktemp("documented")
    film(place / "walk")
    walker_film(place / "tuesday")
    shutil.copytree(ROOT / "deploy", place / "deploy", ignore=shutil.ignore_patterns("certs"))
    calibration = demo_rig_file().with_name("demo-calibration.toml")
    rig = demo_rig_file().read_text(encoding="utf-8").replace("demo-calibration.toml", str(calibration))
    for name in ("studio", "lab", "machines", "rig"):
        (place / f"{name}.toml").write_text(rig.replace('name = "demo"', f'name = "{name}"'), encoding="utf-8")
    (place / "machines.toml").write_text(
        (place / "machines.toml").read_text(encoding="utf-8") + '\n[security]\ncertificates = "certs"\n', encoding="utf-8"
    )
    shutil.copy(calibration, place / "calibration.toml")
    # Pictures instead of videos, of a board of another size than the documented one: only the scale differs.
    films = board_pictures(place / "films", 63)
    write_calibration(place / "lenses.toml", {camera.name: camera for camera in films})
    board_pictures(place / "grid-films", 30, checked_board("aprilgrid", 6, 6, 150.0))
    (place / "points.toml").write_text(SCENE_EXAMPLE, encoding="utf-8")
    (place / "lens.yaml").write_text(ros_info_text(Lens.of(paper_cameras((640, 480))[0])), encoding="utf-8")
    shutil.copy(POSTURES / "fifteen.postures", place / "mine.postures")
    write_model(place / "Rajagopal2016.osim")
    shutil.copy(PRIORS / "walking.prior", place / "walk.prior")
    status, output = zenocap(["track", "walk", "-o", "walk.mcap"], place)
    assert status in (DONE, LOSS), output
    (place / "recordings").mkdir()
    for copy in COPIES:
        shutil.copy(place / "walk.mcap", place / copy)
    for export in ("walk1.bvh", "walk2.bvh", "walk/truth.trc", "walk/angles.mot"):
        status, output = zenocap(["export", "walk.mcap", "--to", Path(export).suffix[1:], "-o", export], place)
        assert status == DONE, output
    return place


def arguments_of(line: str) -> list[str]:
    """Arguments of a documented line with this machine's addresses and free ports."""
    (port,) = free_ports(1)
    words = words_of(line)
    for old, new in STAND_INS.items():
        words = [new if word == old else word.replace(old, new) if "." in old else word for word in words]
    words = [re.sub(r"0\.0\.0\.0:\d+", f"127.0.0.1:{port}", word) for word in words]
    if command_of(line)[1] in ("animator", "show"):
        words += ["--port", "0"]
    return words


def test_the_documentation_names_many_commands() -> None:
    assert len(COMMANDS) > 25


@pytest.mark.parametrize("line", COMMANDS)
def test_a_documented_command_runs(line: str, folder: Path) -> None:
    name = command_of(line)[1]
    live = (name in LIVE and "--once" not in line) or "--live" in line
    live |= name == "posture label" and "--terminal" not in line and "--list" not in line
    status, output = zenocap(arguments_of(line), folder, RUN_S if live else None)
    assert "Traceback" not in output, output
    allowed = {DONE, FAILED, LOSS, -signal.SIGTERM} if live else {DONE, FAILED} if name in (MAY_FAIL | LIVE) else {DONE}
    allowed |= UNCERTAIN.get(name, set())
    assert status in allowed, output
