"""Films of two machines, processes here, by one command: how far apart they begin, and the rate of copying.

Each machine has a network camera that draws the time into its images.
"""

import re
import subprocess
import tempfile
import time
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from benchmarks.harness.case import Case, Column, Figures, Kind, case
from benchmarks.people.films import size_of
from tests.support.mjpeg_server import BITS, MjpegServer, time_in
from tests.support.processes import ZENOCAP
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.video.reader import VideoReader
from zenocap.tools.launcher.peer_mesh import free_ports

NAMES = ("cam01", "cam02")


@contextmanager
def machine(folder: Path, *arguments: str) -> Iterator[None]:
    """A machine that announces its camera."""
    folder.mkdir()
    with (folder / "log").open("w") as log:
        process = subprocess.Popen([*ZENOCAP, "viewer", "--discover", "--allow-fetch", *arguments], cwd=folder, stderr=log)
        try:
            while "announces" not in (folder / "log").read_text():
                time.sleep(0.1)
            yield
        finally:
            process.terminate()
            process.wait()


def first_ms(video: Path) -> int:
    """Time drawn in the first image, ms."""
    with VideoReader(video) as reader:
        frame = reader.next()
        assert frame is not None
        return time_in(np.asarray(frame.image()))


def figures(folder: Path, text: str) -> tuple[float, float, list[float]]:
    """Begin of the second video after the first one's, ms; error of sync.toml, ms; rates of copying, MB/s."""
    first, second = (first_ms(folder / "videos" / f"{name}.mkv") for name in NAMES)
    half = 1 << (BITS - 1)
    apart_ms = (second - first + half) % (1 << BITS) - half
    sync = tomllib.loads((folder / "sync.toml").read_text())["offset_s"]
    error_ms = (sync[NAMES[1]] - sync[NAMES[0]]) * 1e3 - apart_ms
    return apart_ms, error_ms, [float(rate) for rate in re.findall(r" at (\d+) MB/s", text)]


def run(one: Case) -> Figures:
    """One film.  Options: size, fps, seconds."""
    size, fps, seconds = size_of(one.option("size", "640x480")), one.option("fps", 30.0), one.option("seconds", 6.0)
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        base, (port,) = Path(place), free_ports(1)
        write_calibration(base / "calibration.toml", dict(zip(NAMES, paper_cameras(size), strict=True)))
        rig = 'name = "film"\ncalibration = "calibration.toml"\n'
        for k, name in enumerate(NAMES):
            server = stack.enter_context(MjpegServer(size, fps))
            rig += f'[[viewer]]\nid = "{k}"\ncamera = "{name}"\nsource = "{server.url}"\nfps = {fps}\n'
            network = ("-l" if k == 0 else "-e", f"tcp/127.0.0.1:{port}", "--no-multicast-scouting")
            camera = ("--machine", f"lab{k}", "--camera", f"{name}={server.url}")
            stack.enter_context(machine(base / f"lab{k}", *camera, *network))
        (base / "rig.toml").write_text(rig)
        command = ("film", "rig.toml", "-o", "film", "--seconds", f"{seconds}", "--fetch")
        words = (*command, "-e", f"tcp/127.0.0.1:{port}", "--no-multicast-scouting")
        done = subprocess.run([*ZENOCAP, *words], cwd=base, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stdout + done.stderr)
        apart_ms, error_ms, rates = figures(base / "film", done.stdout)
    return {"apart": abs(apart_ms), "error": abs(error_ms), "copied": min(rates)}


FILM = Kind(
    "film",
    "Films of two machines, processes on one computer, by one command; cameras over HTTP that draw the time into their "
    "images. Apart: from the first image of one video to that of the other; error: of the offset in sync.toml.",
    run,
    (Column("apart", "ms", 0), Column("error", "ms", 1), Column("copied", "MB/s", 0, "low")),
    {"1280×720, 15 frames/s": case("film", size="1280x720", fps=15.0), "640×480, 30 frames/s": case("film")},
    case("film", size="320x240", seconds=1.0),
    rows="size, rate",
    timed=True,
)
