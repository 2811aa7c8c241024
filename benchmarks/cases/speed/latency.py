"""End-to-end latency over loopback: from the later capture to the pose; lost frames.

Two viewers play rendered videos at the frame rate of cameras, beside the integrator and, with method hybrid, the tracker,
one process each; this process subscribes.  Pose: the universal BAP, or that of the tracker.  Frames count from the first
pose on; a frame without a pose of both viewers is lost.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from benchmarks.cases.speed.busy import busy_processes
from benchmarks.harness.case import Case, Column, Figures, Kind, case
from benchmarks.people.films import size_of
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.messages import CameraInfo, TrackerPose, UniversalBap
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import CAMERA, TRACKER_POSE, UNIVERSAL_BAP
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.launcher.peer_mesh import free_ports, peer_mesh

EMPTY = 30  # frames of empty scene
VIEWERS = 2
START_S = 120.0  # limit of the time until all processes have started and loaded their kernels


def run(one: Case) -> Figures:
    """One run.  Options: method, rate (frames/s), size, seconds, busy (processes that never wait)."""
    method, fps, seconds = one.option("method", "two-view"), one.option("rate", 15.0), one.option("seconds", 20.0)
    subprocess.run([sys.executable, "-m", "zenocap", "warmup"], check=True, stdout=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder, busy_processes(one.option("busy", 0)):
        rig, frames = film(Path(folder), seconds, fps, size_of(one.option("size", "160x120")), method)
        return measured(rig, frames, seconds, fps, method)


def film(folder: Path, seconds: float, fps: float, size: tuple[int, int], method: str) -> tuple[Path, int]:
    """Write a rig of two rendered videos to `folder`; return its file and the number of frames."""
    subject = person(0)
    script = demo_timeline(subject, 0)
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(size), strict=True))
    first_s = script.segments[0].end_s - EMPTY / fps
    frames = int(seconds * fps)
    viewers = ""
    for number, (name, camera) in enumerate(cameras.items(), start=1):
        renderer = SimulatedCamera(camera, subject, 0)
        video = cv2.VideoWriter(str(folder / f"{name}.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
        for k in range(frames):
            video.write(renderer.render(script.pose_at(first_s + k / fps), k))
        video.release()
        viewers += (
            f'[[viewer]]\nid = "{number}"\ncamera = "{name}"\nsource = "{name}.mp4"\nbackground = "first:{EMPTY - 1}"\n'
            f"size = [{size[0]}, {size[1]}]\nfps = {fps}\n"
        )
    write_calibration(folder / "calibration.toml", {name: cam for name, cam in zip(cameras, cameras.values(), strict=True)})
    rig = folder / "rig.toml"
    rig.write_text(f'name = "latency"\ncalibration = "calibration.toml"\nmethod = "{method}"\n{viewers}', encoding="utf-8")
    return rig, frames


def measured(rig: Path, frames: int, seconds: float, fps: float, method: str) -> dict[str, float]:
    """Latency (ms), lost and expected frames."""
    clock = RealClock()
    services = [["integrator", "--no-log"], *([["tracker"]] if method == "hybrid" else [])]
    viewers = [["viewer", "--id", "1"], ["viewer", "--id", "2"]]
    places = peer_mesh(free_ports(len(services) + len(viewers) + 1))
    processes: list[subprocess.Popen[bytes]] = []

    def start(name: str, *arguments: str) -> None:
        place = places[len(processes)]
        zenoh = ["--listen", place.listen, "--no-multicast-scouting"]
        for endpoint in place.connect:
            zenoh += ["--connect", endpoint]
        command = [sys.executable, "-m", "zenocap", name, str(rig), *arguments, *zenoh]
        processes.append(subprocess.Popen(command, stdout=subprocess.DEVNULL))

    options = ZenohOptions(listen=(places[-1].listen,), connect=places[-1].connect, multicast_scouting=False)
    delays: dict[int, float] = {}
    first = None
    try:
        with ZenohBus.open(options, "latency", clock) as bus:
            bus.subscribe(TRACKER_POSE if method == "hybrid" else UNIVERSAL_BAP, every=True)
            bus.subscribe(CAMERA)
            bus.watch_alive()
            for command in services:
                start(*command)
            started, end_ns = {command[0] for command in services}, clock.now_ns() + START_S * 1e9
            while started and clock.now_ns() < end_ns:
                match bus.receive(0.1):
                    case Alive(service=service, alive=True):
                        started.discard(service)
            if started:
                raise RuntimeError(f"not on the network {START_S:g} s after their start: {', '.join(sorted(started))}")
            for command in viewers:  # they agree on the time of their first frame
                start(*command)
            while clock.now_ns() < end_ns:
                event = bus.receive(0.1)
                if isinstance(event, Envelope) and isinstance(event.message, CameraInfo):
                    end_ns = event.message.captured_ns + (seconds + 1) * 1e9
                if isinstance(event, Envelope) and isinstance(event.message, UniversalBap | TrackerPose):
                    message = event.message
                    if first is None:
                        first = message.frame  # the first pose waits for several frames, so its latency does not count
                    elif of_both_viewers(message):
                        delays[message.frame] = (event.received_ns - message.captured_ns) / 1e6
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(10)
    if first is None:
        raise RuntimeError(f"no pose at {fps:g} frames/s")
    values = np.array(list(delays.values()))
    due = frames - 1 - first
    return {
        "p50": float(np.percentile(values, 50)),
        "p99": float(np.percentile(values, 99)),
        "worst": float(values.max()),
        "lost": due - values.size,
        "due": due,
    }


def of_both_viewers(pose: UniversalBap | TrackerPose) -> bool:
    return len(pose.views) == VIEWERS if isinstance(pose, TrackerPose) else not pose.stale


LATENCY = Kind(
    "latency",
    "From the later of two captures to the pose in another process, a process for each service, loopback, 160×120 unless "
    "stated; the last frame is lost because the end of the run cuts it off.",
    run,
    (
        *(Column(name, "ms", 1, joined="median") for name in ("p50", "p99", "worst")),
        *(Column(name, "frames", 0, joined="sum") for name in ("lost", "due")),
    ),
    {
        f"{method}, {rate:g} frames/s": case("demo", method=method, rate=rate)
        for method in ("two-view", "hybrid")
        for rate in (15.0, 30.0, 60.0)
    }
    | {
        f"hybrid, 640×480, 30 frames/s{', beside 2 busy processes' if busy else ''}": case(
            "demo", method="hybrid", rate=30.0, size="640x480", busy=busy
        )
        for busy in (0, 2)
    },
    case("demo", seconds=12.0),
    rows="method, rate",
    timed=True,
)
