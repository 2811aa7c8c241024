"""Capacity of a deployment, its dependence on Zenoh settings, and resource use over a long run.

    python -m benchmarks.load [--out DIR] [--seconds N] [--only PART,...] [--soak MINUTES]

Needs a quiet machine; the tables show the load of other programs.  Without --only the short parts run; `--only all` takes
about an hour at 20 s per load, plus the minutes of --soak.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

from benchmarks.sections import Section, markdown, report, write
from rich.console import Console

from benchmarks.load.bench import Bench, bench
from benchmarks.load.grids import capacity, network, rates, rigs, subscribers, unlimited, viewers
from benchmarks.load.overload import overload
from benchmarks.load.pages import pages
from benchmarks.load.predictions import predictions
from benchmarks.load.readers import readers
from benchmarks.load.settings import settings
from zenocap.common.runtime.signals import stop_signals
from zenocap.tools.load_test.plan import Plan
from zenocap.tools.load_test.shell import run_soak

PARTS: dict[str, Callable[[Bench], Section]] = {
    "rates": rates,
    "unlimited": unlimited,
    "viewers": viewers,
    "rigs": rigs,
    "subscribers": subscribers,
    "readers": readers,
    "pages": pages,
    "network": network,
    "capacity": capacity,
    "settings": settings,
    "overload": overload,
    "predictions": predictions,
}
SHORT = ("rates", "network")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build") / "load")
    parser.add_argument("--seconds", type=float, default=20.0, help="measuring time per load (s)")
    parser.add_argument("--only", default=",".join(SHORT), metavar="PART,...", help=f"of {', '.join(PARTS)}, or all")
    parser.add_argument(
        "--soak", type=float, default=0.0, metavar="MINUTES", help="long run at 30 frames/s after the other parts (minutes)"
    )
    options = parser.parse_args()
    wanted = list(PARTS) if options.only == "all" else [name for name in options.only.split(",") if name]
    unknown = sorted(set(wanted) - set(PARTS))
    if unknown:
        parser.error(f"--only {', '.join(unknown)}: allowed: {', '.join(PARTS)}, all")
    with stop_signals() as stopped, bench(options.seconds, options.out, stopped) as open_bench:
        for name in wanted:
            if stopped():
                break
            print(name, flush=True)
            section = PARTS[name](open_bench)
            write(section, options.out)
            print("\n".join(map(markdown, section.tables)), flush=True)
        if options.soak and not stopped():
            run_soak(Plan(), options.soak, 60.0, open_bench.session, options.out, Console(width=150))
    print(report(options.out, list(PARTS), "Capacity of the deployment"))


if __name__ == "__main__":
    main()
