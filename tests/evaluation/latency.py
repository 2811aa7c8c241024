"""End to end over loopback with three real processes: from the later capture to the universal BAP, and frames lost.

    python -m tests.evaluation.latency [--seconds N] [--rates 15 30 60] [--size 160x120]

Two viewers play rendered videos at their pace, as cameras would give them; this process reads along.  A frame counts from
the first universal BAP on, and as lost when no universal BAP of both viewers comes for it.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from common.actor.person import person
from common.actor.render import ActorCamera
from common.actor.script import demo_script
from common.bus.protocol import Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.camera.files import write_calibration
from common.messages import UniversalBap
from common.runtime.clock import RealClock
from common.topics import UNIVERSAL_BAP
from services.launcher.mesh import free_ports, mesh
from tests.actor_cameras import paper_cameras
from tests.evaluation.table import table

EMPTY = 30  # frames of empty scene


def main(seconds: float, rates: list[float], size: tuple[int, int]) -> None:
    rows = []
    for fps in rates:
        with tempfile.TemporaryDirectory() as folder:
            rig, frames = film(Path(folder), seconds, fps, size)
            rows.append([f"{fps:g}", *measured(rig, frames, seconds, fps)])
    print(
        table(
            "End to end over loopback, three processes",
            ["frames/s", "poses", "p50 ms", "p99 ms", "worst ms", "lost", "of"],
            rows,
        )
    )


def film(folder: Path, seconds: float, fps: float, size: tuple[int, int]) -> tuple[Path, int]:
    """A rig of two rendered videos in `folder`, and how many frames each has."""
    somebody = person(0)
    script = demo_script(somebody, 0)
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(size), strict=True))
    first_s = script.segments[0].end_s - EMPTY / fps
    frames = int(seconds * fps)
    viewers = ""
    for number, (name, camera) in enumerate(cameras.items(), start=1):
        filming = ActorCamera(camera, somebody, 0)
        video = cv2.VideoWriter(str(folder / f"{name}.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
        for k in range(frames):
            video.write(filming.render(script.pose_at(first_s + k / fps), k))
        video.release()
        viewers += (
            f'[[viewer]]\nid = "{number}"\ncamera = "{name}"\nsource = "{name}.mp4"\nbackground = "first:{EMPTY - 1}"\n'
            f"size = [{size[0]}, {size[1]}]\nfps = {fps}\n"
        )
    write_calibration(folder / "calibration.toml", {name: cam for name, cam in zip(cameras, cameras.values(), strict=True)})
    rig = folder / "rig.toml"
    rig.write_text(f'name = "latency"\ncalibration = "calibration.toml"\n{viewers}', encoding="utf-8")
    return rig, frames


def measured(rig: Path, frames: int, seconds: float, fps: float) -> list[str]:
    """poses, p50, p99, worst in ms, lost, and of how many frames."""
    clock = RealClock()
    places = mesh(free_ports(4))
    services = (["integrator"], ["viewer", "--id", "1"], ["viewer", "--id", "2"])
    epoch_ns = clock.now_ns() + 8_000_000_000  # by then every process is ready
    processes = []
    for (name, *arguments), place in zip(services, places, strict=False):
        zenoh = ["--listen", place.listen, "--no-multicast-scouting"]
        for endpoint in place.connect:
            zenoh += ["--connect", endpoint]
        epoch = ["--epoch-ns", str(epoch_ns)] if name == "viewer" else ["--no-log"]
        command = [sys.executable, "-m", "services.cli", name, str(rig), *arguments, *epoch, *zenoh]
        processes.append(subprocess.Popen(command, stdout=subprocess.DEVNULL))
    own = ZenohOptions(listen=(places[3].listen,), connect=places[3].connect, multicast_scouting=False)
    delays: dict[int, float] = {}
    first = None
    try:
        with ZenohBus.open(own, "latency", clock) as bus:
            bus.subscribe(UNIVERSAL_BAP, every=True)
            while clock.now_ns() < epoch_ns + (seconds + 1) * 1e9:
                event = bus.receive(0.1)
                if isinstance(event, Envelope) and isinstance(event.message, UniversalBap):
                    message = event.message
                    if first is None:
                        first = message.frame  # made from several frames at once: its own delay is not one frame's
                    elif not message.stale:
                        delays[message.frame] = (event.received_ns - message.captured_ns) / 1e6
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(10)
    if first is None:
        raise RuntimeError(f"no universal BAP at {fps:g} frames/s")
    values = np.array(list(delays.values()))
    due = frames - 1 - first
    return [
        str(values.size), f"{np.percentile(values, 50):.1f}", f"{np.percentile(values, 99):.1f}", f"{values.max():.1f}",
        str(due - values.size), str(due),
    ]  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rates", type=float, nargs="+", default=[15.0, 30.0, 60.0])
    parser.add_argument("--size", default="160x120", metavar="WxH")
    options = parser.parse_args()
    width, height = (int(n) for n in options.size.split("x"))
    main(options.seconds, options.rates, (width, height))
