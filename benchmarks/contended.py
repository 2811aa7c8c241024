"""A live rig beside busy processes: what is lost are whole instants, and nothing else.

    python -m benchmarks.contended [--seconds 30] [--rounds 1] [--views 2] [--size 640x480] [--fps 30] [--busy 2]

`zenocap up` runs viewers of rendered films, tracker, integrator and log; --seconds alone, as long beside --busy processes
that never wait, then some seconds alone.  seen: instants of which every viewer processed its frame.  latency: from the
capture to the log of the pose.  Whole instants may be lost if they are counted: dropped at the tracker's queue, unpaired
because their views came too far apart, or of one view only.  Every other loss is listed, and the exit status is 1: wrong
counts, messages, log entries, poses of processed instants, restarts.  The take is recomputed by `zenocap verify`.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.budgets import busy_processes
from benchmarks.live_losses import Account, Window, account, content, window
from benchmarks.sections import Row, Table, markdown
from zenocap.common.recording.reader import Take
from zenocap.services.tracker.shell import setup_of
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.scene import film, rig_files
from zenocap.tools.verify.recompute import verify
from zenocap.tools.verify.result import Verification
from zenocap.tools.verify.take_messages import messages_of, setup_in

START_S, END_S = 120.0, 60.0  # longest wait for the tracker, and for the end of the processes
SETTLE_S = 3.0  # before the first window and after the last one
TRACKING = re.compile(r"tracker: [\d.]+/s tracking")
ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Round:
    """Result of one run.  status: of `zenocap up`."""

    alone: Window
    contended: Window
    account: Account
    verified: Verification
    status: int

    @property
    def problems(self) -> list[str]:
        found = list(self.account.problems)
        wrong = (("different", self.verified.different), ("not in the log", self.verified.unlogged))
        found += [f"{counts.total()} recomputed messages {name}" for name, counts in wrong if counts.total()]
        return [*found, f"exit status {self.status}"] if self.status else found


def measured(plan: Plan, seconds: float, busy: int, folder: Path) -> Round:
    """Run a rig.  folder: of the films, which are kept, and of the take.  Raises RuntimeError when nothing is tracked."""
    film(folder, plan)
    (rig,) = rig_files(folder, plan)
    recordings = folder / "recordings"
    command = [sys.executable, "-P", "-m", "zenocap", "up", str(rig), "--recordings", str(recordings), "--no-page"]
    with (folder / "up.txt").open("w") as output:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
        process = subprocess.Popen(
            [*command, "--no-multicast-scouting"], stdout=output, stderr=subprocess.STDOUT, env=environment
        )
        try:
            _wait_for_tracking(process, folder / "up.txt")
            time.sleep(SETTLE_S)
            start_ns = time.time_ns()
            time.sleep(seconds)
            with busy_processes(busy):
                middle_ns = time.time_ns()
                time.sleep(seconds)
                end_ns = time.time_ns()
            time.sleep(SETTLE_S)
        finally:
            process.terminate()
            status = process.wait(END_S)
    (path,) = recordings.glob("*.mcap")
    file = Take(path)
    take = content(messages_of(file), plan.rig_names[0])
    setup = setup_of(setup_in(path, file), None)
    alone, contended = window(take, start_ns, middle_ns, plan.rate), window(take, middle_ns, end_ns, plan.rate)
    result = Round(alone, contended, account(take, setup), verify([path]), status)
    path.unlink()
    return result


def _wait_for_tracking(process: subprocess.Popen[bytes], output: Path) -> None:
    end_s = time.monotonic() + START_S
    while not TRACKING.search(output.read_text()):
        if process.poll() is not None or time.monotonic() > end_s:
            raise RuntimeError(f"the rig does not track:\n{output.read_text()[-2000:]}")
        time.sleep(0.2)


def tables(rounds: Sequence[Round], plan: Plan, seconds: float, busy: int) -> list[Table]:
    windows: list[Row] = []
    for number, one in enumerate(rounds, 1):
        for name, each in (("alone", one.alone), (f"beside {busy} busy processes", one.contended)):
            windows.append((f"round {number}, {name}", each.due, each.seen, each.poses, *each.latency_ms))
    accounts: list[Row] = []
    for number, one in enumerate(rounds, 1):
        fates = one.account.fates
        groups = (fates.tracked, fates.dropped, fates.unpaired, fates.single, fates.waiting)
        checked = one.verified.equal.total(), one.verified.unchecked.total()
        accounts.append((f"round {number}", *map(len, groups), *checked, "; ".join(one.problems) or "nothing"))
    title = f"{plan.title()}, live, {seconds:g} s each"
    return [
        Table(title, ("", "due", "seen", "poses", "p50 ms", "p99 ms", "worst ms"), tuple(windows)),
        Table(
            "Instants that reached the tracker, and everything else that was lost",
            ("", "tracked", "dropped", "unpaired", "one view", "waiting", "recomputed", "not checked", "other loss"),
            tuple(accounts),
        ),
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=30.0, help="of each window (default 30)")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--views", type=int, default=2)
    parser.add_argument("--size", default="640x480", metavar="WxH")
    parser.add_argument("--fps", type=float, default=30.0)
    parser.add_argument("--busy", type=int, default=2, help="processes that never wait (default 2)")
    options = parser.parse_args()
    width, height = (int(number) for number in options.size.split("x"))
    plan = Plan(viewers=options.views, rate=options.fps, size=(width, height), method="hybrid", name="contended")
    with TemporaryDirectory() as folder:
        rounds = [measured(plan, options.seconds, options.busy, Path(folder)) for _ in range(options.rounds)]
    print("\n".join(markdown(table) for table in tables(rounds, plan, options.seconds, options.busy)))
    return 1 if any(one.problems for one in rounds) else 0


if __name__ == "__main__":
    sys.exit(main())
