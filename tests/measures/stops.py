"""Stops of a whole rig, and starts again of its services: `python -m tests.measures.stops [STOPS]`.

A rig of three simulated cameras around a router is stopped with Ctrl-C, each time after one of its services was killed and
has worked again.  Printed: seconds of each stop, services that were killed because they hung, seconds from the end of a
service to the first health of the next process, beside the load of the machine.
"""

import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.chaos.observer import Observer
from benchmarks.chaos.running_rig import START_S, RunningRig, rig_file
from benchmarks.chaos.schedule import SERVICES
from zenocap.common.messages import PROCESS

RIG, SIZE, FPS = "stops", "160x120", 15.0
SETTLED_S = 11.0  # after which a process that ends is started again at once
STOPS = 20


@dataclass(frozen=True)
class Stop:
    """service, again_s: the one that was ended, and the time until the next process worked.  text: output of the rig.

    hung: number of services that were killed at the stop.  load: of the machine.
    """

    service: str
    again_s: float
    stop_s: float
    hung: int
    status: int | None
    load: float
    text: str


def stops(count: int, folder: Path, settled_s: float = SETTLED_S) -> Iterator[Stop]:
    """Starts and stops of a rig.  Raises RuntimeError when it does not start."""
    for number in range(count):
        place = folder / str(number)
        place.mkdir()
        yield stop_after(SERVICES[number % len(SERVICES)], place, settled_s)


def stop_after(service: str, folder: Path, settled_s: float, ended_by: signal.Signals = signal.SIGKILL) -> Stop:
    """Start a rig, end a service, and stop the rig when it works again.  Raises RuntimeError when it does not."""
    with RunningRig(folder, folder / "takes", rig_file(folder, RIG, SIZE, FPS, 0)) as rig:
        observer = Observer(rig.endpoint, RIG, [], SERVICES)
        observer.start()
        try:
            _until(rig, lambda: {one.service for one in observer.health} >= {*SERVICES})
            time.sleep(settled_s)
            known = {one.health.counts.get(PROCESS) for one in observer.health}
            begin_s = time.monotonic()
            rig.signal(rig.pid(service), ended_by)

            def works() -> bool:
                return any(
                    one.service == service and one.health.counts.get(PROCESS) not in known for one in observer.health
                )

            _until(rig, works)
            again_s = time.monotonic() - begin_s
        finally:
            observer.close()
        rig.stop()
        text = rig.log_text() + rig.output()
        return Stop(service, again_s, rig.stop_s, text.count("and was killed"), rig.status, os.getloadavg()[0], text)


def _until(rig: RunningRig, condition: Callable[[], bool]) -> None:
    if not rig.wait(condition, START_S):
        raise RuntimeError(f"the rig does not work: {rig.log_text()[-2000:]}")


def main(count: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        found = []
        for one in stops(count, Path(folder)):
            found.append(one)
            print(
                f"{one.service} again in {one.again_s:.1f} s, stop in {one.stop_s:.1f} s, load {one.load:.1f}", flush=True
            )
    seconds = [one.stop_s for one in found]
    print(f"{len(found)} stops: median {median(seconds):.1f} s, longest {max(seconds):.1f} s")
    print(f"services killed: {sum(one.hung for one in found)}; statuses {sorted({str(one.status) for one in found})}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else STOPS)
