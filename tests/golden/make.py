"""Write golden takes again after an intended change of results: python -m tests.golden.make [NAME ...]

Each NAME.mcap has a NAME.txt beside it with its content as text: read the difference of the text before committing.  The
results of the readers of takes are in texts/.
Tracked offline, a simulated person who raises both arms:
arms: in two views, by the two-view method.  both: in the same views, by that and the tracker at once.
ring: in four views, by the hybrid method with a prior, both ways, with the recognizer.  paper: the same views, as [Hybrid]
has it.  force: the same views, by the image force alone.
Live, with the actual order and gaps of their messages:
live: 20 s of the demo, three processes.  follow: three streams of a person who walks, one of them late; the tracker follows
its delay, and another viewer is started again.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from math import degrees
from pathlib import Path

import cv2
import numpy as np

from tests.golden.texts import TEXTS
from tests.support.mjpeg_server import MjpegServer
from tests.support.processes import ended, output_of, started, wait_until
from tests.support.recognizer_cases import actor_model
from tests.support.walkers import walker
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.file import LogTable
from zenocap.common.rig.recognizer import RecognizerSpec
from zenocap.common.rig.rig import demo_rig, demo_rig_file, load_rig
from zenocap.common.rig.sources import Actor
from zenocap.common.rig.tracker import TrackerOverrides
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import CAMERA_DELAYS, TRACKER_POSE
from zenocap.services.recognizer.model_file import write_model
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.takes.both_ways import track_both_ways
from zenocap.tools.takes.rig_changes import with_tracker
from zenocap.tools.takes.track import track

HERE = Path(__file__).parent
RING = HERE / "ring.toml"
SHOWN = (
    "navel.y", "left_shoulder.z", "left_shoulder.x", "left_elbow.x", "right_shoulder.z", "right_shoulder.x",
    "right_elbow.x", "left_hip.x", "left_knee.x", "right_hip.x", "right_knee.x",
)  # fmt: skip
FPS, SIZE, LATE_FRAMES = 8, (144, 108), 2  # of the streams of `follow`


def readable(path: Path) -> str:
    """The content of a take as text: number of messages of each kind, the body, every pose, posture and delay."""
    counts: dict[str, int] = {}
    lines: list[str] = []
    for received in TakeReader(path).envelopes(invalid="raise"):
        kind = type(received.message).__name__
        counts[kind] = counts.get(kind, 0) + 1
        lines += _lines(received.message)
    head = [f"{count:5d} {kind}" for kind, count in sorted(counts.items())]
    columns = "frame, navel (x y z, m), degrees of " + ", ".join(SHOWN) + ", views"
    return "\n".join([*head, "", columns, *lines, ""])


def _lines(message: m.Message) -> Sequence[str]:
    match message:
        case m.UniversalBdp(body=body) | m.TrackerBdp(body=body):
            sizes = ", ".join(f"{part} {size[0] * 1000:.0f}" for part, size in body.sizes.items())
            return [f"body, heights in mm: {sizes}"]
        case m.UniversalBap() as bap:
            views = " ".join(f"{viewer}:{view}" for viewer, view in sorted(bap.views.items()))
            return [f"{_pose(bap)}  {views}{' stale ' + ' '.join(bap.stale) if bap.stale else ''}"]
        case m.TrackerPose() as pose:
            ways = "both ways " if isinstance(pose, m.BothWaysPose) else ""
            return [f"{_pose(pose)}  {ways}{' '.join(sorted(pose.views))}{' lost' if pose.lost else ''}"]
        case m.Posture() as posture:
            return [f"posture {posture.label}, {(posture.end_ns - posture.start_ns) / 1e9:.2f} s"]
        case m.CameraDelays() as delays:
            found = " ".join(f"{viewer}:{ms:.1f}" for viewer, ms in sorted(delays.found_ms.items()))
            applied = " ".join(f"{viewer}:{ms:.1f}" for viewer, ms in sorted(delays.applied_ms.items()))
            return [f"delays, ms: found {found}, applied {applied}"]
        case m.Verdict(rating=rating, error=error):
            return [f"verdict: {rating}" + ("" if error is None else f", {error * 1000:.0f} mm")]
        case _:
            return []


def _pose(message: m.UniversalBap | m.TrackerPose) -> str:
    place = " ".join(f"{value:6.3f}" for value in message.position)
    angles = " ".join(f"{degrees(message.angles[name]):6.1f}" if name in message.angles else "     -" for name in SHOWN)
    return f"{message.frame:4d}  {place}  {angles}"


def make_arms(path: Path) -> None:
    rig = demo_rig("two-view")
    source = Actor("raise-both-arms", 3)
    viewers = tuple(replace(viewer, source=source, preview=False) for viewer in rig.viewers)
    track(replace(rig, viewers=viewers, log=LogTable(foxglove=False)), path)


def make_both(path: Path) -> None:
    rig = demo_rig("both")
    viewers = tuple(
        replace(one, source=Actor("raise-both-arms", 3), preview=False, camera=one.camera.resized((160, 120)))
        for one in rig.viewers
    )
    track(replace(rig, viewers=viewers, log=LogTable(foxglove=False), recognizer=None), path)


def make_ring(path: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        model = Path(name) / "actor.postures"
        write_model(model, actor_model())
        track_both_ways(replace(load_rig(RING), recognizer=RecognizerSpec(model, "tracker")), path)


def make_paper(path: Path) -> None:
    # Its forces take seconds a frame with all of its particles.
    preset = TrackerOverrides(preset="paper", prior="general-paper", particles=4)
    track(with_tracker(load_rig(RING), preset), path)


def make_force(path: Path) -> None:
    track(load_rig(RING, "image-force"), path)


def make_live(path: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file in demo_rig("two-view").files:
            text = file.read_text().replace("preview = true", "preview = false")
            (folder / file.name).write_text(text)
        rig = folder / demo_rig_file("two-view").name
        rig.write_text(rig.read_text() + "\n[log]\nfoxglove = false\n")
        command = [sys.executable, "-m", "zenocap", "up", str(rig), "--seconds", "20", "--recordings", name]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        (take,) = folder.glob("*.mcap")
        path.write_bytes(take.read_bytes())


def make_follow(path: Path) -> None:
    (port,) = free_ports(1)
    endpoint = f"tcp/127.0.0.1:{port}"
    network = ["-m", "client", "-e", endpoint, "--no-multicast-scouting"]
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        rig = walking_rig(folder, stack)

        def start(*command: object) -> subprocess.Popen[str]:
            return stack.enter_context(started([*command, *network], folder))

        stack.enter_context(started(["router", "-l", endpoint, "--no-multicast-scouting"], folder))
        with ZenohBus.open(ZenohOptions("client", (endpoint,), multicast_scouting=False), "follow", RealClock()) as bus:
            bus.subscribe(CAMERA_DELAYS)
            bus.subscribe(TRACKER_POSE)
            integrator = start("integrator", rig, "-o", folder / path.name)
            others = [start("tracker", rig), *(start("viewer", rig, "--id", number) for number in "123")]

            def corrected() -> bool:
                match bus.receive(0.2):
                    case Envelope(message=m.CameraDelays(applied_ms=applied)):
                        return applied.get("2", 0.0) > 0.6 * LATE_FRAMES * 1e3 / FPS
                    case _:
                        return False

            wait_until(corrected, folder, 300.0)
            ended(others.pop())
            others.append(start("viewer", rig, "--id", "3"))
            again = time.time_ns()

            def whole() -> bool:
                match bus.receive(0.2):
                    case Envelope(message=m.TrackerPose(views=views, captured_ns=captured_ns)):
                        return len(views) == 3 and captured_ns > again + 2_000_000_000
                    case _:
                        return False

            wait_until(whole, folder, 60.0)
            for process in (*others, integrator):
                if ended(process):
                    raise SystemExit(output_of(folder))
        path.write_bytes((folder / path.name).read_bytes())


def walking_rig(folder: Path, stack: ExitStack) -> Path:
    """Rig of three streams that show a person who walks to and fro, the second one two frames late."""
    one = walker(20, 3, SIZE, 24)
    write_calibration(folder / "calibration.toml", dict(one.cameras))
    head = 'name = "follow"\ncalibration = "calibration.toml"\nmethod = "hybrid"\ndelays = "follow"\n'
    tables = [f"{head}\n[tracker]\npoints = 60\nparticles = 10\n\n[log]\nfoxglove = false\n"]
    for number, name in enumerate(one.cameras, 1):
        filming = SimulatedCamera(one.cameras[name], one.person, 1)
        cv2.imwrite(str(folder / f"{name}.png"), filming.background())
        there = [filming.render(one.motion.pose_at(k / FPS), k) for k in range(int(one.motion.duration_s * FPS))]
        late_s = LATE_FRAMES / FPS if number == 2 else 0.0
        server = MjpegServer(SIZE, FPS, picture=partial(picture_now, there + there[::-1], late_s))
        stack.enter_context(server)
        tables.append(
            f'[[viewer]]\nid = "{number}"\ncamera = "{name}"\nsource = "{server.url}"\nbackground = "image:{name}.png"\n'
            f"size = [{SIZE[0]}, {SIZE[1]}]\nfps = {FPS}\npreview = false\n"
        )
    path = folder / "follow.toml"
    path.write_text("\n".join(tables))
    return path


def picture_now(pictures: Sequence[np.ndarray], late_s: float) -> np.ndarray:
    """What a camera sends now that shows what was there `late_s` ago."""
    return pictures[int((time.time() - late_s) * FPS) % len(pictures)]


OFFLINE: Mapping[str, Callable[[Path], None]] = {
    "arms": make_arms, "both": make_both, "ring": make_ring, "paper": make_paper, "force": make_force
}  # fmt: skip
LIVE: Mapping[str, Callable[[Path], None]] = {"live": make_live, "follow": make_follow}
TAKES = OFFLINE | LIVE


def main(names: Sequence[str]) -> None:
    for name in names or TAKES:
        path = HERE / f"{name}.mcap"
        TAKES[name](path)
        (HERE / f"{name}.txt").write_text(readable(path))
        for reader, text in TEXTS.items():
            (HERE / "texts" / f"{name}-{reader}.txt").write_text(text(path))


if __name__ == "__main__":
    main(sys.argv[1:])
