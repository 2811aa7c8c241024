"""Rigs, videos, takes and models that the documentation names, and `zenocap` processes among them."""

import os
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from tests.support.board_films import board_pictures
from tests.support.demo_rigs import CALIBRATION
from tests.support.opensim_models import write_model
from tests.support.person_films import film, walker_film
from tests.support.places import GOLDEN, ROOT
from tests.support.processes import ENVIRONMENT, ZENOCAP, wait_until
from tests.support.simulated_cameras import paper_cameras
from tests.support.stored import stored_files
from zenocap import open_take
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.ros_camera_info import ros_info_text
from zenocap.common.rig.rig import demo_rig_file
from zenocap.data import POSTURES, PRIORS
from zenocap.tools.cli.calibrate.scene import SCENE_EXAMPLE
from zenocap.tools.setup.calibration.board import checked_board

RUN_S, END_S = 2.0, 500.0
TRACKING = ("zenocap.tools.cli.track", "zenocap.tools.cli.export")
EXPORTS = ("walk1.bvh", "walk2.bvh", "walk/truth.trc", "walk/angles.mot")
COPIES = ("monday.mcap", "monday-2.mcap", "ann.mcap", "take.mcap", "recordings/demo-20260101T120000Z.mcap")


def documented_folder(place: Path, *, films: bool) -> None:
    """Fill a folder with the rigs, videos, takes and models that the documentation names.

    films: whether commands on videos can run; else there is only the golden take of the demo, with its exports.
    """
    if films:
        stored_files(place, _make_films, "documented", sources=[__name__, *TRACKING])
        walker_film(place / "tuesday")
    else:
        shutil.copy(GOLDEN / "live.mcap", place / "walk.mcap")
        (place / "walk").mkdir()
        for name in EXPORTS:
            open_take(place / "walk.mcap").export(place / name)
    shutil.copytree(ROOT / "deploy", place / "deploy", ignore=shutil.ignore_patterns("certs"))
    shutil.copy(CALIBRATION, place / "calibration.toml")
    rig = demo_rig_file().read_text(encoding="utf-8").replace(CALIBRATION.name, str(CALIBRATION))
    for name in ("studio", "lab", "machines", "rig"):
        secured = '\n[security]\ncertificates = "certs"\n' if name == "machines" else ""
        (place / f"{name}.toml").write_text(rig.replace('name = "demo"', f'name = "{name}"') + secured, encoding="utf-8")
    (place / "points.toml").write_text(SCENE_EXAMPLE, encoding="utf-8")
    (place / "lens.yaml").write_text(ros_info_text(Lens.of(paper_cameras((640, 480))[0])), encoding="utf-8")
    shutil.copy(POSTURES / "fifteen.postures", place / "mine.postures")
    write_model(place / "Rajagopal2016.osim")
    shutil.copy(PRIORS / "walking.prior", place / "walk.prior")
    (place / "recordings").mkdir()
    for copy in COPIES:
        shutil.copy(place / "walk.mcap", place / copy)


def _make_films(place: Path) -> None:
    """Films, and a take of one with its exports."""
    film(place / "walk")
    # Pictures instead of videos, of a board of another size than the documented one: only the scale differs.
    films = board_pictures(place / "films", 63)
    write_calibration(place / "lenses.toml", {camera.name: camera for camera in films})
    board_pictures(place / "grid-films", 30, checked_board("aprilgrid", 6, 6, 150.0))
    status, output = zenocap(["track", "walk", "-o", "walk.mcap"], place)
    assert status in (0, 3), output
    for export in EXPORTS:
        status, output = zenocap(["export", "walk.mcap", "--to", Path(export).suffix[1:], "-o", export], place)
        assert status == 0, output


def zenocap(arguments: Sequence[str], folder: Path, *, live: bool = False) -> tuple[int, str]:
    """Status and output of a command.  live: terminated RUN_S after its first output, or after it can end in order."""
    environment = ENVIRONMENT | {"COLUMNS": "200", "PYTHONUNBUFFERED": "1", "XDG_DATA_HOME": str(folder / "data-home")}
    command = [*ZENOCAP, *arguments]
    with (
        tempfile.TemporaryFile("w+") as out,
        subprocess.Popen(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=out) as process,
    ):
        try:
            if live:
                wait_until(lambda: os.fstat(out.fileno()).st_size > 0 or _ends_in_order(process), folder, END_S)
                with suppress(subprocess.TimeoutExpired):
                    process.wait(RUN_S)
                process.terminate()
            process.wait(END_S)
        finally:
            process.kill()
        out.seek(0)
        return process.returncode, out.read()


def _ends_in_order(process: subprocess.Popen[bytes]) -> bool:
    """Whether a process handles SIGTERM, or has ended."""
    if process.poll() is not None:
        return True
    (caught,) = re.findall(r"SigCgt:\s*(\w+)", Path(f"/proc/{process.pid}/status").read_text())
    return bool(int(caught, 16) >> (signal.SIGTERM - 1) & 1)
