"""`kill -9` of an integrator: readability of the take, seconds lost, messages restored.

Each time a new integrator process is started; this process publishes the messages of the two viewers of the tracked demo.
Seconds lost: from the last message in the file to the kill, both by this machine's clock.
"""

import random
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.cases.takes.mixture import instants, mixture, with_viewers
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.runtime.clock import RealClock
from zenocap.tools.record.launcher.peer_mesh import peer_mesh
from zenocap.tools.takes.recover import recover

VIEWER_MESSAGES = (m.Sighting, m.PartialBap, m.Silhouette, m.Preview)
PATIENCE_S, FPS = 60.0, 60.0


class Feeder(threading.Thread):
    """Publishes the messages of two viewers at FPS until `stop`."""

    def __init__(self, endpoint: str, messages: list[Envelope]) -> None:
        super().__init__(daemon=True)
        self._options, self._messages = ZenohOptions(listen=(endpoint,), multicast_scouting=False), messages
        self.stop = threading.Event()

    def run(self) -> None:
        clock = RealClock()
        groups = instants(self._messages)
        with ZenohBus.open(self._options, "demo", clock) as bus:
            for each in self._messages:
                if isinstance(each.message, m.CameraInfo | m.PartialBdp):
                    bus.publish(each.topic, each.message)
            start_s, frame = time.monotonic(), 0
            while not self.stop.is_set():
                for each in with_viewers(groups[frame % len(groups)], 2, frame, clock.now_ns()):
                    if isinstance(each.message, VIEWER_MESSAGES):
                        bus.publish(each.topic, each.message)
                frame += 1
                time.sleep(max(0.0, start_s + frame / FPS - time.monotonic()))


@dataclass(frozen=True)
class KillResult:
    """messages: that the file has.  lost_s: time before the kill that is missing in it.

    problem: reason why the take cannot be read or recovered.
    """

    messages: int
    lost_s: float
    problem: str | None


def kill_integrator(endpoint: str, take: Path, after_s: float) -> KillResult:
    """Start an integrator, kill it `after_s` seconds after its take appears, and examine the take."""
    arguments = ["integrator", str(demo_rig_file("two-view")), "-o", str(take), "-e", endpoint, "--no-multicast-scouting"]
    process = subprocess.Popen([sys.executable, "-m", "zenocap", *arguments], stderr=subprocess.PIPE, text=True)
    try:
        end_s = time.monotonic() + PATIENCE_S
        while not take.exists():
            if process.poll() is not None or time.monotonic() > end_s:
                process.kill()
                raise RuntimeError(f"the integrator did not start: {process.communicate()[1]}")
            time.sleep(0.001)
        start_ns = time.time_ns()
        time.sleep(after_s)
    finally:
        process.kill()
        killed_ns = time.time_ns()
        process.communicate()
    output = take.with_name(f"{take.stem}-recovered.mcap")
    read = TakeReader(take)
    try:
        messages = list(read.messages())
        found = recover(take, output)
        recovered_take = TakeReader(output)
        equal = (
            list(recovered_take.messages()) == messages
            and recovered_take.cut is None
            and recovered_take.attachments == read.attachments
        )
    except UserError as error:
        return KillResult(0, after_s, str(error))
    last_ns = max([start_ns, *(each.log_ns for each in messages)])
    problem = (
        None if equal and found.lost and read.cut else "recovered messages differ from those read, or no loss is reported"
    )
    return KillResult(len(messages), (killed_ns - last_ns) / 1e9, problem)


def run(one: Case) -> Figures:
    """Kills of one seed.  Options: count, within (s)."""
    rng = random.Random(one.seed)
    (place,) = peer_mesh(free_ports(1))
    feeder = Feeder(place.listen, mixture())
    feeder.start()
    with tempfile.TemporaryDirectory() as folder:
        found = [
            kill_integrator(place.listen, Path(folder) / f"{n}.mcap", rng.uniform(0, one.option("within", 5.0)))
            for n in range(one.option("count", 100))
        ]
    feeder.stop.set()
    feeder.join()
    return {
        "kills": len(found),
        "readable": sum(each.problem is None for each in found),
        "with messages": sum(each.messages > 0 for each in found),
        "lost": median(each.lost_s for each in found),
        "most lost": max(each.lost_s for each in found),
    }


KILLS = Kind(
    "kills",
    "`kill -9` of the integrator at 100 random moments of its first 5 s, two viewers at 60 frames/s: takes that are read "
    "and recovered, and the time before the kill that is missing.",
    run,
    (
        *(Quantity(name, "", 0, joined="sum") for name in ("kills", "readable", "with messages")),
        Quantity("lost", "s", 1),
        Quantity("most lost", "s", 2),
    ),
    {"integrator": case("integrator")},
    case("integrator", count=2, within=2.0),
    rows="process",
    timed=True,
)
