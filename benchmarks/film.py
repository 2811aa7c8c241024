"""Films of two machines, processes here, by one command: how far apart they begin, and the rate of copying.

    python -m benchmarks.film [--films N] [--seconds S] [--fps F] [--size WxH]

Each machine has a network camera that draws the time into its images.  Begin: from the first image of one video to that of
the other, by the drawn times; two free cameras are up to a period apart.  Error: of the offset in sync.toml against the
drawn one.  Copying: over TCP on this machine, checksums included.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--films", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--fps", type=float, default=30.0)
    parser.add_argument("--size", default="640x480")
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        base, (port,) = Path(place), free_ports(1)
        write_calibration(base / "calibration.toml", dict(zip(NAMES, paper_cameras((width, height)), strict=True)))
        rig = 'name = "film"\ncalibration = "calibration.toml"\n'
        for k, name in enumerate(NAMES):
            server = stack.enter_context(MjpegServer((width, height), options.fps))
            rig += f'[[viewer]]\nid = "{k}"\ncamera = "{name}"\nsource = "{server.url}"\nfps = {options.fps}\n'
            network = ("-l" if k == 0 else "-e", f"tcp/127.0.0.1:{port}", "--no-multicast-scouting")
            stack.enter_context(
                machine(base / f"lab{k}", "--machine", f"lab{k}", "--camera", f"{name}={server.url}", *network)
            )
        (base / "rig.toml").write_text(rig)
        for number in range(options.films):
            command = ("film", "rig.toml", "-o", f"{number}", "--seconds", f"{options.seconds}", "--fetch")
            done = subprocess.run(
                [*ZENOCAP, *command, "-e", f"tcp/127.0.0.1:{port}", "--no-multicast-scouting"],
                cwd=base,
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode:
                sys.exit(done.stdout + done.stderr)
            apart_ms, error_ms, rates = figures(base / f"{number}", done.stdout)
            (clocks,) = re.findall(r"clocks against this one: (.*)", done.stdout)
            print(
                f"film {number}: begin {apart_ms:+.0f} ms apart (period {1e3 / options.fps:.0f} ms), "
                f"sync.toml off by {error_ms:+.1f} ms, copied at {min(rates):.0f} MB/s; {clocks}",
                flush=True,
            )


if __name__ == "__main__":
    main()
