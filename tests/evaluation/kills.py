"""`kill -9` of a real integrator at random moments: is the take readable, how many seconds are lost, what `recover` makes.

    python -m tests.evaluation.kills [--count N] [--seed N] [--fps N] [--within S]

The integrator is a process of its own, started anew each time; this one says to it over Zenoh what two viewers said when
the demo was tracked.  Seconds lost: from the last message in the file to the kill, both on this machine's clock.
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

from common import messages as m
from common.bus.protocol import Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime.clock import RealClock
from common.runtime.rig import demo_rig_file
from common.take.reading import Take, TakeError
from common.take.recording import RecordingError
from services.launcher.mesh import free_ports, mesh
from services.takes.recover import recover
from tests.evaluation.mixture import instants, mixture, with_viewers
from tests.evaluation.table import table

OF_VIEWERS = (m.Sighting, m.PartialBap, m.Silhouette, m.Preview)
PATIENCE_S = 60.0


class Feeder(threading.Thread):
    """Says what two viewers say, at a pace, until `stop`."""

    def __init__(self, endpoint: str, said: list[Envelope], fps: float) -> None:
        super().__init__(daemon=True)
        self._options = ZenohOptions(listen=(endpoint,), multicast_scouting=False)
        self._said, self._fps = said, fps
        self.stop = threading.Event()

    def run(self) -> None:
        clock = RealClock()
        groups = instants(self._said)
        with ZenohBus.open(self._options, "demo", clock) as bus:
            for each in self._said:
                if isinstance(each.message, m.CameraInfo | m.PartialBdp):
                    bus.publish(each.topic, each.message)
            start_s, frame = time.monotonic(), 0
            while not self.stop.is_set():
                for each in with_viewers(groups[frame % len(groups)], 2, frame, clock.now_ns()):
                    if isinstance(each.message, OF_VIEWERS):
                        bus.publish(each.topic, each.message)
                frame += 1
                time.sleep(max(0.0, start_s + frame / self._fps - time.monotonic()))


@dataclass(frozen=True)
class Killed:
    """after_s: from the beginning of the file to the kill.  lost_s: the end of that which is not in the file.

    trouble: why the take cannot be read or recovered.  recovered: messages, the same as were read.
    """

    after_s: float
    messages: int
    recovered: int
    lost_s: float
    trouble: str | None


def killed(endpoint: str, take: Path, after_s: float) -> Killed:
    """Start an integrator, kill it `after_s` seconds after its take is there, and look at that."""
    arguments = ["integrator", str(demo_rig_file()), "-o", str(take), "-e", endpoint, "--no-multicast-scouting"]
    process = subprocess.Popen([sys.executable, "-m", "services.cli", *arguments], stderr=subprocess.PIPE, text=True)
    try:
        end_s = time.monotonic() + PATIENCE_S
        while not take.exists():
            if process.poll() is not None or time.monotonic() > end_s:
                process.kill()
                raise RuntimeError(f"the integrator does not start: {process.communicate()[1]}")
            time.sleep(0.001)
        begun_ns = time.time_ns()
        time.sleep(after_s)
    finally:
        process.kill()
        killed_ns = time.time_ns()
        process.communicate()
    output = take.with_name(f"{take.stem}-recovered.mcap")
    read = Take(take)
    try:
        said = list(read.messages())
        found = recover(take, output)
        again = Take(output)
        same = list(again.messages()) == said and again.cut is None and again.attachments == read.attachments
    except (TakeError, RecordingError) as error:
        return Killed(after_s, 0, 0, after_s, str(error))
    last_ns = max([begun_ns, *(each.log_ns for each in said)])
    trouble = None if same and found.lost and read.cut else "recover does not give what was read, or says nothing is lost"
    return Killed(after_s, len(said), found.messages, (killed_ns - last_ns) / 1e9, trouble)


def main(count: int, seed: int, fps: float, within_s: float) -> int:
    chance = random.Random(seed)
    (place,) = mesh(free_ports(1))
    feeder = Feeder(place.listen, mixture(), fps)
    feeder.start()
    with tempfile.TemporaryDirectory() as folder:
        ends = [killed(place.listen, Path(folder) / f"{n}.mcap", chance.uniform(0, within_s)) for n in range(count)]
    feeder.stop.set()
    feeder.join()
    lost = sorted(end.lost_s for end in ends)
    rows = [
        ["kills", count],
        ["readable and recovered", sum(end.trouble is None for end in ends)],
        ["with messages", sum(end.messages > 0 for end in ends)],
        ["messages in the takes", sum(end.messages for end in ends)],
        ["messages recovered", sum(end.recovered for end in ends)],
        ["seconds lost, median", lost[len(lost) // 2]],
        ["seconds lost, most", lost[-1]],
    ]
    title = f"kill -9 of an integrator within {within_s:g} s, two viewers at {fps:g} frames/s, seed {seed}"
    print(table(title, ["", "result"], rows))
    for end in ends:
        if end.trouble:
            print(f"fault: killed after {end.after_s:.3f} s: {end.trouble}")
    return 1 if any(end.trouble for end in ends) else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fps", type=float, default=60.0)
    parser.add_argument("--within", type=float, default=5.0, metavar="S")
    options = parser.parse_args()
    sys.exit(main(options.count, options.seed, options.fps, options.within))
