"""How much the deployment can take, which settings of Zenoh that hangs on, and whether an hour leaves everything flat.

    python -m tests.evaluation.load [--out DIR] [--seconds N] [--only PART,...] [--soak MINUTES]

Needs a quiet machine: what other programs use of it stands in the tables.  Without --only the short ones; `--only all`
takes about an hour with 20 s a load, and the soak its minutes on top.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from common.runtime.signals import stop_signals
from services.load.plan import Plan
from services.load.shell import run_soak
from tests.evaluation.load.bench import Bench, bench
from tests.evaluation.load.grids import largest, meeting, rates, rigs, subscribers, viewers
from tests.evaluation.load.settings import settings
from tests.evaluation.sections import Section, markdown, report, write

PARTS: dict[str, Callable[[Bench], Section]] = {
    "rates": rates,
    "viewers": viewers,
    "rigs": rigs,
    "subscribers": subscribers,
    "meeting": meeting,
    "largest": largest,
    "settings": settings,
}
SHORT = ("rates", "meeting")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build") / "load")
    parser.add_argument("--seconds", type=float, default=20.0, help="measured of each load")
    parser.add_argument("--only", default=",".join(SHORT), metavar="PART,...", help=f"of {', '.join(PARTS)}, or all")
    parser.add_argument("--soak", type=float, default=0.0, metavar="MINUTES", help="then soak for so long at 30 frames/s")
    options = parser.parse_args()
    wanted = list(PARTS) if options.only == "all" else [name for name in options.only.split(",") if name]
    unknown = sorted(set(wanted) - set(PARTS))
    if unknown:
        parser.error(f"--only {', '.join(unknown)}: allowed: {', '.join(PARTS)}, all")
    with stop_signals() as stopped, bench(options.seconds, options.out, stopped) as one:
        for name in wanted:
            if stopped():
                break
            print(name, flush=True)
            section = PARTS[name](one)
            write(section, options.out)
            print("\n".join(map(markdown, section.tables)), flush=True)
        if options.soak and not stopped():
            run_soak(Plan(), options.soak, 60.0, one.session, options.out, Console(width=150))
    print(report(options.out, list(PARTS), "What the deployment can take"))


if __name__ == "__main__":
    main()
