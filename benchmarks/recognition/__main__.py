"""Accuracy of posture recognition: tables and confusion plots of every part in one folder.

    python -m benchmarks.recognition [--seeds 3] [--only PART,...] [--size WxH] [--minutes 10]
        [--poses METHOD,...] [--motions DIR] [--out DIR] [--jobs 2]

Takes are rendered and tracked once for the current code and kept in the folder: those of 12 people need 6 minutes of one
core for two-view, 17 for hybrid.  `hybrid-two-view`: the tracker with the two cameras of two-view.  --size: of the images,
for two-view, hybrid-two-view and hybrid; default: 160x120, and 240x180 for hybrid.  --poses: for the parts that compare
sources of poses (stream, false-rate, few, ablation).
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.clips import SHARED
from benchmarks.recognition.ablation import ablation
from benchmarks.recognition.accuracy import accuracy_of
from benchmarks.recognition.bench import POSES, Bench
from benchmarks.recognition.costs import costs
from benchmarks.recognition.false_rate import false_rate
from benchmarks.recognition.few import few
from benchmarks.recognition.one_person import one_person
from benchmarks.recognition.paper import as_in_the_paper
from benchmarks.recognition.real import real
from benchmarks.recognition.real_stream import real_stream
from benchmarks.recognition.settings import settings
from benchmarks.recognition.streaming import streaming
from benchmarks.sections import Section, markdown, report, write

PARTS: dict[str, Callable[[Bench], Section]] = {
    "truth": partial(accuracy_of, method="truth"),
    "two-view": partial(accuracy_of, method="two-view"),
    "hybrid-two-view": partial(accuracy_of, method="hybrid-two-view"),
    "hybrid": partial(accuracy_of, method="hybrid"),
    "paper": as_in_the_paper,
    "real": real,
    "stream": streaming,
    "real-stream": real_stream,
    "false-rate": false_rate,
    "few": few,
    "one-person": one_person,
    "ablation": ablation,
    "costs": costs,
    "settings": settings,
}
SHORT = ("truth", "two-view", "hybrid-two-view", "hybrid", "paper", "real", "stream", "real-stream", "costs")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", type=Path, default=SHARED / "motions")
    parser.add_argument("--out", type=Path, default=Path("build") / "recognition")
    parser.add_argument("--seeds", type=int, default=3, help="of people (default 3)")
    parser.add_argument("--people", type=int, default=12, help="of a seed (default 12)")
    parser.add_argument("--only", default=",".join(SHORT), metavar="PART,...", help=f"of {', '.join(PARTS)}, or all")
    parser.add_argument("--jobs", type=int, default=2, help="processes that film (default 2)")
    parser.add_argument("--size", metavar="WxH", help="of the images; default by method")
    parser.add_argument("--minutes", type=float, default=10.0, help="duration of the streams (default 10)")
    parser.add_argument(
        "--poses", default=",".join(POSES), metavar="METHOD,...", help=f"sources of poses (default {','.join(POSES)})"
    )
    options = parser.parse_args()
    if not 0.5 <= options.minutes <= 600.0:
        parser.error(f"--minutes {options.minutes:g}: allowed: 0.5 to 600")
    size = tuple(int(number) for number in options.size.split("x")) if options.size else None
    if size is not None and len(size) != 2:
        parser.error(f"--size {options.size}: allowed: WIDTHxHEIGHT, such as 640x480")
    wanted = list(PARTS) if options.only == "all" else options.only.split(",")
    unknown = sorted(set(wanted) - set(PARTS))
    if unknown:
        parser.error(f"--only {', '.join(unknown)}: allowed: {', '.join(PARTS)}")
    poses = tuple(method for method in POSES if method in options.poses.split(","))
    if unknown := sorted(set(options.poses.split(",")) - set(POSES)):
        parser.error(f"--poses {', '.join(unknown)}: allowed: {', '.join(POSES)}")
    bench = Bench(options.motions, options.out, options.seeds, options.people, options.jobs, size, options.minutes, poses)
    options.out.mkdir(parents=True, exist_ok=True)
    sized: list[str] = []
    for name in wanted:
        print(name, flush=True)
        section = PARTS[name](bench)
        write(section, options.out)
        sized += [section.name] if section.name not in PARTS else []
        print("\n".join((*section.notes, *map(markdown, section.tables))), flush=True)
    print(report(options.out, [*PARTS, *sized], "Recognition of postures"))


if __name__ == "__main__":
    main()
