"""Accuracy of posture recognition: tables and confusion plots of every part in one folder.

    python -m benchmarks.recognition [--seeds 3] [--only PART,...] [--motions DIR] [--out DIR] [--jobs 2]

Takes are rendered and tracked once for the current code and kept in the folder: those of 12 people need 6 minutes of one
core for two-view, 17 for hybrid.
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.clips import SHARED
from benchmarks.recognition.accuracy import accuracy_of
from benchmarks.recognition.bench import Bench
from benchmarks.recognition.costs import costs
from benchmarks.recognition.paper import as_in_the_paper
from benchmarks.recognition.real import real
from benchmarks.recognition.settings import settings
from benchmarks.recognition.streaming import streaming
from benchmarks.sections import Section, markdown, report, write

PARTS: dict[str, Callable[[Bench], Section]] = {
    "truth": partial(accuracy_of, method="truth"),
    "two-view": partial(accuracy_of, method="two-view"),
    "hybrid": partial(accuracy_of, method="hybrid"),
    "paper": as_in_the_paper,
    "real": real,
    "stream": streaming,
    "costs": costs,
    "settings": settings,
}
SHORT = ("truth", "two-view", "hybrid", "paper", "real", "stream", "costs")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", type=Path, default=SHARED / "motions")
    parser.add_argument("--out", type=Path, default=Path("build") / "recognition")
    parser.add_argument("--seeds", type=int, default=3, help="of people (default 3)")
    parser.add_argument("--people", type=int, default=12, help="of a seed (default 12)")
    parser.add_argument("--only", default=",".join(SHORT), metavar="PART,...", help=f"of {', '.join(PARTS)}, or all")
    parser.add_argument("--jobs", type=int, default=2, help="processes that film (default 2)")
    options = parser.parse_args()
    wanted = list(PARTS) if options.only == "all" else options.only.split(",")
    unknown = sorted(set(wanted) - set(PARTS))
    if unknown:
        parser.error(f"--only {', '.join(unknown)}: allowed: {', '.join(PARTS)}")
    bench = Bench(options.motions, options.out, options.seeds, options.people, options.jobs)
    options.out.mkdir(parents=True, exist_ok=True)
    for name in wanted:
        print(name, flush=True)
        section = PARTS[name](bench)
        write(section, options.out)
        print("\n".join((*section.notes, *map(markdown, section.tables))), flush=True)
    print(report(options.out, list(PARTS), "Recognition of postures"))


if __name__ == "__main__":
    main()
