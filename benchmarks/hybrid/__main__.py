"""Evaluation of the tracker on the shared clips: tables and plots of every part in one folder.

    python -m benchmarks.hybrid [--clips DIR] [--out DIR] [--seeds 5] [--only PART,...] [--jobs 2]
    python -m benchmarks.hybrid --only accuracy,angles [--clip NAME ...] [--priors shipped none] [--both-ways]

Without --only the short parts; `--only all` takes an hour or two.  Results of the current code are kept in the folder and
not computed again.
"""

import argparse
import shutil
from collections.abc import Callable
from pathlib import Path

from benchmarks.clips import SHARED
from benchmarks.hybrid.accuracy import PAIRS, SEVEN, accuracy
from benchmarks.hybrid.accuracy import PRIORS as PRIOR_KINDS
from benchmarks.hybrid.angles import angles
from benchmarks.hybrid.baselines import baselines
from benchmarks.hybrid.beam import beam
from benchmarks.hybrid.bench import Bench, Places
from benchmarks.hybrid.paper_figures import paper_figures
from benchmarks.hybrid.people import people
from benchmarks.hybrid.protocols import protocols
from benchmarks.hybrid.recovery import recovery
from benchmarks.hybrid.regions import regions
from benchmarks.hybrid.repeat import repeat
from benchmarks.hybrid.scaling import scaling
from benchmarks.hybrid.stages import stages
from benchmarks.hybrid.table_1 import table_1
from benchmarks.hybrid.table_2 import table_2
from benchmarks.hybrid.unfamiliar import unfamiliar
from benchmarks.sections import Section, markdown, report, write

PARTS: dict[str, Callable[[Bench], Section]] = {
    "accuracy": accuracy,
    "angles": angles,
    "table-1": table_1,
    "table-2": table_2,
    "people": people,
    "figures": paper_figures,
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
ONLY = "of accuracy and angles"
SHORT = ("accuracy", "angles", "beam", "repeat")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, default=SHARED / "clips")
    parser.add_argument("--motions", type=Path, default=SHARED / "motions")
    parser.add_argument("--out", type=Path, default=Path("build") / "hybrid")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="copy the pictures of the parts there")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--only", default=",".join(SHORT), metavar="PART,...", help=f"of {', '.join(PARTS)}, or all")
    parser.add_argument("--clip", nargs="+", choices=(*SEVEN, *PAIRS), default=(), metavar="NAME", help=f"{ONLY} (all)")
    parser.add_argument("--priors", nargs="+", choices=PRIOR_KINDS, default=PRIOR_KINDS[:1], help=f"{ONLY} (shipped)")
    parser.add_argument("--both-ways", action="store_true", help="accuracy: also of `zenocap track --both-ways`")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    wanted = list(PARTS) if options.only == "all" else options.only.split(",")
    unknown = sorted(set(wanted) - set(PARTS))
    if unknown:
        parser.error(f"--only {', '.join(unknown)}: allowed: {', '.join(PARTS)}")
    if not options.clips.is_dir():
        print(f"hybrid: skipped: {options.clips} missing (the shared test clips are expected beside the checkout)")
        return
    places = Places(options.clips, options.motions, options.out)
    bench = Bench(
        places, options.jobs, options.seeds, tuple(options.clip), tuple(options.priors), both_ways=options.both_ways
    )
    for name in wanted:
        print(name, flush=True)
        section = PARTS[name](bench)
        write(section, options.out)
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            for picture in section.pictures:
                shutil.copy(options.out / picture, options.pictures)
        print("\n".join(map(markdown, section.tables)), flush=True)
    print(report(options.out, list(PARTS), "Hybrid tracker: results"))


if __name__ == "__main__":
    main()
