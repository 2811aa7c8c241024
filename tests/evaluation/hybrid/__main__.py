"""What the tracker reaches on the shared clips: tables and plots of every part in one folder.

    python -m tests.evaluation.hybrid [--clips DIR] [--out DIR] [--seeds 5] [--only PART,...] [--jobs 2]

Without --only the short ones; `--only all` takes an hour or two.  What was run once for the code as it is, is kept in the
folder and not run again.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

from tests.evaluation.clips import SHARED
from tests.evaluation.hybrid.accuracy import accuracy
from tests.evaluation.hybrid.baselines import baselines
from tests.evaluation.hybrid.beam import beam
from tests.evaluation.hybrid.bench import Bench, Places
from tests.evaluation.hybrid.protocols import protocols
from tests.evaluation.hybrid.recovery import recovery
from tests.evaluation.hybrid.regions import regions
from tests.evaluation.hybrid.repeat import repeat
from tests.evaluation.hybrid.scaling import scaling
from tests.evaluation.hybrid.stages import stages
from tests.evaluation.hybrid.unfamiliar import unfamiliar
from tests.evaluation.sections import Section, markdown, report, write

PARTS: dict[str, Callable[[Bench], Section]] = {
    "accuracy": accuracy,
    "beam": beam,
    "recovery": recovery,
    "unfamiliar": unfamiliar,
    "protocols": protocols,
    "baselines": baselines,
    "regions": regions,
    "scaling": scaling,
    "stages": stages,
    "repeat": repeat,
}
SHORT = ("accuracy", "beam", "repeat")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, default=SHARED / "clips")
    parser.add_argument("--motions", type=Path, default=SHARED / "motions")
    parser.add_argument("--out", type=Path, default=Path("build") / "hybrid")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--only", default=",".join(SHORT), metavar="PART,...", help=f"of {', '.join(PARTS)}, or all")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    wanted = list(PARTS) if options.only == "all" else options.only.split(",")
    unknown = sorted(set(wanted) - set(PARTS))
    if unknown:
        parser.error(f"--only {', '.join(unknown)}: allowed: {', '.join(PARTS)}")
    if not options.clips.is_dir():
        print(f"hybrid: skipped: {options.clips} not there (the shared test clips lie beside the checkout)")
        return
    bench = Bench(Places(options.clips, options.motions, options.out), options.jobs, options.seeds)
    for name in wanted:
        print(name, flush=True)
        section = PARTS[name](bench)
        write(section, options.out)
        print("\n".join(map(markdown, section.tables)), flush=True)
    print(report(options.out, list(PARTS), "Hybrid tracker: what it reaches"))


if __name__ == "__main__":
    main()
