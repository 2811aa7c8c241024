"""`kill -9` of an integrator at random times: readability of the take, seconds lost, messages restored by `recover`.

    python -m benchmarks.kills [--count N] [--seed N] [--fps N] [--within S]

Each time a new integrator process is started; this process publishes the messages of the two viewers of the tracked demo.
Seconds lost: from the last message in the file to the kill, both by this machine's clock.
"""

import argparse
import random
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.mixture import instants, mixture, with_viewers
from benchmarks.table import Cell, table
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import Take
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.runtime.clock import RealClock
from zenocap.tools.launcher.peer_mesh import free_ports, peer_mesh
from zenocap.tools.recordings.recover import recover

VIEWER_MESSAGES = (m.Sighting, m.PartialBap, m.Silhouette, m.Preview)
PATIENCE_S = 60.0


class Feeder(threading.Thread):
    """Publishes the messages of two viewers at a frame rate until `stop`."""

    def __init__(self, endpoint: str, messages: list[Envelope], fps: float) -> None:
        super().__init__(daemon=True)
        self._options = ZenohOptions(listen=(endpoint,), multicast_scouting=False)
        self._messages, self._fps = messages, fps
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
                time.sleep(max(0.0, start_s + frame / self._fps - time.monotonic()))


@dataclass(frozen=True)
class KillResult:
    """after_s: from the beginning of the file to the kill.  lost_s: time before the kill that is missing in the file.

    problem: reason why the take cannot be read or recovered.  recovered: number of recovered messages.
    """

    after_s: float
    messages: int
    recovered: int
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
    read = Take(take)
    try:
        messages = list(read.messages())
        found = recover(take, output)
        recovered_take = Take(output)
        equal = (
            list(recovered_take.messages()) == messages
            and recovered_take.cut is None
            and recovered_take.attachments == read.attachments
        )
    except UserError as error:
        return KillResult(after_s, 0, 0, after_s, str(error))
    last_ns = max([start_ns, *(each.log_ns for each in messages)])
    problem = (
        None if equal and found.lost and read.cut else "recovered messages differ from those read, or no loss is reported"
    )
    return KillResult(after_s, len(messages), found.messages, (killed_ns - last_ns) / 1e9, problem)


def main(count: int, seed: int, fps: float, within_s: float) -> int:
    rng = random.Random(seed)
    (place,) = peer_mesh(free_ports(1))
    feeder = Feeder(place.listen, mixture(), fps)
    feeder.start()
    with tempfile.TemporaryDirectory() as folder:
        results = [
            kill_integrator(place.listen, Path(folder) / f"{n}.mcap", rng.uniform(0, within_s)) for n in range(count)
        ]
    feeder.stop.set()
    feeder.join()
    lost = sorted(result.lost_s for result in results)
    rows: list[list[Cell]] = [
        ["kills", count],
        ["readable and recovered", sum(result.problem is None for result in results)],
        ["with messages", sum(result.messages > 0 for result in results)],
        ["messages in the takes", sum(result.messages for result in results)],
        ["messages recovered", sum(result.recovered for result in results)],
        ["seconds lost, median", lost[len(lost) // 2]],
        ["seconds lost, most", lost[-1]],
    ]
    title = f"kill -9 of an integrator within {within_s:g} s, two viewers at {fps:g} frames/s, seed {seed}"
    print(table(title, ["", "result"], rows))
    for result in results:
        if result.problem:
            print(f"fault: killed after {result.after_s:.3f} s: {result.problem}")
    return 1 if any(result.problem for result in results) else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fps", type=float, default=60.0)
    parser.add_argument("--within", type=float, default=5.0, metavar="S")
    options = parser.parse_args()
    sys.exit(main(options.count, options.seed, options.fps, options.within))
