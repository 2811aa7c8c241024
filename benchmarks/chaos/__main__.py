"""Random faults against a whole rig: kills, stops, cuts, floods, full disks; and the invariants that must hold.

    python -m benchmarks.chaos [--seconds N] [--seed N] [--only NAME ...] [--schedule] [--keep DIR]

`zenocap up` runs three simulated cameras with tracker, recognizer, page and log around a router; a peer observes.  Needs
Linux (/proc), and the right to mount a tmpfs for the full disk.  Exit status 1 with a violation, which is printed with
seed, time and fault.
"""

import argparse
import itertools
import re
import signal
import sys
import tempfile
from pathlib import Path

from benchmarks.chaos.outcome import Limits
from benchmarks.chaos.report import as_text
from benchmarks.chaos.run import Run
from benchmarks.chaos.schedule import KINDS, schedule

MOST_S = 86_400.0  # longest run, a day
NAMES = sorted({name for kind in KINDS for name in (kind.name, *kind.targets) if name})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=120.0, help="time for faults, after the start of the rig")
    parser.add_argument("--seed", type=int, default=1, help="of the schedule: equal seeds give equal schedules")
    parser.add_argument("--size", default="160x120", help="of the images")
    parser.add_argument("--fps", type=float, default=15.0)
    parser.add_argument("--only", nargs="+", default=[], choices=NAMES, metavar="NAME", help=f"of {', '.join(NAMES)}")
    parser.add_argument("--recovery", type=float, default=5.0, metavar="S", help="longest time until poses are back")
    parser.add_argument("--schedule", action="store_true", help="print the first rounds of the schedule, and run nothing")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="empty folder that keeps the output of the services")
    arguments = parser.parse_args()
    for name in ("seconds", "fps", "recovery"):
        if not 0 < getattr(arguments, name) <= MOST_S:
            parser.error(f"--{name} {getattr(arguments, name):g}: allowed: above 0, up to {MOST_S:g}")
    if not re.fullmatch(r"[1-9]\d{1,3}x[1-9]\d{1,3}", arguments.size):
        parser.error(f"--size {arguments.size}: allowed: WIDTHxHEIGHT such as 160x120")
    if (
        arguments.keep is not None
        and arguments.keep.exists()
        and (not arguments.keep.is_dir() or any(arguments.keep.iterdir()))
    ):
        parser.error(f"--keep {arguments.keep}: allowed: a new or an empty folder")
    if arguments.schedule:
        for round in itertools.islice(schedule(arguments.seed, arguments.only), 40):
            print(f"after {round.pause_s:.1f} s: {round.name}")
        return 0
    if not Path("/proc/self/task").exists():
        print("error: processes are found in /proc, which this system does not have", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(2))  # ends the rig, as Ctrl-C does
    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        run = Run(arguments.seed, arguments.seconds, Limits(arguments.recovery), tuple(arguments.only), _say)
        try:
            outcome = run.run(folder, arguments.size, arguments.fps)
        except RuntimeError as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
    print(as_text(outcome))
    return 1 if outcome.violations else 0


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
