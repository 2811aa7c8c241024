"""Stops of a whole rig, and starts again of its services: `python -m tests.measures.stops [STOPS]`.

A rig of three simulated cameras around a router is stopped with Ctrl-C, each time after one of its services was killed and
has worked again.  With --load N no service is killed: N processes that never wait begin when the rig works, LOADED_AFTER_S
before its stop.  Printed: a line for each stop, then a table: seconds of the stops, seconds from the end of a service to
the first health of the next process, of a viewer to the first with a frame (one a second), services that hung at a stop,
killed or not, starts that failed (of the rig, or of the service within three minutes).  The status is 1 where a limit is
broken.
"""

import argparse
import math
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.chaos.observer import Observer, SeenHealth
from benchmarks.chaos.running_rig import START_S, RunningRig, rig_file
from benchmarks.chaos.schedule import SERVICES, VIEWERS
from tests.measures.minutes import BUSY, beside
from zenocap.common.messages import PROCESS
from zenocap.common.runtime.frame_rate import PROCESSED
from zenocap.tools.record.launcher.child_processes import HANGING_S

RIG, SIZE, FPS = "stops", "160x120", 15.0
SETTLED_S = 11.0  # after which a process that ends is started again at once
LOADED_AFTER_S = 3.0
STOPS = 20
ALONE_S, LOADED_S, AGAIN_S = 2.0, 5.0, 3.0  # longest stop, without and with load, and start again of a service
HUNG = f"has not stopped in {HANGING_S:g} s"
WORDS = {True: "yes", False: "NO"}


@dataclass(frozen=True)
class Stop:
    """service, again_s: the one that was ended, and the time until the next process worked; "", nan beside a load.

    text: output of the rig.
    """

    service: str
    again_s: float
    stop_s: float
    status: int | None
    text: str

    @property
    def hung(self) -> int:
        """Number of services that had not stopped after HANGING_S, also where they were not killed."""
        return self.text.count(HUNG)


def stop_after(
    service: str, folder: Path, settled_s: float = SETTLED_S, ended_by: signal.Signals = signal.SIGKILL, load: int = 0
) -> Stop:
    """Start a rig, end a service ("": none), and stop the rig when it works again.  Raises RuntimeError when it does not.

    load: number of processes that never wait, from LOADED_AFTER_S before the stop.
    """
    folder.mkdir(exist_ok=True)
    with RunningRig(folder, folder / "takes", rig_file(folder, RIG, SIZE, FPS, 0)) as rig:
        observer = Observer(rig.endpoint, RIG, [], SERVICES)
        observer.start()
        try:
            _until(rig, lambda: {one.service for one in observer.health} >= {*SERVICES})
            time.sleep(settled_s)
            again_s = _again_s(rig, service, observer, ended_by) if service else math.nan
        finally:
            observer.close()
        with beside(BUSY if load else None, load):
            time.sleep(LOADED_AFTER_S if load else 0.0)
            rig.stop()
        return Stop(service, again_s, rig.stop_s, rig.status, rig.log_text() + rig.output())


def _again_s(rig: RunningRig, service: str, observer: Observer, ended_by: signal.Signals) -> float:
    known = {one.health.counts.get(PROCESS) for one in observer.health}
    begin_s = time.monotonic()
    rig.signal(rig.pid(service), ended_by)
    _until(rig, lambda: works(service, observer.health, known))
    return time.monotonic() - begin_s


def works(service: str, seen: Sequence[SeenHealth], known: Collection[int | None]) -> bool:
    """Whether a process of a service that is not known works: a viewer when it has had a frame."""
    found = [one.health.counts for one in seen if one.service == service and one.health.counts.get(PROCESS) not in known]
    return any(service not in VIEWERS or counts.get(PROCESSED) for counts in found)


def _until(rig: RunningRig, condition: Callable[[], bool]) -> None:
    if not rig.wait(condition, START_S):
        raise RuntimeError(f"the rig does not work: {rig.log_text()[-2000:]}")


def table(found: Sequence[Stop], failed: int, longest_s: float) -> tuple[list[str], bool]:
    """Lines of the table, and whether all limits hold.  failed: number of starts.  longest_s: that a stop may take."""
    times = {"stop of the rig, s": ([one.stop_s for one in found], longest_s)}
    for name in SERVICES:
        times[f"{name} again, s"] = [one.again_s for one in found if one.service == name], AGAIN_S
    counts = {"services that hung at a stop": sum(one.hung for one in found), "starts that failed": failed}
    lines = ["| what | times | median | p99 | worst | limit | holds |", "|---|--:|--:|--:|--:|--:|---|"]
    for what, (values, limit) in times.items():
        if values:
            cells = " | ".join(f"{each:.2f}" for each in (*np.percentile(values, (50, 99)), max(values), limit))
            lines.append(f"| {what} | {len(values)} | {cells} | {WORDS[max(values) <= limit]} |")
    lines += [f"| {what} |  |  |  | {count} | 0 | {WORDS[not count]} |" for what, count in counts.items()]
    return lines, not any(line.endswith(f"{WORDS[False]} |") for line in lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stops", nargs="?", type=int, default=STOPS)
    parser.add_argument("--load", type=int, default=0, help="processes that never wait, beside the rig (default: none)")
    chosen = parser.parse_args(arguments)
    found, failed = list[Stop](), 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(chosen.stops):
            service = "" if chosen.load else SERVICES[number % len(SERVICES)]
            begin = f"{number + 1} of {chosen.stops}: {service or f'beside {chosen.load} processes'}"
            try:
                one = stop_after(service, Path(folder) / str(number), 0.0 if chosen.load else SETTLED_S, load=chosen.load)
            except RuntimeError as error:
                failed += 1
                print(f"{begin}: {error}", flush=True)
                continue
            found.append(one)
            again = f" again in {one.again_s:.1f} s" if service else ""
            print(f"{begin}{again}, stop in {one.stop_s:.1f} s, {one.hung} hung, status {one.status}", flush=True)
    lines, holds = table(found, failed, LOADED_S if chosen.load else ALONE_S)
    print("\n".join(lines))
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
